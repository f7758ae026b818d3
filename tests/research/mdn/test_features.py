"""What the network of method `mdn` sees: it decides the problem, and knows of no size, axis or
frame."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal

from finlab.assets import checkpoint_path
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.physics import plant_of
from finlab.physics.objective import effort_of_shares
from finlab.research.mdn.answers import effort_robot
from finlab.research.mdn.descent import EffortProblem, realize, wrench
from finlab.research.mdn.features import (
    SHARES,
    VECTORS,
    RobotView,
    features,
    features_of,
    robot_view,
)
from finlab.research.mdn.network import NODE_SIZE, PAIR_SIZE, ForceMixture, ForceNetworkConfig
from finlab.research.networks.checkpoint import read_checkpoint
from finlab.research.random_layouts import random_layout

WRENCH_SCALE = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])
"""Scale of errors in the six axes [N, N m]."""


def problem_of(layout: Layout, std: np.ndarray = WRENCH_SCALE) -> EffortProblem:
    """The problem of least effort of a robot."""
    return effort_robot(plant_of(layout), std).forces


@pytest.fixture(params=[2, 5, 12])
def layout(request: pytest.FixtureRequest) -> Layout:
    """Fins with limits of their own, one of which pushes unevenly and leans."""
    layout = random_layout(
        np.random.default_rng(request.param), n_fins=request.param, limits="varied"
    )
    uneven = FinModelSpec("soft", (("d", 0.2), ("e", 0.25), ("phi_e", 1.0)))
    return layout.replace_actuator("fin_1", model=uneven)


def acted(view: RobotView, share: np.ndarray) -> np.ndarray:
    """P x for shares (n,), complex."""
    a, b = view.blocks
    return np.asarray(a @ share + b @ share.conj())


def test_forces_that_give_the_wrench_are_those_that_give_the_least_shares(layout: Layout) -> None:
    problem = problem_of(layout)
    view = robot_view(problem)
    rng = np.random.default_rng(0)
    share = rng.normal(size=(4, layout.n_fins)) + 1j * rng.normal(size=(4, layout.n_fins))
    force = share * view.largest
    target = wrench(problem, force)
    for row in range(4):
        # P x = p for every x that gives the target, and P is a projection up to its regularization.
        np.testing.assert_allclose(acted(view, share[row]), target[row] @ view.solver, atol=1e-3)
        twice = acted(view, acted(view, share[row]))
        np.testing.assert_allclose(twice, acted(view, share[row]), atol=1e-3)


def seen(layout: Layout, target: np.ndarray, std: np.ndarray = WRENCH_SCALE) -> list[np.ndarray]:
    """What is seen of a target (6,) [N, N m]."""
    found = features_of(robot_view(problem_of(layout, std)), target[None] / std)
    return [found.nodes[0], found.pairs[0]]


def test_a_fins_own_vectors_are_turned_to_its_force() -> None:
    """Two fins by hand: what is asked of them, and what they are, in the frame of that."""
    rng = np.random.default_rng(1)
    angle = np.array([0.5, -2.0])
    size = np.array([2.0, 0.3])
    static = rng.normal(size=(1, 2, NODE_SIZE - 6))
    none = np.zeros((1, 2, 2), complex)
    found = features((size * np.exp(1j * angle))[None], static, none, none)
    np.testing.assert_allclose(found.frame[0], np.exp(1j * angle))
    nodes = found.nodes[0].astype(np.float64)
    own = static[0]
    np.testing.assert_allclose(nodes[:, 0], np.sqrt(size), rtol=1e-6)
    np.testing.assert_allclose(nodes[:, 1], size / (1.0 + size), rtol=1e-6)
    np.testing.assert_allclose(nodes[:, 2], np.log(size + 1e-3) / 7.0, rtol=1e-6)
    plain = np.ones(NODE_SIZE - 6, bool)
    for place in VECTORS:
        plain[[place, place + 1]] = False
        x = own[:, place]
        y = own[:, place + 1]
        turned = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
        np.testing.assert_allclose(nodes[:, 6 + place], turned[0], atol=1e-6)
        np.testing.assert_allclose(nodes[:, 7 + place], turned[1], atol=1e-6)
    np.testing.assert_allclose(nodes[:, 6:][:, plain], own[:, plain], rtol=1e-6)


def test_a_fin_with_stops_is_seen_within_them() -> None:
    """The mean direction of an arc of half h is sin(h) / h ahead of its middle; an even fin reaches
    all."""
    arc = Limits(zero_direction=(-0.5, 1.7))
    layout = Layout("arc", (Fin("a", (0.2, 0.1, 0.0), 0.3, arc), Fin("b", (-0.2, 0.1, 0.0), 2.0)))
    static = robot_view(problem_of(layout)).static
    half = 1.1
    reach = 1 + len(SHARES)
    np.testing.assert_allclose(static[:, reach], 1.0, rtol=1e-6)
    ahead = static[:, reach + 1] + 1j * static[:, reach + 2]
    assert ahead[0] == pytest.approx(2.0 * np.sin(half) / half * np.exp(0.6j), abs=0.12)
    assert ahead[1] == pytest.approx(0.0, abs=1e-6), "a circle has no middle"
    assert VECTORS[0] == reach + 1


def test_turning_the_robot_changes_nothing(layout: Layout) -> None:
    target = np.array([1.0, -0.4, 0.6, 0.02, -0.05, 0.1])
    yaw = 0.8
    c = np.cos(yaw)
    s = np.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    fins = tuple(
        replace(
            fin,
            position=tuple((rotation @ fin.position).tolist()),
            mounting_angle=float(np.angle(np.exp(1j * ((fin.mounting_angle or 0.0) + yaw)))),
        )
        for fin in layout.fins
    )
    turned = np.concatenate([rotation @ target[:3], rotation @ target[3:]])
    even = np.array([1.0, 1.0, 1.0, 0.2, 0.2, 0.2])  # a wrench scale that turns along
    before = seen(layout, target, even)
    after = seen(replace(layout, actuators=fins), turned, even)
    for a, b in zip(before, after, strict=True):
        np.testing.assert_allclose(a, b, atol=2e-3)


def test_a_robot_with_fins_of_another_size_is_seen_as_the_same() -> None:
    target = np.array([1.0, -0.4, 0.6, 0.02, -0.05, 0.1])
    layout = random_layout(np.random.default_rng(3), n_fins=5)
    larger = layout
    for name in layout.names:
        larger = larger.replace_actuator(name, model=FinModelSpec("drag", (("area", 0.06),)))
    for a, b in zip(seen(layout, target), seen(larger, 3.0 * target), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_documented_features_of_a_hand_made_fin() -> None:
    layout = random_layout(np.random.default_rng(1), n_fins=1)
    problem = problem_of(layout)
    top = problem.fins.maximum[0]
    target = 0.25 * top * problem.effectiveness[1]  # a quarter of its force, straight up
    found = features_of(robot_view(problem), target[None])
    node = found.nodes[0, 0]
    assert node.shape == (NODE_SIZE,) and found.frame[0, 0] == pytest.approx(1j, abs=1e-4)
    np.testing.assert_allclose(node[:3], [0.5, 0.2, np.log(0.251) / 7.0], atol=1e-3)
    np.testing.assert_allclose(
        node[3:6], [1.0, 0.0, 0.0], atol=1e-3
    )  # the only fin: all depends on it
    assert node[6] == 0.0 and (np.diff(node[7:11]) > 0).all()
    np.testing.assert_allclose(
        node[11:16], [1.0, 0.0, 0.0, 0.0, 0.0], atol=1e-6
    )  # the same all round
    rest = problem.fins.smallest[0] / top
    assert node[16] == pytest.approx(np.sqrt(rest), rel=1e-6)
    np.testing.assert_allclose(node[17:20], [1.0, 0.0, 0.0], atol=1e-6)  # a full circle
    # Zero direction 0 is a quarter of a turn behind straight up.
    assert node[20] > 0.0 and node[21:23] == pytest.approx([0.0, -1.0], abs=1e-3)
    assert node[25] == pytest.approx(1 / 12)


def test_no_target_is_no_trouble(layout: Layout) -> None:
    found = features_of(robot_view(problem_of(layout)), np.zeros((2, 6)))
    assert np.isfinite(found.nodes).all() and np.isfinite(found.pairs).all()
    np.testing.assert_array_equal(found.frame, 1.0)


WEIGHTS = read_checkpoint(checkpoint_path())
"""The checkpoint in the tree."""
CONFIG = WEIGHTS.network_of(ForceNetworkConfig)
"""Sizes of its network."""


def random_inputs(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Features of nodes and of pairs, for six robots of n fins."""
    rng = np.random.default_rng(n)
    sizes = (6, n, NODE_SIZE), (6, n, n, PAIR_SIZE)
    nodes, pairs = (rng.normal(size=size).astype(np.float32) for size in sizes)
    return nodes, pairs


