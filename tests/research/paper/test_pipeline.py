"""The paper's own pipeline on untrained networks: repeatable, inside limits, and refinement
refines."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch

from finlab.assets import shipped_layouts
from finlab.axes import is_full_turn
from finlab.errors import AllocationError, CheckpointError
from finlab.files.checkpoint_config import WrenchNormalization
from finlab.layout import Fin, Layout, Limits, load_layout
from finlab.physics import Plant
from finlab.physics.objective import command_effort
from finlab.research.networks.trained import (
    TrainedWeights,
    sizes_for_file,
    to_command,
    to_normalized,
)
from finlab.research.paper.network import NetworkConfig
from finlab.research.paper.pipeline import ADAM_RATE, CHUNK
from finlab.research.paper.surrogate import SurrogateConfig
from finlab.research.training.loop import first_weights
from tests.allocator_cache import AllocatorCache, normalized_error
from tests.research.paper.surrogate_in_torch import wrench_in_torch
from tests.torch_weights import arrays_of

TARGET = [0.5, -0.3, 1.0, 0.05, -0.02, 0.1]
"""A wrench within reach of the robots here [N, N m]."""


@pytest.fixture(scope="module")
def checkpoint() -> TrainedWeights:
    """A small network and surrogate of the paper's kind, with random weights."""
    sizes = NetworkConfig(width=16, heads=2, transformer_layers=1, feedforward=16, n_components=4)
    surrogate = SurrogateConfig((32,))
    return TrainedWeights(
        name="tiny",
        surrogate_sizes={"kind": "mlp", "hidden": [32]},
        surrogate=arrays_of(first_weights(surrogate.shapes(), 1)),
        normalization=WrenchNormalization(
            np.full(6, 0.01), np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])
        ),
        fin_model={"type": "drag"},
        network_sizes=sizes_for_file(sizes),
        network=arrays_of(first_weights(sizes.shapes(), 0)),
    )


@pytest.fixture
def robot() -> Layout:
    """Layout A with a fin confined to an arc and one that cannot move at all."""
    layout = load_layout(shipped_layouts()["A"])
    first, second = layout.names[:2]
    arc = Limits(zero_direction=(0.3, 1.7))
    stiff = Limits((0.3, 0.3), (1.1, 1.1), (0.7, 0.7))
    return layout.replace_actuator(first, limits=arc).replace_actuator(second, limits=stiff)


def is_within_limits(layout: Layout, command: np.ndarray) -> bool:
    """Whether commands (..., n, 3) are finite and within the limits of a robot."""
    lower = layout.lower
    upper = layout.upper
    return bool(
        np.isfinite(command).all() and (command >= lower).all() and (command <= upper).all()
    )


ABLATIONS: list[dict[str, object]] = [
    {},
    {"refinement": "none"},
    {"mean_only": True},
    {"warm_start": "random"},
    {"ranking": "nll"},
    {"ranking": "nll", "refinement": "none"},
    {"n_candidates": 1},
    {"temperature": 1.0, "n_refined": 100},
]
"""Settings that leave out parts of the method."""


@pytest.mark.parametrize("options", ABLATIONS)
def test_every_variant_keeps_the_limits_bit_for_bit(
    options: dict[str, object], checkpoint: TrainedWeights, robot: Layout
) -> None:
    method = AllocatorCache("paper", checkpoint, n_steps=5, **options)  # type: ignore[arg-type]
    targets = np.random.default_rng(0).normal(size=(6, 6)) * np.array(
        [[1.0], [1], [1], [50], [0], [1e5]]
    )
    assert is_within_limits(robot, method.allocate_batch(robot, targets).command)
    result = method.allocate(robot, TARGET, seed=1)
    assert is_within_limits(robot, result.command)
    assert result.candidates is not None and result.samples is not None
    assert is_within_limits(robot, result.candidates.command) and is_within_limits(
        robot, result.samples.command
    )


@pytest.mark.parametrize("options", ABLATIONS)
def test_the_same_seed_gives_the_same_answer(
    options: dict[str, object], checkpoint: TrainedWeights, robot: Layout
) -> None:
    method = AllocatorCache("paper", checkpoint, n_steps=5, **options)  # type: ignore[arg-type]
    first, second, other = (method.allocate(robot, TARGET, seed=seed).command for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, second)
    if not options.get("mean_only"):
        assert not np.array_equal(first, other)


