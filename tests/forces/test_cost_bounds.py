"""Lower bounds on cost: never above what some command costs, close to what the search finds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab.allocation import load_allocator
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.errors import AllocationError
from finlab.forces.branch_and_bound import _least, bound_by_branching
from finlab.forces.cost_bound import CostDual, cost_bound
from finlab.forces.envelopes import layout_envelopes
from finlab.forces.fin_envelope import COST, LEAN
from finlab.forces.force_space import PlanarProblem, planar_problem
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.layout.angles import wrapped
from finlab.physics import make_law, plant_of
from finlab.physics.objective import Name, Objective

SIGMA = np.array([1.0, 1.0, 1.0, 0.2, 0.2, 0.2])


def uneven(n: int, seed: int) -> Layout:
    """A robot of soft fins that lean and push harder in one direction, one of them with stops."""
    rng = np.random.default_rng(4)
    model = FinModelSpec("soft", (("d", 0.1), ("e", 0.2), ("k", 3.0), ("phi_e", 0.7)))
    fins = []
    for i in range(n):
        x, y, z = rng.uniform(-1.0, 1.0, 3) * [0.3, 0.3, 0.1]
        limits = Limits(zero_direction=(-1.2, 1.2)) if i == 0 else Limits()
        fins.append(Fin(f"fin_{i}", (x, y, z), rng.uniform(-3.0, 3.0), limits, model))
    return Layout(name="uneven", fins=tuple(fins))


def problem_of(layout: Layout, name: Name) -> PlanarProblem:
    objective = Objective(name)
    return planar_problem(layout, layout_envelopes(layout, objective), SIGMA, objective)


@pytest.mark.parametrize(
    "layout", [load_layout("A"), load_layout("mixed"), load_layout("restricted"), uneven(5, 3)]
)
def test_the_dual_is_below_every_command_of_the_same_wrench(layout: Layout) -> None:
    """Weak duality holds whatever the multipliers: commands drawn at random cost more."""
    problem, plant = problem_of(layout, "power"), plant_of(layout)
    rng = np.random.default_rng(0)
    command = plant.sample(rng, (25,))
    power = plant.power(command).sum(-1)
    for target, cost in zip(plant.wrench(command) / SIGMA, power, strict=True):
        multiplier = rng.normal(size=6) * rng.uniform(0.0, 3.0)
        assert CostDual(problem, target)(multiplier)[0] <= cost * 1.002 + 1e-6


def test_the_dual_tells_its_own_slope() -> None:
    problem = problem_of(uneven(4, 1), "power")
    target, at = np.array([0.5, 0.2, -0.3, 0.1, 0.0, 0.2]), np.array([0.4, 0.1, -0.2, 0.3, 0.1, 0.2])
    dual = CostDual(problem, target)
    slope = dual(at)[1]
    # The table's forces move in steps, so slopes are compared over a way that crosses several of them.
    ahead, behind = (dual(at + s * 0.02 * slope / np.linalg.norm(slope))[0] for s in (1.0, -1.0))
    assert (ahead - behind) / 0.04 == pytest.approx(np.linalg.norm(slope), rel=0.1)


@pytest.mark.parametrize(
    "layout", [load_layout("A"), load_layout("mixed"), load_layout("octo"), uneven(5, 3)]
)
def test_the_search_is_within_a_percent_of_the_bound_of_power(layout: Layout) -> None:
    allocator, plant = load_allocator(), plant_of(layout)
    for command in plant.sample(np.random.default_rng(2), (4,)):
        result = allocator.allocate(layout, plant.wrench(command))
        bound = allocator.bound(result)
        assert 0.99 * result.power <= bound <= result.power


def test_the_ascent_improves_bad_multipliers() -> None:
    layout = load_layout("A")
    result = load_allocator().allocate(layout, [1.0, 0.0, 0.5, 0.0, 0.0, 0.1])
    problem, target = problem_of(layout, "power"), result.target / SIGMA
    start = np.full(6, 0.05)
    assert CostDual(problem, target)(start)[0] < 0.9 * result.power
    assert cost_bound(problem, target, start) > 0.98 * result.power


@pytest.mark.parametrize("layout", [uneven(3, 30), uneven(3, 31), load_layout("D"), load_layout("mixed")])
def test_branch_and_bound_is_below_what_is_known_and_proves_the_search(layout: Layout) -> None:
    """From a poor answer on it must not prove more than the good one costs; from the good one, that it is
    good."""
    plant, problem = plant_of(layout), problem_of(layout, "effort")
    allocator = load_allocator(objective="effort")
    result = allocator.allocate(layout, plant.wrench(plant.sample(np.random.default_rng(4), ())))
    target = result.target / SIGMA
    poor = bound_by_branching(problem, target, 1.1 * result.energy, tolerance=0.04, time_limit_s=1.0)
    assert poor.bound <= result.energy * 1.002
    good = bound_by_branching(problem, target, result.energy, tolerance=0.04, time_limit_s=2.0)
    assert good.finished and 0.959 * result.energy <= good.bound <= result.energy


@pytest.mark.parametrize("layout", [load_layout("A"), load_layout("restricted"), uneven(4, 3)])
def test_the_dual_is_the_least_of_cost_less_what_is_paid(layout: Layout) -> None:
    """Each fin's minimum by brute force: all directions of its arc and all sizes, finely looked up."""
    problem = problem_of(layout, "power")
    fins, n = problem.fins, layout.n_fins
    part = np.linspace(-1.0, 1.0, 481)
    direction = fins.middle + fins.half * part[:, None]
    rim = fins.rim(direction)
    sizes = rim.smallest + np.linspace(0.0, 1.0, 161)[:, None, None] ** 2 * (rim.largest - rim.smallest)
    cost = np.stack([fins.lookup(rim, size)[..., COST] for size in sizes])
    rng = np.random.default_rng(1)
    for _ in range(6):
        multiplier, target = rng.normal(size=(2, 6))
        pull = (problem.columns @ multiplier).reshape(2, n)
        gain = sizes * (pull[0] * np.cos(direction) + pull[1] * np.sin(direction))
        least = (cost - gain).reshape(-1, n).min(0)
        expected = multiplier @ target + least.sum()
        found = CostDual(problem, target)(multiplier)[0]
        assert found == pytest.approx(expected, abs=2e-3 * np.abs(least).sum() + 1e-3)