@pytest.mark.parametrize("n", [1, 5, 12])
def test_numpy_and_torch_agree(n: int) -> None:
    nodes, pairs = random_inputs(n)
    tensors = {name: torch.tensor(value) for name, value in WEIGHTS.network.items()}
    expected = CONFIG(tensors, torch.tensor(nodes), torch.tensor(pairs))
    for got, other in zip(CONFIG(WEIGHTS.network, nodes, pairs), expected, strict=True):
        assert got.dtype == np.float32
        np.testing.assert_allclose(got, other.numpy(), atol=1e-3, rtol=1e-3)


def test_fins_may_come_in_any_order() -> None:
    nodes, pairs = random_inputs(5)
    order = np.array([3, 0, 4, 1, 2])
    straight = CONFIG(WEIGHTS.network, nodes, pairs)
    turned = CONFIG(WEIGHTS.network, nodes[:, order], pairs[:, order][:, :, order])
    np.testing.assert_allclose(turned.logits, straight.logits, atol=1e-3)
    np.testing.assert_allclose(turned.mean, straight.mean[:, order], atol=1e-3)
    np.testing.assert_allclose(turned.log_std, straight.log_std[:, order], atol=1e-3)


def test_huge_inputs_are_no_warning(recwarn: pytest.WarningsRecorder) -> None:
    nodes = np.full((2, 3, NODE_SIZE), 1e4, np.float32)
    pairs = np.full((2, 3, 3, PAIR_SIZE), -1e4, np.float32)
    assert all(np.isfinite(part).all() for part in CONFIG(WEIGHTS.network, nodes, pairs))
    assert not recwarn.list