def test_refinement_lowers_what_the_surrogate_sees(
    checkpoint: TrainedWeights, robot: Layout
) -> None:
    def believed(**options: object) -> float:
        method = AllocatorCache("paper", checkpoint, **options)  # type: ignore[arg-type]
        wrench = method.allocate_batch(robot, targets).wrench_expected
        return float(normalized_error(method.normalization, wrench, targets).mean())

    targets = np.random.default_rng(1).normal(size=(10, 6)) * checkpoint.normalization.std
    mean = believed(mean_only=True)
    ranked = believed(refinement="none")
    refined = believed()
    assert refined < 0.9 * ranked < 0.9 * mean


def test_candidates_come_best_first(checkpoint: TrainedWeights, robot: Layout) -> None:
    """By J, so that the answer is the first of them."""
    method = AllocatorCache(
        "paper", checkpoint, n_candidates=20, n_refined=3, n_steps=5, gamma=0.01
    )
    result = method.allocate(robot, TARGET)
    assert result.candidates is not None and result.samples is not None
    np.testing.assert_array_equal(result.candidates.command[0], result.command)
    assert (
        result.candidates.source == ("refined",) * 3 and result.samples.source == ("sample",) * 20
    )
    for offered in (result.candidates, result.samples):
        j_norm = normalized_error(method.normalization, offered.wrench, np.array(TARGET)) ** 2
        assert (np.diff(j_norm + 0.01 * offered.effort) >= -1e-5).all()
        error = np.linalg.norm((offered.wrench - TARGET) / result.scale, axis=-1)
        np.testing.assert_allclose(offered.err_norm, error, atol=1e-3)


def test_failed_fins_are_left_out(checkpoint: TrainedWeights, robot: Layout) -> None:
    method = AllocatorCache("paper", checkpoint, n_steps=5)
    lost = robot.names[2]
    result = method.allocate(robot, TARGET, lost=[lost])
    assert np.isnan(result.command[2]).all()
    expected = method.allocate(robot.without([lost]), TARGET).command
    np.testing.assert_array_equal(np.delete(result.command, 2, axis=0), expected)


def test_targets_beyond_one_chunk_get_their_answers(checkpoint: TrainedWeights) -> None:
    method = AllocatorCache("paper", checkpoint, n_candidates=2, refinement="none")
    layout = Layout("pair", (Fin("a", (0.1, 0.0, 0.0), 0.0), Fin("b", (-0.1, 0.0, 0.0), 2.0)))
    targets = np.random.default_rng(0).normal(size=(CHUNK + 1, 6))
    batch = method.allocate_batch(layout, targets)
    assert batch.command.shape == (CHUNK + 1, 2, 3)
    last = method.allocate_batch(layout, targets[CHUNK:], seed=CHUNK)
    np.testing.assert_allclose(batch.command[CHUNK], last.command[0], atol=1e-6)


def test_the_shipped_networks_reach_the_target() -> None:
    method = AllocatorCache("paper")
    layout = load_layout(shipped_layouts()["A"])
    lower = layout.lower
    upper = layout.upper
    share = np.random.default_rng(0).uniform(size=(10, layout.n_fins, 3))
    targets = Plant(layout).wrench(lower + share * (upper - lower))
    command = method.allocate_batch(layout, targets).command
    assert (
        np.median(normalized_error(method.normalization, Plant(layout).wrench(command), targets))
        < 0.05
    )


def test_refuses_a_checkpoint_without_network(checkpoint: TrainedWeights) -> None:
    alone = replace(checkpoint, name="alone", network_sizes=None, network={})
    with pytest.raises(CheckpointError, match="checkpoint 'alone' holds no network, expected one"):
        AllocatorCache("paper", alone).on(load_layout("A"))


def tensors_of_robot(robot: Layout) -> list[torch.Tensor]:
    """Positions, angles and limits of a robot as tensors."""
    layout = (robot.position, robot.mounting_angle, robot.lower, robot.upper)
    return [torch.tensor(part, dtype=torch.float32) for part in layout]


