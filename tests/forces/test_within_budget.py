"""Sets of forces within power budgets, beside method `dual`, cone programs, and the support function
by a search for the multiplier of the budget."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from finlab.allocation import Allocator
from finlab.allocation.power_budget import budget_of
from finlab.analysis import attainable_set
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.forces.force_sets import SCALE, force_sets
from finlab.forces.reach import axis_ranges, max_wrench_along_exactly, weakest
from finlab.forces.within_budget import counts_budget, force_sets_within
from finlab.layout import Layout, Thruster
from finlab.layout.effectiveness import own_effectiveness
from finlab.layout.layout import Bus
from finlab.physics import plant_of
from tests.oracle_budget import BudgetedPlant
from tests.random_robots import load, random_plant, random_robot

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""
SEED = 77
TABLES = 1e-5
"""Share by which a reach may differ from that of method `dual` where powers are not power laws: it
takes them from other tables, and keeps a bit less than the budget."""
EXACTLY = 1e-6
"""The same with power laws: of `dual` what binds no budget misses up to 1e-5, mostly far less."""


def unit_directions(layout: Layout, count: int, seed: int) -> Array:
    """Scaled directions (D, 6) along axes that the robot commands."""
    normal = np.random.default_rng([SEED, seed]).standard_normal((count, 6)) * layout.commanded
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def with_budget(layout: Layout, n_buses: int, share: float) -> Layout:
    """A robot whose buses have a share of what all their actuators take at most; actuators beyond
    the last bus have no limit."""
    plant = plant_of(layout)
    most = plant.power(layout.upper)
    if n_buses == 1:
        return replace(layout, power_w=share * float(np.nansum(most)), buses=())
    groups = np.array_split(np.arange(layout.n), n_buses)
    buses = [
        Bus(f"bus {k}", share * float(most[own].sum()), tuple(layout.names[i] for i in own))
        for k, own in enumerate(groups)
    ]
    return replace(layout, power_w=None, buses=tuple(buses[:-1] if n_buses > 2 else buses))


def reach_by_dual(layout: Layout, directions: Array, beyond: Array) -> Array:
    """Largest scaled wrenches (D,) that `dual` gives along directions, asked for more than `beyond`
    (D,) [N]."""
    allocator = Allocator(layout)
    found = []
    for direction, size in zip(directions, beyond, strict=True):
        asked = 1.01 * size
        answer = allocator.allocate(asked * direction * SCALE, policy="direction")
        found.append(asked * answer.share)
    return np.array(found)


@pytest.mark.parametrize("n_buses", [1, 2, 3])
@pytest.mark.parametrize(
    ("name", "close"),
    [
        ("bluerov2_heavy", EXACTLY),
        ("supply", EXACTLY),
        ("catamaran", EXACTLY),
        ("A", TABLES),
        ("restricted", TABLES),
        ("turtle_hybrid", TABLES),
    ],
)
def test_rays_end_where_the_largest_share_of_dual_does(
    shipped: Layouts, name: str, close: float, n_buses: int
) -> None:
    layout = with_budget(shipped(name), n_buses, 0.05)
    directions = unit_directions(layout, 6, n_buses)
    found, gap = max_wrench_along_exactly(force_sets_within(layout), directions)
    free, _ = max_wrench_along_exactly(force_sets(layout), directions)
    by_dual = reach_by_dual(layout, directions, free[0])
    assert found[0] == pytest.approx(by_dual, rel=close)
    assert gap <= 1e-6 * free.max()
    assert (found[0] < 0.95 * free[0]).any()


def along_forces(layout: Layout) -> tuple[Array, Array, Array]:
    """Directions (3, 6) of wrenches that a robot pushes, and its reach along them (1, 3) within its
    budget and without."""
    plant = plant_of(layout)
    wrench = plant.wrench(plant.sample(np.random.default_rng(SEED), (3,))) / SCALE
    directions = wrench / np.linalg.norm(wrench, axis=1, keepdims=True)
    found, _ = max_wrench_along_exactly(force_sets_within(layout), directions)
    free, _ = max_wrench_along_exactly(force_sets(layout), directions)
    return directions, found, free


@pytest.mark.parametrize("kind", ["thrusters", "azimuths"])
@pytest.mark.parametrize("number", range(4))
def test_rays_end_where_a_cone_program_says(kind: str, number: int) -> None:
    layout = with_budget(load(random_robot(kind, number, SEED)), 1 + number % 2, 0.2)
    plant = random_plant(kind, number, SEED)
    budget = budget_of(layout)
    assert budget is not None
    directions = unit_directions(layout, 3, number)
    free, _ = max_wrench_along_exactly(force_sets(layout), directions)
    found, _ = max_wrench_along_exactly(force_sets_within(layout), directions)
    judged = np.flatnonzero(free[0] > 1e-6)
    if not len(judged):
        directions, found, free = along_forces(layout)
        judged = np.arange(len(directions))
    for k in judged:
        direction, size, without = directions[k], found[0, k], free[0, k]
        wrench = 1.5 * without * direction * SCALE
        judge = BudgetedPlant(plant, budget.members, budget.watts)
        assert size == pytest.approx(1.5 * without * judge.largest_share(wrench), rel=1e-5)


def test_the_support_function_is_the_least_over_multipliers(shipped: Layouts) -> None:
    layout = replace(shipped("bluerov2_heavy"), power_w=90.0)
    normals = unit_directions(layout, 20, 0)
    sets = force_sets_within(layout).repeat(len(normals))
    support, force = sets.farthest(normals)

    def bound(multiplier: float, normal: Array) -> float:
        """xi P + sum of max over y of  s y - xi c(y)."""
        total = multiplier * 90.0
        for actuator, columns in zip(layout.actuators, own_effectiveness(layout), strict=True):
            assert isinstance(actuator, Thruster)
            price = float(columns[0] @ (normal / SCALE))
            most = actuator.force[1] if price > 0.0 else -actuator.force[0]
            law = actuator.model
            factor = law.forward if price > 0.0 else law.reverse
            wanted = (abs(price) / (1.5 * multiplier * factor)) ** 2
            size = min(wanted, most)
            total += abs(price) * size - multiplier * factor * size**1.5
        return total

    for normal, value in zip(normals, support, strict=True):
        least = minimize_scalar(
            lambda log, normal=normal: bound(math.exp(log), normal),
            bounds=(-12.0, 4.0),
            method="bounded",
            options={"xatol": 1e-10},
        )
        assert value == pytest.approx(least.fun, rel=1e-9)
    # Along the normal the forces are as far, within the budget.
    assert (sets.wrench(force) * normals).sum(axis=-1) == pytest.approx(support, rel=1e-9)
    plant = plant_of(layout)
    command = np.zeros((len(force), layout.n, 3))
    command[..., 0] = force[..., 0] * [actuator.force[1] > 0.0 for actuator in layout.actuators]
    assert plant.power(command).sum(axis=-1) == pytest.approx(90.0, rel=1e-6)


def test_nothing_is_weaker_than_the_weakest_direction(shipped: Layouts) -> None:
    layout = with_budget(shipped("bluerov2_heavy"), 2, 0.1)
    sets = force_sets_within(layout)
    found = weakest(sets)
    directions = unit_directions(layout, 300, 1)
    size, _ = max_wrench_along_exactly(sets, directions)
    assert size.min() >= found.size[0] * (1.0 - 1e-6)
    along, _ = max_wrench_along_exactly(sets, found.direction)
    assert along[0, 0] == pytest.approx(found.size[0], rel=1e-5)
    assert found.size[0] < 0.7 * weakest(force_sets(layout)).size[0]


@pytest.mark.parametrize("name", ["octo", "supply", "hexa"])
def test_ranges_end_where_the_budget_no_longer_gives_the_wrench(
    shipped: Layouts, name: str
) -> None:
    layout = with_budget(shipped(name), 1, 0.1)
    whole = axis_ranges(layout, np.zeros(6))
    wrench = np.zeros(6)
    wrench[0] = 0.4 * whole.high[0]
    wrench[5] = 0.2 * whole.high[5]
    ranges = axis_ranges(layout, wrench)
    allocator = Allocator(layout)
    for axis in np.flatnonzero(layout.commanded & (ranges.high - ranges.low > 1e-3)):
        for end, middle in ((ranges.low, ranges.high), (ranges.high, ranges.low)):
            inside = wrench.copy()
            inside[axis] = 0.999 * end[axis] + 0.001 * middle[axis]
            outside = wrench.copy()
            outside[axis] = 1.02 * end[axis] - 0.02 * middle[axis]
            assert allocator.allocate(inside).reachable
            assert not allocator.allocate(outside).reachable


def test_vertices_of_an_attainable_set_are_within_the_budget(shipped: Layouts) -> None:
    layout = replace(shipped("A"), power_w=4.0)
    found = attainable_set(layout, "force")
    wrench = np.zeros((len(found.vertices), 6))
    wrench[:, :3] = found.vertices
    answers = Allocator(replace(layout, power_w=None)).allocate_batch(wrench)
    assert answers.power.max() <= 4.0 * (1.0 + 1e-4)
    assert answers.power.max() == pytest.approx(4.0, rel=1e-4)
    free = attainable_set(layout, "force", power=math.inf)
    assert np.abs(found.vertices).max() < 0.8 * np.abs(free.vertices).max()


def test_a_power_is_named_as_in_a_question(shipped: Layouts) -> None:
    bare = shipped("bluerov2_heavy")
    buses = (Bus("fore", 60.0, bare.names[:4]), Bus("lift", 90.0, bare.names[4:]))
    layout = replace(bare, buses=buses)
    free = axis_ranges(bare, np.zeros(6))
    asked = axis_ranges(layout, np.zeros(6), power={"lift": 20.0})
    less = replace(layout, buses=(buses[0], replace(buses[1], power_w=20.0)))
    np.testing.assert_allclose(asked.high, axis_ranges(less, np.zeros(6)).high, rtol=1e-9)
    unlimited = axis_ranges(layout, np.zeros(6), power=math.inf)
    np.testing.assert_allclose(unlimited.high, free.high, rtol=1e-9)
    plenty = axis_ranges(bare, np.zeros(6), power=1e5)
    np.testing.assert_allclose(plenty.high, free.high, rtol=1e-6)
    with pytest.raises(AllocationError, match="got bus 'aft'"):
        axis_ranges(layout, np.zeros(6), power={"aft": 20.0})


def test_where_the_flow_drives_actuators_no_budget_is_counted(shipped: Layouts) -> None:
    layout = replace(shipped("torpedo"), power_w=20.0)
    flow = np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert counts_budget(layout) and not counts_budget(layout, flow)
    free = axis_ranges(layout, np.zeros(6), power=math.inf)
    assert axis_ranges(layout, np.zeros(6)).high[0] < 0.5 * free.high[0]
    with pytest.raises(AllocationError, match="the flow drives rudder_top"):
        axis_ranges(layout, np.zeros(6), flow=flow)
    assert axis_ranges(layout, np.zeros(6), flow=flow, power=math.inf).high[0] > 50.0


def test_pods_that_cannot_stop_may_take_more_than_there_is(shipped: Layouts) -> None:
    bare = shipped("catamaran")
    pods = []
    for actuator in bare.actuators:
        is_pod = actuator.name != "bow"
        pods.append(replace(actuator, force=(20.0, 60.0), arc=(-0.5, 0.5)) if is_pod else actuator)
    layout = replace(bare, actuators=tuple(pods))
    plant = plant_of(layout)
    idle = float(np.nansum(plant.power(np.array([a.lower for a in layout.actuators]))[:2]))
    enough = axis_ranges(layout, np.zeros(6), power=3.0 * idle)
    assert np.isfinite(enough.high[0])
    too_little = axis_ranges(layout, np.zeros(6), power=0.9 * idle)
    assert np.isnan(too_little.high[:2]).all()
