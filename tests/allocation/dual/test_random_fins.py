"""The default method on any fin: exact, and as cheap as brute force finds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from finlab.allocation import Allocator
from finlab.assets import shipped_layouts
from finlab.layout import Fin, FinModelSpec, Layout, load_layout
from finlab.physics import Plant
from finlab.physics.objective import Name, cost_meter
from finlab.research.evaluation.splits import make_split
from tests.allocator_cache import AllocatorCache
from tests.random_fin_robots import KINDS, random_robot_of_fins
from tests.sampled_cases import crossed, sampled

Array = NDArray[np.float64]
FORMULAS = KINDS[:3]
"""Kinds of fin whose law is a formula, not a table."""
AXIS_WRENCHES = np.concatenate(
    [np.diag([1.0, 1.0, 1.0, 0.1, 0.1, 0.1]), -np.diag([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])]
)
"""A wrench (6,) [N, N m] either way along each axis."""


def reachable_wrenches(layout: Layout, n: int, seed: int = 0) -> Array:
    """Wrenches (n, 6) of random commands."""
    plant = Plant(layout)
    return plant.wrench(plant.sample(np.random.default_rng(seed), (n,)))


def with_arcs(name: str, arcs: dict[int, tuple[float, float]]) -> Layout:
    """A shipped layout with other arcs of zero directions [rad] for some of its fins."""
    layout = load_layout(shipped_layouts()[name])
    held = {i: replace(layout.fins[i].limits, zero_direction=arc) for i, arc in arcs.items()}
    fins = (replace(fin, limits=held.get(i, fin.limits)) for i, fin in enumerate(layout.fins))
    return replace(layout, actuators=tuple(fins))


@pytest.mark.parametrize(
    ("limits", "kinds"),
    crossed(
        ["nominal", "varied"],
        [("drag",), ("lighthill",), ("soft",), FORMULAS, ("table",), KINDS],
        every=7,
    ),
)
def test_exact_on_any_fin(kinds: tuple[str, ...], limits: str, tmp_path: Path) -> None:
    method = AllocatorCache()
    for seed in range(4):
        layout = random_robot_of_fins(
            np.random.default_rng(seed), kinds, tmp_path, limits=limits, n_fins=(2, 7)
        )
        batch = method.allocate_batch(layout, reachable_wrenches(layout, 12, seed))
        lower = layout.lower
        upper = layout.upper
        assert (batch.command >= lower).all() and (batch.command <= upper).all()
        assert np.quantile(batch.err_norm, 0.95) < 1e-5
        assert "table" in kinds or batch.err_norm.max() < 2e-5


def test_no_more_than_brute_force_finds() -> None:
    method = AllocatorCache()
    ratio = []
    for seed in range(2):
        layout = random_robot_of_fins(np.random.default_rng(seed), FORMULAS, n_fins=(2, 4))
        for target in reachable_wrenches(layout, 2, seed) * [[1.0], [0.5]]:
            answer = method.allocate(layout, target)
            if answer.err_norm < 1e-5:
                least = least_cost(
                    layout, target, answer.scale, "power", n_starts=6, also=answer.command
                )
                ratio.append(answer.power / least)
    assert len(ratio) >= 3
    assert np.max(ratio) < 1.001


@pytest.mark.parametrize("target", AXIS_WRENCHES, ids=str)
def test_robots_with_stops_are_as_cheap(target: Array) -> None:
    """Fins that start outside their arcs must come back to where they are pulled."""
    layout = load_layout(shipped_layouts()["restricted"])
    answer = Allocator(layout).allocate(target)
    least = least_cost(layout, target, answer.scale, "power", n_starts=6, also=answer.command)
    assert answer.err_norm < 1e-5 and answer.power < 1.002 * least


@pytest.mark.parametrize("axis", sampled(range(12), 5))
def test_arcs_wider_than_half_a_turn_are_as_cheap(axis: int) -> None:
    """Which side of the gap each fin takes is no convex question."""
    layout = with_arcs("A", dict.fromkeys(range(4), (-2.4, 2.4)))
    target = AXIS_WRENCHES[axis]
    answer = Allocator(layout).allocate(target)
    least = least_cost(layout, target, answer.scale, "power", n_starts=6, also=answer.command)
    assert answer.err_norm < 1e-5 and answer.power < 1.002 * least


@pytest.mark.parametrize("name", ["A", "B", "penta", "hexa", "octo"])
def test_pure_axes_of_symmetric_robots(name: str) -> None:
    layout = load_layout(shipped_layouts()[name])
    method = AllocatorCache()
    for target in AXIS_WRENCHES[[0, 2, 5, 6]]:
        answer = method.allocate(layout, target)
        assert answer.err_norm < 1e-5


def test_coincident_fins_share() -> None:
    """Two at one place: each gives half."""
    pair = Layout("twins", tuple(Fin(name, (0.1, 0.05, 0.0), 0.3) for name in "ab"))
    plant = Plant(pair)
    method = AllocatorCache()
    for force in (0.5, 2.0, 6.0, 12.0):
        command = np.array([[0.6, 2.1, 0.4]] * 2)
        target = plant.wrench(command) * force / 13.32
        answer = method.allocate(pair, target)
        size = np.linalg.norm(answer.forces, axis=1)
        assert answer.err_norm < 1e-5 and size[0] == pytest.approx(size[1], rel=1e-3)


def test_near_the_peak_of_soft_fins_it_is_as_cheap() -> None:
    case = make_split("fins", 10, 4, 77)[3]
    answer = Allocator(case.layout).allocate(case.targets[3])
    goal = "power"
    least = least_cost(
        case.layout, answer.target, answer.scale, goal, n_starts=8, also=answer.command
    )
    assert answer.err_norm < 1e-5 and answer.power < 1.001 * least


@pytest.mark.parametrize("area", [2e-2, 2e-4, 1e-5])
def test_tiny_fins_are_as_exact_beside_their_own_strength(area: float) -> None:
    layout = load_layout(shipped_layouts()["A"])
    model = FinModelSpec("drag", (("area", area),))
    tiny = replace(layout, actuators=tuple(replace(fin, model=model) for fin in layout.fins))
    method = AllocatorCache()
    for target in reachable_wrenches(tiny, 6):
        answer = method.allocate(tiny, target)
        assert answer.err_norm < 1e-4 * 1.0


def least_cost(
    layout: Layout,
    target: Array,
    sigma: Array,
    objective: Name,
    *,
    n_starts: int = 24,
    seed: int = 0,
    also: Array | None = None,
) -> float:
    """The least cost found for a wrench (6,), infinite where no start reached it to 1e-5.

    Starts are random commands, of which every other one has fins at rest, and `also`, a command (n,
    3).
    """
    plant = Plant(layout)
    rng = np.random.default_rng(seed)
    meter = cost_meter(objective, plant)
    n = layout.n_fins
    full = plant.full_turn
    low = plant.lower
    width = np.maximum(plant.width, 1e-12)

    def command(share: Array) -> Array:
        return low + share.reshape(n, 3) * width

    def missing(share: Array) -> Array:
        return np.asarray((plant.wrench(command(share)) - target) / sigma)

    def bent(share: Array) -> Array:
        jacobian = plant.linearize(command(share))[1]
        return np.asarray(jacobian * width.ravel() / sigma[:, None])

    starts = rng.uniform(size=(n_starts, n, 3))
    resting = rng.uniform(size=(n_starts, n)) < 0.35
    resting[::2] = False
    starts[..., :2] = np.where(resting[..., None], 0.0, starts[..., :2])
    if also is not None:
        starts = np.concatenate([(also - low)[None] / width, starts])
    bounds = list[tuple[float | None, float | None]]()
    for turns_all_round in full:
        direction_bounds = (None, None) if turns_all_round else (0.0, 1.0)
        bounds += [(0.0, 1.0), (0.0, 1.0), direction_bounds]
    # Equations beyond the rank of what the fins can do only confuse the solver.
    axes = np.linalg.svd(plant.effectiveness[:, 1:].reshape(2 * n, 6) / sigma, full_matrices=False)
    rank = int((axes[1] > 1e-9 * axes[1][0]).sum())
    served_axes = (
        axes[2][:rank] if not plant.force(plant.sample(rng, (3,)))[..., 0].any() else np.eye(6)
    )
    scale = max(float(meter(plant.upper[None])[0]), 1e-9)
    best = np.inf
    for start in starts:
        optimum = minimize(
            lambda s: float(meter(command(s)[None])[0]) / scale,
            start.ravel(),
            jac=lambda s: (meter.gradient(command(s)[None])[0] * width).ravel() / scale,
            bounds=bounds,
            constraints={
                "type": "eq",
                "fun": lambda s: served_axes @ missing(s),
                "jac": lambda s: served_axes @ bent(s),
            },
            method="SLSQP",
            options={"maxiter": 150, "ftol": 1e-10},
        )
        answer = plant.feasible(command(optimum.x))
        error = float(np.linalg.norm((plant.wrench(answer) - target) / sigma))
        if error < 1e-5:
            best = min(best, float(meter(answer[None])[0]))
    return best