@pytest.mark.parametrize("layout", [load_layout("A"), load_layout("mixed"), uneven(4, 3)])
def test_the_ascent_ends_where_scipys_does(layout: Layout) -> None:
    """The dual is concave: from anywhere its top is the same."""
    problem, plant = problem_of(layout, "power"), plant_of(layout)
    command = plant.sample(np.random.default_rng(8), ())
    dual = CostDual(problem, 0.5 * plant.wrench(command) / SIGMA)
    top = -np.inf
    for seed in range(2):
        start = np.random.default_rng(seed).normal(size=6)
        found = minimize(lambda m: -dual(m)[0], start, method="Powell", options={"maxfev": 4000})
        top = max(top, -found.fun)
    for start in (np.full(6, 0.05), np.array([3.0, -2.0, 1.0, 0.5, 0.5, -1.0])):
        reached = cost_bound(problem, 0.5 * plant.wrench(command) / SIGMA, start)
        assert reached == pytest.approx(top, rel=1e-3)


def test_one_set_of_forces_needs_no_branching() -> None:
    """Two fins ahead of each other give heave and pitch in one way only, and what that costs is the bound."""
    fins = (Fin("front", (0.3, 0.0, 0.0), 0.5 * np.pi), Fin("back", (-0.3, 0.0, 0.0), 0.0))
    layout = Layout("two", fins)
    problem, plant = problem_of(layout, "effort"), plant_of(layout)
    command = np.array([[0.3, 1.2, 0.4], [0.5, 0.9, -0.7]])
    target = plant.wrench(command) / SIGMA
    best = load_allocator(objective="effort").allocate(layout, plant.wrench(command)).energy
    proof = bound_by_branching(problem, target, best)
    assert proof.finished and 0.99 * best <= proof.bound <= best


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_the_bound_is_the_best_of_a_grid_over_the_null_space(share: float) -> None:
    """Three fins whose forces can be shared in one way: the cost of every share, and the least of these."""
    fins = tuple(Fin(f"fin_{i}", (0.2 * i - 0.2, 0.0, 0.0), 0.0) for i in range(3))
    layout = Layout("row", fins)
    problem = problem_of(layout, "effort")
    force = np.zeros((3, 2))
    force[:, 1] = share * problem.fins.maximum * [0.9, 0.6, 0.8]
    target = np.einsum("nc,cni->i", force, np.stack(np.split(problem.columns, 2)))
    # Heave and pitch: the middle fin takes over what the outer ones give together.
    moved = np.linspace(-1.0, 1.0, 4001)[:, None] * problem.fins.maximum * [1.0, -2.0, 1.0]
    size = np.abs(force[:, 1] + moved)
    possible = (size <= problem.fins.maximum).all(1)
    direction = np.where(force[:, 1] + moved < 0.0, -0.5, 0.5) * np.pi
    cost = problem.fins.lookup(problem.fins.rim(direction), size)[..., COST]
    turned = problem.direction_cost * direction**2 * (size > 2.0 * problem.fins.minimum)
    least = (cost + turned).sum(1)[possible].min()
    proof = bound_by_branching(problem, target, least, tolerance=0.04)
    assert proof.finished and 0.955 * least <= proof.bound <= least
    loose = bound_by_branching(problem, target, 1.2 * least, tolerance=0.15)
    assert loose.bound <= 1.002 * least, "a poor answer is not proven"