def test_adam_goes_where_torch_goes(checkpoint: TrainedWeights, robot: Layout) -> None:
    """The whole refinement in PyTorch, from the raw candidates that the method drew."""
    method = AllocatorCache(
        "paper", checkpoint, n_candidates=3, n_refined=3, gamma=0.05, n_steps=25
    )
    before = AllocatorCache(
        "paper", checkpoint, n_candidates=3, n_refined=3, gamma=0.05, refinement="none"
    )
    target = np.array(TARGET) * 0.3
    start = before.allocate(robot, target).candidates
    assert start is not None
    layout = tensors_of_robot(robot)
    std = torch.tensor(method.normalization.std, dtype=torch.float32)
    wanted = torch.tensor(target, dtype=torch.float32)
    lower, upper = layout[2:]
    x = to_normalized(
        torch.tensor(start.command, dtype=torch.float32), lower, upper
    ).requires_grad_(True)
    optimizer = torch.optim.Adam([x], lr=ADAM_RATE)
    turns = torch.tensor(is_full_turn(robot.upper[:, 2] - robot.lower[:, 2]))
    best = x.detach().clone()
    least = torch.full((3,), torch.inf)
    for step in range(26):
        optimizer.param_groups[0]["lr"] = ADAM_RATE * (1.0 - 0.95 * step / 25)
        command = to_command(x, lower, upper)
        error = (wrench_in_torch(checkpoint, robot, command) - wanted) / std
        a, f, d = (command / upper.abs()).unbind(-1)
        effort = (a * a + f * f + 0.1 * d * d + a * f).sum(-1)
        score = error.square().sum(-1) + 0.05 * effort
        better = score < least
        best[better] = x.detach()[better]
        least[better] = score.detach()[better]
        optimizer.zero_grad()
        score.sum().backward()
        optimizer.step()
        with torch.no_grad():
            x[..., 2] = torch.where(turns, (x[..., 2] + 1.0) % 2.0 - 1.0, x[..., 2])
            x.clamp_(-1.0, 1.0)
    expected = to_command(best, lower, upper).numpy()
    assert np.abs(expected - start.command).max() > 0.1
    got = method.allocate(robot, target).candidates
    assert got is not None
    # Both list their candidates best first; those that were refined may have changed places.
    distance = np.abs(got.command[:, None] - expected[None]).max((2, 3))
    np.testing.assert_allclose(distance.min(1), 0.0, atol=2e-4)
    assert sorted(distance.argmin(1)) == [0, 1, 2]


def test_the_shipped_checkpoint_answers_without_torch() -> None:
    code = (
        "import sys\n"
        "sys.modules['torch'] = None\n"
        "import finlab\n"
        "allocator = finlab.Allocator(finlab.load_layout('A'), 'paper')\n"
        "print(allocator.allocate([1, 0, 0.5, 0, 0, 0.1]).command.shape)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout == "(4, 3)\n"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_candidates": 0}, "n_candidates: expected"),
        ({"n_refined": 0}, "n_refined: expected"),
        ({"temperature": -0.1}, "temperature: expected"),
        ({"temperature": float("nan")}, "temperature: expected"),
        ({"refinement": "magic"}, "refinement: expected one of none, adam, got 'magic'"),
    ],
)
def test_refuses_settings_that_leave_nothing_to_answer_with(
    options: dict[str, object], message: str, checkpoint: TrainedWeights
) -> None:
    with pytest.raises(AllocationError, match=message):
        AllocatorCache("paper", checkpoint, **options)


def test_each_ranking_takes_what_it_ranks_first(checkpoint: TrainedWeights) -> None:
    """Unrefined, the answer is the likeliest sample, or the one with the least J = J_norm + gamma
    J_en."""
    layout = load_layout(shipped_layouts()["A"])
    target = np.array([TARGET])
    chosen = {}
    for ranking in ("physics", "nll"):
        options = {"ranking": ranking, "refinement": "none", "n_candidates": 12, "gamma": 0.2}
        paper = AllocatorCache("paper", checkpoint, **options)
        method = paper.method(layout)
        std = paper.normalization.std
        mixture = method._predict((target - paper.normalization.mean) / std)
        sampled = method._commands.feasible(to_command(method._draw(mixture, 3), *method.limits))[0]
        if ranking == "nll":
            x = to_normalized(sampled[None], *method.limits)
            best = int(np.argmax(mixture.log_prob(x).sum(-1)))
        else:
            error = (method.surrogate.wrench(sampled) - target) / std
            best = int(np.argmin((error**2).sum(1) + 0.2 * command_effort(sampled, layout.upper)))
        chosen[ranking] = best
        answer = paper.allocate(layout, target[0], seed=3)
        np.testing.assert_allclose(answer.command, sampled[best], atol=1e-6)
    assert chosen["physics"] != chosen["nll"]
