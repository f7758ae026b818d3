"""The product's default method with the shipped checkpoint: exact by the plant, inside limits, never NaN."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import Allocator, load_allocator
from finlab.allocation.learned.learned_allocator import CHUNK, LearnedAllocator
from finlab.assets import shipped_layouts
from finlab.errors import CheckpointError
from finlab.inference.checkpoint import read_checkpoint
from finlab.inference.weights import NetworkConfig, SurrogateConfig, TrainedWeights
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout, random_layout
from finlab.physics import Plant

GOOD = 5e-3
"""Normalized error below which an answer counts as exact here."""
HEAVE = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]


def reachable(layout: Layout, n: int, seed: int = 0) -> np.ndarray:
    """Wrenches (n, 6) of random commands, by the plant."""
    lower, upper = bounds(layout)
    share = np.random.default_rng(seed).uniform(size=(n, layout.n_fins, 3))
    return Plant(layout).wrench(lower + share * (upper - lower))


def bounds(layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    return (
        layout.lower,
        layout.upper,
    )


def keeps_limits(layout: Layout, command: np.ndarray) -> bool:
    lower, upper = bounds(layout)
    return bool(np.isfinite(command).all() and (command >= lower).all() and (command <= upper).all())


def errors(method: Allocator, layout: Layout, targets: np.ndarray) -> np.ndarray:
    """Normalized errors by the plant; commands must keep their limits to the last bit."""
    command = method.allocate_batch(layout, targets).command
    assert keeps_limits(layout, command)
    return method.normalization.error(Plant(layout).wrench(command), targets)


@pytest.mark.parametrize("name", list(shipped_layouts()))
def test_exact_on_shipped_layouts(name: str, learned: LearnedAllocator) -> None:
    layout = load_layout(shipped_layouts()[name])
    error = errors(learned, layout, reachable(layout, 25))
    if {fin.model for fin in layout.fins} == {FinModelSpec()}:
        assert error.max() < GOOD
    else:
        assert name == "mixed"  # fins of other kinds than the checkpoint has learned


def test_fins_of_another_kind_are_judged_by_what_they_really_do(learned: LearnedAllocator) -> None:
    layout = load_layout(shipped_layouts()["mixed"])
    result = learned.allocate(layout, reachable(layout, 1)[0])
    assert result.wrench_surrogate is not None
    believed = learned.normalization.error(result.wrench_surrogate, result.target)
    assert believed < GOOD < result.err_norm


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_exact_on_random_layouts(limits: str, learned: LearnedAllocator) -> None:
    for seed in range(5000, 5015):
        layout = random_layout(np.random.default_rng(seed), limits=limits)  # type: ignore[arg-type]
        assert errors(learned, layout, reachable(layout, 20, seed)).max() < GOOD, seed


def test_exact_outside_the_training_box_and_with_more_fins(learned: LearnedAllocator) -> None:
    for seed in range(5000, 5005):
        rng = np.random.default_rng(seed)
        wide = random_layout(rng, box=(0.45, 0.45, 0.2), outside=(0.3, 0.3, 0.1))
        many = random_layout(rng, n_fins=(6, 8))
        for layout in (wide, many):
            assert errors(learned, layout, reachable(layout, 10, seed)).max() < GOOD, seed


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_exact_after_the_loss_of_any_fin(name: str, learned: LearnedAllocator) -> None:
    layout = load_layout(shipped_layouts()[name])
    for fin in layout.names:
        for target in reachable(layout.without([fin]), 2):
            result = learned.allocate(layout, target, failed=[fin])
            assert result.err_norm < GOOD
            assert np.isnan(result.command[layout.index(fin)]).all()


SHARED = (0.1, 0.05, 0.0)
HOSTILE = {
    "one fin": Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),)),
    "two at one place": Layout("twins", (Fin("a", SHARED, 0.3), Fin("b", SHARED, 0.3))),
    "all parallel": Layout("rake", tuple(Fin(f"f{i}", (0.1 * i, 0.0, 0.0), 0.5) for i in range(4))),
    "no width": Layout(
        "stiff",
        (
            Fin("a", (0.1, 0.0, 0.0), 0.0, Limits((0.3, 0.3), (1.0, 1.0), (0.5, 0.5))),
            Fin("b", (-0.1, 0.0, 0.0), 1.0, Limits((0.05, 0.6), (2.0, 2.0), (-1.0, 1.0))),
            Fin("c", (0.0, 0.1, 0.0), 2.0),
        ),
    ),
    "may rest": Layout(
        "rest", (Fin("a", SHARED, 0.0, Limits((0.0, 0.6), (0.0, 2.1))), Fin("b", (0, 0, 0), 2.0))
    ),
    "far out": Layout("far", (Fin("a", (10.0, 10.0, 10.0), 0.0), Fin("b", (-10.0, 0.0, 0.0), 1.0))),
    "sixteen": Layout("many", tuple(Fin(f"f{i}", (0.1, 0.02 * i, 0.0), 0.4 * i) for i in range(16))),
}


@pytest.mark.parametrize("name", list(HOSTILE))
def test_hostile_layouts_get_numbers_inside_the_limits(name: str, learned: LearnedAllocator) -> None:
    layout = HOSTILE[name]
    easy = reachable(layout, 5)
    targets = np.concatenate([easy, -3.0 * easy, np.zeros((1, 6)), np.eye(6) * 1e6])
    command = learned.allocate_batch(layout, targets).command
    assert keeps_limits(layout, command)
    for target in (np.array(HEAVE), np.full(6, -1e6)):
        assert keeps_limits(layout, learned.allocate(layout, target).command)


@pytest.mark.parametrize("name", ["one fin", "two at one place", "all parallel", "may rest", "sixteen"])
def test_hostile_layouts_still_get_what_they_can_do(name: str, learned: LearnedAllocator) -> None:
    layout = HOSTILE[name]
    error = errors(learned, layout, reachable(layout, 10))
    assert np.median(error) < GOOD and error.max() < 0.1


def test_what_cannot_be_done_is_done_as_far_as_possible(learned: LearnedAllocator) -> None:
    result = learned.allocate(HOSTILE["one fin"], [0.0, 50.0, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(result.command[0], [0.6, 2.1, 0.0], atol=1e-2)
    assert result.unallocated[1] > 40.0


def test_the_same_question_gets_the_same_answer(
    learned: LearnedAllocator, default_checkpoint: TrainedWeights
) -> None:
    layout = load_layout(shipped_layouts()["A"])
    target = reachable(layout, 1)[0]
    first = learned.allocate(layout, target, seed=3)
    learned.allocate(layout, -target, seed=9)  # what was asked in between leaves no trace
    for other in (learned, LearnedAllocator(default_checkpoint)):
        again = other.allocate(layout, target, seed=3)
        np.testing.assert_array_equal(again.command, first.command)
        assert again.candidates is not None and first.candidates is not None
        np.testing.assert_array_equal(again.candidates.command, first.candidates.command)


def test_many_targets_are_answered_as_well_as_one(learned: LearnedAllocator) -> None:
    layout = load_layout(shipped_layouts()["A"])
    targets = reachable(layout, CHUNK + 3)
    batch = learned.allocate_batch(layout, targets)
    error = learned.normalization.error(Plant(layout).wrench(batch.command), targets)
    assert error.max() < GOOD
    for row in (0, 1, CHUNK - 1, CHUNK, CHUNK + 2):  # around the seam of two chunks
        assert learned.allocate(layout, targets[row]).err_norm < GOOD
    assert batch.wrench_surrogate is not None
    np.testing.assert_allclose(batch.wrench_surrogate, targets, atol=0.01)


def test_no_targets_get_no_answers(learned: LearnedAllocator) -> None:
    assert learned.allocate_batch(HOSTILE["one fin"], np.zeros((0, 6))).command.shape == (0, 1, 3)


def test_candidates_are_offered_best_first(learned: LearnedAllocator) -> None:
    layout = load_layout(shipped_layouts()["B"])
    result = learned.allocate(layout, reachable(layout, 1, seed=4)[0])
    candidates, samples = result.candidates, result.samples
    assert candidates is not None and samples is not None
    np.testing.assert_array_equal(candidates.command[0], result.command)
    exact = candidates.err_norm < 2e-4
    assert exact[0] and (np.diff(candidates.energy[exact]) >= 0).all()
    assert (np.sort(exact)[::-1] == exact).all()  # the exact ones come first
    for command, wrench, error in zip(
        candidates.command, candidates.wrench, candidates.err_norm, strict=True
    ):
        assert keeps_limits(layout, command)
        np.testing.assert_allclose(wrench, Plant(layout).wrench(command), atol=0.01)
        scored = learned.normalization.error(wrench, result.target)
        assert scored == pytest.approx(error, abs=1e-6)
    assert samples.command.shape == (64, layout.n_fins, 3) and len(samples.source) == 64
    assert keeps_limits(layout, samples.command)
    assert (np.diff(samples.err_norm) >= 0).all()


@pytest.mark.parametrize(
    "options",
    [
        {"n_candidates": 1},
        {"n_candidates": 200, "temperature": 1.0},
        {"temperature": 0.0},
        {"gamma": 0.0},
        {"gamma": 10.0},
        {"subsets": False},
        {"n_refined": 1, "n_seeds": 1},
    ],
)
def test_every_option_still_answers_exactly(
    options: dict[str, float], default_checkpoint: TrainedWeights
) -> None:
    method = LearnedAllocator(default_checkpoint, **options)  # type: ignore[arg-type]
    layout = load_layout(shipped_layouts()["A"])
    result = method.allocate(layout, reachable(layout, 1)[0])
    assert result.err_norm < GOOD and keeps_limits(layout, result.command)
    assert result.samples is not None
    assert len(result.samples.command) == options.get("n_candidates", 64)


def test_a_network_that_learned_nothing_still_keeps_the_limits(untrained_checkpoint: Path) -> None:
    method = load_allocator(checkpoint=untrained_checkpoint)
    for layout in (HOSTILE["no width"], load_layout(shipped_layouts()["restricted"])):
        assert keeps_limits(layout, method.allocate_batch(layout, reachable(layout, 5)).command)


def test_refuses_checkpoints_of_the_other_kind(untrained_checkpoint: Path) -> None:
    whole = read_checkpoint(untrained_checkpoint)
    with pytest.raises(CheckpointError, match="'untrained'.* holds a surrogate only"):
        LearnedAllocator(replace(whole, network_config=None, network={}))
    per_fin = NetworkConfig(features="raw", joint=False, width=8, heads=2, feedforward=8, n_components=2)
    with pytest.raises(CheckpointError, match="needs a joint-mixture network"):
        LearnedAllocator(replace(whole, network_config=per_fin))
    with pytest.raises(CheckpointError, match="kind `coefficient`, got 'mlp'; use method `paper`"):
        LearnedAllocator(replace(whole, surrogate_config=SurrogateConfig("mlp", (8,))))


def test_turning_the_robot_does_not_make_it_worse(learned: LearnedAllocator) -> None:
    layout = load_layout(shipped_layouts()["C"])
    yaw = 0.8
    c, s = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    fins = [
        Fin(fin.name, tuple((rotation @ fin.position).tolist()), fin.mounting_angle + yaw, fin.limits)
        for fin in layout.fins
    ]
    turned = Layout("turned", tuple(fins))
    targets = reachable(layout, 10)
    rotated = np.concatenate([targets[:, :3] @ rotation.T, targets[:, 3:] @ rotation.T], axis=1)
    straight = learned.allocate_batch(layout, targets).command
    again = learned.allocate_batch(turned, rotated).command
    assert learned.normalization.error(Plant(turned).wrench(again), rotated).max() < GOOD
    # Forces in the fins' own frames know nothing of where forward is: the old answer serves the new robot.
    np.testing.assert_allclose(Plant(turned).wrench(straight), rotated, atol=0.02)