ONE = Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0, Limits(), FinModelSpec("soft")),))
UNEVEN = replace(ONE, fins=(replace(ONE.fins[0], model=uneven(1, 0).fins[0].model),))


@pytest.mark.parametrize(("layout", "usual"), [(ONE, 2e-4), (UNEVEN, 4e-4)])
def test_between_the_entries_of_the_table_the_dual_follows_a_parabola(layout: Layout, usual: float) -> None:
    """The law itself on a fine grid of commands: a fin's least cost, less what its force is paid."""
    law, limits = make_law(layout.fins[0].model), Limits()
    command = np.stack(
        np.meshgrid(
            np.linspace(*limits.amplitude, 101),
            np.linspace(*limits.frequency, 141),
            np.zeros(1) if law.uniform else np.linspace(-np.pi, np.pi, 121),
            indexing="ij",
        ),
        axis=-1,
    )
    force, power = law.force(command), law.power(command)
    problem, rng, off = problem_of(layout, "power"), np.random.default_rng(0), []
    for size in np.geomspace(0.3, 2.0, 10):
        angle = rng.uniform(-np.pi, np.pi)
        multiplier = size * np.array([0.0, np.cos(angle), np.sin(angle), 0.0, 0.0, 0.0])
        x, y = problem.columns @ multiplier
        given = np.hypot(x, y) * force[..., 1] if law.uniform else x * force[..., 1] + y * force[..., 2]
        least = float((power - given).min())
        off.append(CostDual(problem, np.zeros(6))(multiplier)[0] / least - 1.0)
    assert np.median(np.abs(off)) < usual and np.abs(off).max() < 1e-3


