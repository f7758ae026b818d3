"""Lower bounds on cost: never above what some command costs, close to what the search finds."""

import numpy as np
import pytest

from finlab.errors import AllocationError
from finlab.forces.cost_bound import CostDual
from finlab.forces.envelopes import layout_envelopes
from finlab.forces.force_space import PlanarProblem, planar_problem
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.physics import plant_of
from finlab.physics.objective import Name, Objective
from tests.any_robot import AnyRobot

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
    return Layout(name="uneven", actuators=tuple(fins))


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
    allocator, plant = AnyRobot(), plant_of(layout)
    for command in plant.sample(np.random.default_rng(2), (4,)):
        result = allocator.allocate(layout, plant.wrench(command))
        bound = allocator.bound(result)
        assert 0.99 * result.power <= bound <= result.power


def test_no_bound_without_an_answer_and_none_of_effort() -> None:
    allocator, layout = AnyRobot(), load_layout("A")
    with pytest.raises(AllocationError, match="out of reach"):
        allocator.bound(allocator.allocate(layout, [90.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    effort = allocator.with_settings(objective="effort")
    with pytest.raises(AllocationError, match="proven for power alone"):
        effort.bound(effort.allocate(layout, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
