"""Lower bounds on cost: never above what some command costs, close to what the search finds."""

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.errors import AllocationError
from finlab.forces.branch_and_bound import bound_by_branching
from finlab.forces.cost_bound import CostDual
from finlab.forces.envelopes import layout_envelopes
from finlab.forces.fin_envelope import COST
from finlab.forces.force_space import PlanarProblem, planar_problem
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.physics import plant_of
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


@pytest.mark.parametrize(
    "layout", [load_layout("A"), load_layout("mixed"), load_layout("octo"), uneven(5, 3)]
)
def test_the_search_is_within_a_percent_of_the_bound_of_power(layout: Layout) -> None:
    allocator, plant = load_allocator(), plant_of(layout)
    for command in plant.sample(np.random.default_rng(2), (4,)):
        result = allocator.allocate(layout, plant.wrench(command))
        bound = allocator.bound(result)
        assert 0.99 * result.power <= bound <= result.power


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


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_no_bound_without_an_answer(objective: Name) -> None:
    allocator = load_allocator(objective=objective)
    assert isinstance(allocator, SearchAllocator)
    result = allocator.allocate(load_layout("A"), [90.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(AllocationError, match="out of reach"):
        allocator.bound(result)