@pytest.mark.parametrize("name", ["power", "effort"])
@pytest.mark.parametrize(
    ("layout", "near", "far"), [(load_layout("A"), 6e-4, 5e-3), (uneven(4, 3), 5e-3, 0.025)]
)
def test_no_forces_in_a_box_cost_less_than_its_bound(
    layout: Layout, near: float, far: float, name: Name
) -> None:
    """Against forces drawn in boxes of the null space; in small ones little more is allowed for."""
    problem, n, rng = problem_of(layout, name), layout.n_fins, np.random.default_rng(0)
    fins, maximum = problem.fins, problem.fins.maximum
    null = np.linalg.svd((problem.columns * np.tile(maximum, 2)[:, None]).T)[2][6:].T
    spread = np.sqrt((null.reshape(2, n, -1) ** 2).sum(0))
    d = null.shape[1]
    for width, most in ((1e-7, 1e-4), (0.005, near), (0.02, far), (0.2, 1.0)):
        gaps = []
        for _ in range(40):
            angle = fins.middle + fins.half * rng.uniform(-0.95, 0.95, n)
            force = rng.uniform(0.05, 0.8, n) * np.exp(1j * angle)
            middle = np.concatenate([force.real, force.imag])
            centre = rng.normal(size=(1, d))  # what it is about must not matter
            half = np.full((1, d), width)
            bound = _least(problem, middle - null @ centre[0], null, spread, centre, half)[0]
            there = (middle + rng.uniform(-width, width, (200, d)) @ null.T).reshape(200, 2, n) * maximum
            size, direction = np.hypot(there[:, 0], there[:, 1]), np.arctan2(there[:, 1], there[:, 0])
            rim = fins.rim(direction)
            row = fins.lookup(rim, size)
            turn = wrapped(direction - row[..., LEAN]) * (size > 2.0 * fins.minimum)
            cost = (row[..., COST] + problem.direction_cost * turn**2).sum(1)
            stopped = np.abs(wrapped(direction - fins.middle)) > fins.half
            possible = ~((size > rim.largest) | stopped).any(1)
            if possible.any():
                least = cost[possible].min()
                assert bound <= least * (1.0 + 1e-4)
                gaps.append(1.0 - bound / least)
        assert len(gaps) > 30 and np.median(gaps) < most


def test_boxes_that_no_fin_reaches_are_dropped() -> None:
    problem = problem_of(load_layout("restricted"), "effort")
    fins, n = problem.fins, len(problem.fins.maximum)
    null = np.linalg.svd((problem.columns * np.tile(fins.maximum, 2)[:, None]).T)[2][6:].T
    spread = np.sqrt((null.reshape(2, n, -1) ** 2).sum(0))
    wide = int((fins.half < np.pi).argmax())
    assert fins.half[wide] < np.pi
    for share, aside, dropped in ((0.5, 0.0, False), (1.01, 0.0, True), (0.5, 0.05, True)):
        force = 0.5 * np.exp(1j * fins.middle)
        force[wide] = share * np.exp(1j * (fins.middle[wide] + (fins.half[wide] + aside) * (aside > 0.0)))
        middle = np.concatenate([force.real, force.imag])
        for width, kept in ((1e-4, not dropped), (0.5, True)):
            box = np.zeros((1, null.shape[1])), np.full((1, null.shape[1]), width)
            assert np.isfinite(_least(problem, middle, null, spread, *box)[0]) == kept


def test_a_lack_of_time_is_told() -> None:
    layout = load_layout("octo")
    result = load_allocator(objective="effort").allocate(layout, [1.0, 0.2, 0.5, 0.02, 0.0, 0.1])
    proof = bound_by_branching(
        problem_of(layout, "effort"), result.target / SIGMA, result.energy, time_limit_s=0.05
    )
    assert not proof.finished
    assert 0.0 < proof.bound < result.energy


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_no_bound_without_an_answer(objective: Name) -> None:
    allocator = load_allocator(objective=objective)
    assert isinstance(allocator, SearchAllocator)
    result = allocator.allocate(load_layout("A"), [90.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(AllocationError, match="out of reach"):
        allocator.bound(result)
