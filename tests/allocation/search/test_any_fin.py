"""The search on fins that nobody has seen: exact, and as cheap as brute force finds, whatever they are."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.allocation import Allocator
from finlab.assets import shipped_layouts
from finlab.evaluation.splits import make_split
from finlab.layout import Fin, FinModelSpec, Layout, load_layout, random_layout
from finlab.physics import Plant
from finlab.physics.objective import Name, Objective
from tests.allocation.search.reference import least_cost
from tests.any_robot import AnyRobot
from tests.exhaustive import crossed, sampled
from tests.random_fins import KINDS, random_robot

Array = NDArray[np.float64]
LAWS = KINDS[:3]
OBJECTIVES = ("power", "effort")
AXES = np.concatenate([np.diag([1.0, 1.0, 1.0, 0.1, 0.1, 0.1]), -np.diag([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])])


def reachable(layout: Layout, n: int, seed: int = 0) -> Array:
    plant = Plant(layout)
    return plant.wrench(plant.sample(np.random.default_rng(seed), (n,)))


def with_arcs(name: str, arcs: dict[int, tuple[float, float]]) -> Layout:
    """A shipped layout with other arcs of zero directions [rad] for some of its fins."""
    layout = load_layout(shipped_layouts()[name])
    held = {i: replace(layout.fins[i].limits, zero_direction=arc) for i, arc in arcs.items()}
    fins = (replace(fin, limits=held.get(i, fin.limits)) for i, fin in enumerate(layout.fins))
    return replace(layout, actuators=tuple(fins))


def cost_of(objective: Name, answer: object) -> float:
    return float(getattr(answer, {"power": "power", "effort": "effort"}[objective]))


@pytest.mark.parametrize(
    ("objective", "limits", "kinds"),
    crossed(
        OBJECTIVES,
        ["nominal", "varied"],
        [("drag",), ("lighthill",), ("soft",), LAWS, ("table",), KINDS],
        every=7,
    ),
)
def test_exact_on_any_fin(kinds: tuple[str, ...], limits: str, objective: Name, tmp_path: Path) -> None:
    method = AnyRobot(objective=objective)
    for seed in range(4):
        layout = random_robot(np.random.default_rng(seed), kinds, tmp_path, limits=limits, n_fins=(2, 7))
        batch = method.allocate_batch(layout, reachable(layout, 12, seed))
        lower, upper = layout.lower, layout.upper
        assert (batch.command >= lower).all() and (batch.command <= upper).all()
        assert np.quantile(batch.err_norm, 0.95) < 1e-5
        assert "table" in kinds or batch.err_norm.max() < 2e-5


@pytest.mark.parametrize(("objective", "most", "mean"), [("power", 1.01, 1.001), ("effort", 1.05, 1.01)])
def test_no_more_than_brute_force_finds(objective: Name, most: float, mean: float) -> None:
    method, ratio = AnyRobot(objective=objective), []
    for seed in range(2):
        layout = random_robot(np.random.default_rng(seed), LAWS, n_fins=(2, 4))
        for target in reachable(layout, 2, seed) * [[1.0], [0.5]]:
            answer = method.allocate(layout, target)
            if answer.err_norm < 1e-5:
                aim = Objective(objective)
                least = least_cost(layout, target, answer.scale, aim, n_starts=6, also=answer.command)
                ratio.append(cost_of(objective, answer) / least)
    assert len(ratio) >= 3
    assert np.max(ratio) < most and np.mean(ratio) < mean


@pytest.mark.parametrize("target", AXES, ids=str)
def test_robots_with_stops_are_as_cheap(target: Array) -> None:
    """Fins that start outside their arcs must come back to where they are pulled."""
    layout = load_layout(shipped_layouts()["restricted"])
    answer = Allocator(layout).allocate(target)
    least = least_cost(layout, target, answer.scale, Objective(), n_starts=6, also=answer.command)
    assert answer.err_norm < 1e-5 and answer.power < 1.01 * least


@pytest.mark.parametrize("axis", sampled(range(12), 5))
def test_arcs_wider_than_half_a_turn_are_as_cheap(axis: int) -> None:
    """Which side of the gap each fin takes is no convex question."""
    layout, target = with_arcs("A", dict.fromkeys(range(4), (-2.4, 2.4))), AXES[axis]
    answer = Allocator(layout).allocate(target)
    least = least_cost(layout, target, answer.scale, Objective(), n_starts=6, also=answer.command)
    assert answer.err_norm < 1e-5 and answer.power < 1.01 * least


@pytest.mark.parametrize("arcs", [((-2.55, 0.33), (-2.48, -0.67)), ((-1.5, 0.1), (-0.1, 1.9))], ids=str)
def test_dear_directions_are_left_by_weak_forces(arcs: tuple[tuple[float, float], ...]) -> None:
    """Where an arc ends near zero its other end costs several times what a fin at work does."""
    layout, method = (
        with_arcs("penta", dict(zip((1, 3), arcs, strict=True))),
        AnyRobot(objective="effort"),
    )
    targets = reachable(layout, 8, 5)
    batch = method.allocate_batch(layout, targets)
    aim, sigma = Objective("effort"), method.allocate(layout, targets[0]).scale
    least = [
        least_cost(layout, target, sigma, aim, n_starts=6, also=command)
        for target, command in zip(targets, batch.command, strict=True)
    ]
    assert batch.err_norm.max() < 1e-5
    assert batch.effort.sum() < 1.01 * sum(least) and (batch.effort < 1.05 * np.array(least)).all()


@pytest.mark.parametrize("name", ["A", "B", "penta", "hexa", "octo"])
def test_pure_axes_of_symmetric_robots(name: str) -> None:
    layout, method = load_layout(shipped_layouts()[name]), AnyRobot()
    for target in AXES[[0, 2, 5, 6]]:
        answer = method.allocate(layout, target)
        assert answer.err_norm < 1e-5


def coincident(rng: np.random.Generator, name: str) -> Layout:
    """Two of three to six fins share their place, with shafts along or against each other."""
    layout = random_layout(rng, name, n_fins=(3, 6))
    first, second, *others = layout.fins
    turned = first.mounting_angle + (math.pi if rng.random() < 0.5 else 0.0)
    twin = replace(second, position=first.position, mounting_angle=math.remainder(turned, 2.0 * math.pi))
    return replace(layout, actuators=(first, twin, *others))


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_coincident_fins_share_or_rest(objective: Name) -> None:
    """Two at one place: for power each gives half, for effort both or one, whichever is cheaper."""
    pair = Layout("twins", tuple(Fin(name, (0.1, 0.05, 0.0), 0.3) for name in "ab"))
    plant, method = Plant(pair), AnyRobot(objective=objective)
    for force in (0.5, 2.0, 6.0, 12.0):
        command = np.array([[0.6, 2.1, 0.4]] * 2)
        target = plant.wrench(command) * force / 13.32
        answer = method.allocate(pair, target)
        least = least_cost(pair, target, answer.scale, Objective(objective), n_starts=8, also=answer.command)
        assert answer.err_norm < 1e-5 and cost_of(objective, answer) < 1.01 * least
        if objective == "power":
            size = np.linalg.norm(answer.forces, axis=1)
            assert size[0] == pytest.approx(size[1], rel=1e-3)


@pytest.mark.parametrize(("case", "target"), [(5, 1), (7, 2)])
def test_fins_at_rest_point_where_that_costs_least(case: int, target: int) -> None:
    """Beside a twin that works; the fins around it must mend what a turned one no longer gives."""
    rng = np.random.default_rng((0x5E11, 2, 77, case))
    robot = coincident(rng, "twins")
    plant = Plant(robot)
    targets = plant.wrench(plant.sample(rng, (4,)))
    answer = Allocator(robot, objective="effort").allocate(targets[target])
    rests = (answer.command[:, :2] < plant.lower[:, :2] + 1e-3).all(axis=1)
    assert rests.any() and np.abs(answer.command[rests, 2]).max() < 0.03
    goal = Objective("effort")
    least = least_cost(robot, answer.target, answer.scale, goal, n_starts=8, also=answer.command)
    assert answer.err_norm < 1e-5 and answer.effort < 1.005 * least


def test_what_was_reached_late_is_as_cheap() -> None:
    """Near the peak of soft fins, which the search in force space steps over."""
    case = make_split("fins", 10, 4, 77)[3]
    answer = Allocator(case.layout).allocate(case.targets[3])
    goal = Objective("power")
    least = least_cost(case.layout, answer.target, answer.scale, goal, n_starts=8, also=answer.command)
    assert answer.err_norm < 1e-5 and answer.power < 1.03 * least


@pytest.mark.parametrize("area", [2e-2, 2e-4, 1e-5])
def test_tiny_fins_are_as_exact_beside_their_own_strength(area: float) -> None:
    layout = load_layout(shipped_layouts()["A"])
    model = FinModelSpec("drag", (("area", area),))
    tiny = replace(layout, actuators=tuple(replace(fin, model=model) for fin in layout.fins))
    method = AnyRobot()
    for target in reachable(tiny, 6):
        answer = method.allocate(tiny, target)
        assert answer.err_norm < 1e-4 * 1.0


def test_batches_are_single_answers() -> None:
    layout = random_robot(np.random.default_rng(5), LAWS, n_fins=5)
    targets = reachable(layout, 30)
    for objective in ("power", "effort"):
        method = AnyRobot(objective=objective)  # type: ignore[arg-type]
        batch = method.allocate_batch(layout, targets)
        singles = [method.allocate(layout, target) for target in targets]
        cost = batch.power if objective == "power" else batch.effort
        assert batch.err_norm.max() < 1e-5
        for row, single in enumerate(singles):
            assert cost[row] == pytest.approx(cost_of(objective, single), rel=2e-3)  # type: ignore[arg-type]