def test_likelihood_is_that_of_one_mixture_over_all_fins() -> None:
    draw = torch.Generator().manual_seed(0)
    sizes = (5, 4), (5, 3, 4, 2), (5, 3, 4)
    given = ForceMixture(
        *(torch.randn(size, generator=draw, dtype=torch.float64) for size in sizes)
    )
    way = torch.randn(5, 7, 3, 2, generator=draw, dtype=torch.float64)
    mean = given.mean.transpose(1, 2).flatten(2)
    std = given.log_std.exp()[..., None].expand(-1, -1, -1, 2).transpose(1, 2).flatten(2)
    reference = MixtureSameFamily(
        Categorical(logits=given.logits), Independent(Normal(mean, std), 1)
    )
    expected = reference.log_prob(way.flatten(2).transpose(0, 1)).T
    torch.testing.assert_close(given.log_prob(way), expected)
    # Warm, all components learn from every way; cold, the one that stands for it.
    assert (given.log_prob(way, 50.0) > given.log_prob(way)).all()


ARC_LIMITS = Limits(zero_direction=(-0.6, 1.4))
"""Limits of a fin with an arc."""
UNEVEN = FinModelSpec("soft", (("e", 0.2), ("d", 0.15), ("phi_e", 1.0)))
"""A soft fin whose force is not the same in all directions."""
FINS = [
    (FinModelSpec("drag", ()), Limits()),
    (FinModelSpec("lighthill", ()), ARC_LIMITS),
    (UNEVEN, Limits()),
    (UNEVEN, ARC_LIMITS),
]
"""Models and limits of fins."""


def problem_of_one_fin(model: FinModelSpec, limits: Limits) -> tuple[Layout, EffortProblem]:
    """A robot of one fin, and its problem of least effort."""
    layout = Layout("one", (Fin("a", (0.2, 0.1, 0.0), 0.3, limits, model=model),))
    return layout, effort_robot(plant_of(layout), np.ones(6)).forces


@pytest.mark.parametrize(("model", "limits"), FINS)
def test_commands_give_the_forces_with_the_least_effort(
    model: FinModelSpec, limits: Limits
) -> None:
    layout, problem = problem_of_one_fin(model, limits)
    fins = problem.fins
    plant = plant_of(layout)
    rng = np.random.default_rng(0)
    direction = fins.middle + fins.half * rng.uniform(-0.9, 0.9, (40, 1))
    wanted = rng.uniform(0.05, 0.9, (40, 1)) * fins.gauges(direction) * fins.largest
    found = fins.project(wanted * np.exp(1j * direction))
    np.testing.assert_allclose(found.size, wanted, rtol=1e-9)
    command, effort = realize(problem, found)
    given = plant.force(command)
    np.testing.assert_allclose(
        given[..., 1] + 1j * given[..., 2], found.force, atol=0.01 * fins.maximum[0]
    )
    # No other amplitude gives that force with less, wherever the frequency allows it.
    amplitude = np.linspace(*limits.amplitude, 60)[:, None]
    frequency = np.linspace(*limits.frequency, 400)
    for (row,), least, (size,) in zip(command, effort, wanted, strict=True):
        grid = np.stack(np.broadcast_arrays(amplitude, frequency, row[2]), axis=-1)
        strong = (
            np.linalg.norm(plant.force(grid[..., None, :])[..., 0, 1:], axis=-1) >= 0.999 * size
        )
        upper = layout.upper[0]
        every = effort_of_shares(amplitude / upper[0], frequency / upper[1], row[2] / upper[2])
        assert least <= every[strong].min() * 1.01


def test_what_a_fin_cannot_give_becomes_the_nearest_that_it_can() -> None:
    fins = problem_of_one_fin(FinModelSpec("drag", ()), ARC_LIMITS)[1].fins
    asked = np.array(
        [2.0 * fins.maximum * np.exp(0.4j), [1.0 * np.exp(2.0j)], [0.0j], [np.exp(-2.9j)]]
    )
    found = fins.project(asked)
    np.testing.assert_allclose(found.force[0], fins.maximum * np.exp(0.4j))
    np.testing.assert_allclose(found.force[1], np.cos(0.6) * np.exp(1.4j))
    np.testing.assert_allclose(found.size[2:], fins.smallest[[0, 0], None])
