"""The weighted descent against dense linear algebra: energies, held variables, damping, when rows stop."""

from typing import Any

import numpy as np
import pytest

from finlab.allocation.command_cost import Bowl, EffortCost
from finlab.allocation.weighted_descent import (
    DescentOptions,
    _bowl,
    _clamped_step,
    _damped_step,
    _inverse,
    _least,
    _times,
    descend,
)
from finlab.layout import Fin, Layout, Limits
from finlab.physics import Plant, plant_of
from finlab.physics.energy import EnergyMeter, EnergyWeights, command_energy

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.3, 0.4])
WEIGHTS, WEIGHT = EnergyWeights(1.0, 2.0, 0.4, 0.7), 0.3
"""Every weight differs from every other."""


@pytest.fixture
def plant() -> Plant:
    """One fin that turns freely and one in an arc, with different limits."""
    arc = Limits((0.1, 0.5), (0.3, 1.4), (0.3, 1.7))
    return plant_of(
        Layout("two", (Fin("a", (0.2, 0.1, 0.0), 0.4), Fin("b", (-0.3, 0.2, 0.1), 2.0, limits=arc)))
    )


def bowl_at(plant: Plant, position: np.ndarray) -> Bowl:
    """What stands for the effort at positions (B, 2, 3) between the limits."""
    return _bowl(
        plant, plant.lower + position * plant.width, EffortCost(EnergyMeter(plant.upper, WEIGHTS), WEIGHT)
    )


def pull_at(plant: Plant, position: np.ndarray) -> np.ndarray:
    """Half its gradient (2, 3) at one position (2, 3)."""
    return np.asarray(bowl_at(plant, position[None]).slope[0])


def dense(plant: Plant) -> np.ndarray:
    """Half the Hessian (3 n, 3 n) of the weighted energy by positions, entry by entry."""
    weights, size = WEIGHTS, 3 * plant.n_fins
    result = np.zeros((size, size))
    for i in range(plant.n_fins):
        a, f, d = plant.width[i] / np.abs(plant.upper[i])
        result[3 * i, 3 * i] = weights.amplitude * a**2
        result[3 * i + 1, 3 * i + 1] = weights.frequency * f**2
        result[3 * i + 2, 3 * i + 2] = weights.zero_direction * d**2
        result[3 * i, 3 * i + 1] = result[3 * i + 1, 3 * i] = weights.product * a * f / 2
    return WEIGHT * result


def test_the_energys_gradient_is_half_its_derivative(plant: Plant) -> None:
    at = np.random.default_rng(0).random((4, 2, 3))
    for i in range(2):
        for j in range(3):
            offset = np.zeros((2, 3))
            offset[i, j] = 0.5
            more, less = (
                command_energy(plant.lower + (at + s * offset) * plant.width, plant.upper, WEIGHTS)
                for s in (1, -1)
            )
            # Central differences of a quadratic form are exact.
            expected = 0.3 * (more - less) / 2
            np.testing.assert_allclose(bowl_at(plant, at).slope[:, i, j], expected, rtol=1e-12)


def test_the_energys_inverse_is_that_of_the_dense_matrix(plant: Plant) -> None:
    bowl, damping = bowl_at(plant, np.full((2, 2, 3), 0.3)), np.array([0.01, 2.0])
    inverse, off = _inverse(bowl, damping, np.zeros((2, 2, 3), dtype=bool))
    for row in range(2):
        expected = np.linalg.inv(dense(plant) + damping[row] * np.eye(6))
        np.testing.assert_allclose(inverse[row].ravel(), np.diag(expected), rtol=1e-12)
        np.testing.assert_allclose(off[row], expected[[0, 3], [1, 4]], rtol=1e-12)
        vector = np.random.default_rng(row).normal(size=(2, 3))
        applied = _times(vector, inverse[row], off[row])
        np.testing.assert_allclose(applied.ravel(), expected @ vector.ravel(), rtol=1e-12)


def test_a_held_variable_leaves_the_inverse_of_the_others(plant: Plant) -> None:
    bowl, held = bowl_at(plant, np.full((1, 2, 3), 0.3)), np.zeros((1, 2, 3), dtype=bool)
    held[0, 0, 0] = held[0, 1, 2] = True
    inverse, off = _inverse(bowl, np.array([0.01]), held)
    free = np.flatnonzero(~held.ravel())
    expected = np.linalg.inv((dense(plant) + 0.01 * np.eye(6))[np.ix_(free, free)])
    np.testing.assert_allclose(inverse.ravel()[free], np.diag(expected), rtol=1e-12)
    assert inverse[held].max() < 1e-20 and abs(off[0, 0]) < 1e-20


def step_of(
    plant: Plant, position: np.ndarray, residual: np.ndarray, slope: np.ndarray, damping: float, passes: int
) -> np.ndarray:
    bowl = bowl_at(plant, position[None])
    step = _clamped_step(
        position[None], residual[None], slope[None], np.array([damping]), bowl, plant, passes
    )
    return np.asarray(step[0])


def solved(
    plant: Plant,
    position: np.ndarray,
    residual: np.ndarray,
    slope: np.ndarray,
    damping: float,
    free: np.ndarray,
) -> np.ndarray:
    """The damped step over the free variables (3 n,) by one dense solve."""
    gradient = slope.T @ residual + pull_at(plant, position).ravel()
    matrix = slope.T @ slope + dense(plant) + damping * np.eye(6)
    step = np.zeros(6)
    step[free] = np.linalg.solve(matrix[np.ix_(free, free)], -gradient[free])
    return step


@pytest.mark.parametrize("seed", range(4))
def test_a_step_within_the_limits_is_that_of_the_dense_matrix(plant: Plant, seed: int) -> None:
    rng = np.random.default_rng(seed)
    residual, slope = 0.1 * rng.normal(size=6), rng.normal(size=(6, 6))
    position = np.full((2, 3), 0.5)
    expected = solved(plant, position, residual, slope, 5.0, np.arange(6))
    assert np.abs(expected).max() < 0.5
    np.testing.assert_allclose(step_of(plant, position, residual, slope, 5.0, 2), expected, rtol=1e-9)


@pytest.mark.parametrize("beyond", [0.0, 1e-3])
@pytest.mark.parametrize("pull", [0.2, 3.0])
@pytest.mark.parametrize("end", [0.0, 1.0])
def test_what_would_leave_its_limit_is_held_from_the_first_pass(
    plant: Plant, end: float, pull: float, beyond: float
) -> None:
    """At, or by rounding beyond, a limit: the others are solved without it."""
    outwards = 1.0 if end else -1.0
    position, slope = np.full((2, 3), 0.5), 0.3 * np.random.default_rng(3).normal(size=(6, 6))
    position[1, 2] = end + outwards * beyond
    slope[:, 5] = np.eye(6)[5]
    residual = np.zeros(6)
    residual[5] = -outwards * pull - pull_at(plant, position)[1, 2]  # half the gradient is what is asked
    free = np.arange(5)
    step = step_of(plant, position, residual, slope, 20.0, 1)
    np.testing.assert_allclose(step[:5], solved(plant, position, residual, slope, 20.0, free)[:5], rtol=1e-9)
    assert step[5] == pytest.approx(-outwards * beyond, abs=1e-15)
    inwards = residual.copy()
    inwards[5] = outwards * pull - pull_at(plant, position)[1, 2]
    step = step_of(plant, position, inwards, slope, 20.0, 1)
    expected = solved(plant, position, inwards, slope, 20.0, np.arange(6))
    np.testing.assert_allclose(step[:5], expected[:5], rtol=1e-9)


def test_a_free_turn_is_held_nowhere_and_stops_after_half_a_turn(plant: Plant) -> None:
    position, slope = np.full((2, 3), 0.5), np.zeros((6, 6))
    slope[0, 2] = 1.0
    residual = np.array([30.0, 0, 0, 0, 0, 0])
    for end, sign in ((0.0, 1.0), (1.0, -1.0)):
        position[0, 2] = end
        assert step_of(plant, position, sign * residual, slope, 1e-6, 2)[2] == -0.5 * sign


def test_a_crossed_limit_fixes_its_variable_there_and_the_rest_is_solved_anew(plant: Plant) -> None:
    rng = np.random.default_rng(5)
    position, slope = np.full((2, 3), 0.5), 0.2 * rng.normal(size=(6, 6))
    position[1, 0], slope[:, 3] = 0.9, 2 * np.eye(6)[1]
    residual = np.array([0.1, -2.0, 0.0, 0.1, 0.0, -0.1])
    step = step_of(plant, position, residual, slope, 2.0, 2)
    assert step[3] == pytest.approx(0.1)
    # With the crossed variable moved to its limit, the others minimize what is left.
    moved = position.copy()
    moved[1, 0] = 1.0
    rest = residual + 0.1 * slope[:, 3]
    expected = solved(plant, moved, rest, slope, 2.0, np.array([0, 1, 2, 4, 5]))
    expected[3] = 0.1
    np.testing.assert_allclose(step, expected, rtol=1e-9)
    one = step_of(plant, position, residual, slope, 2.0, 1)
    assert one[3] == pytest.approx(0.1) and np.abs(one - step).max() > 1e-3


def test_damped_steps_do_not_move_what_is_held(plant: Plant) -> None:
    rng, held = np.random.default_rng(6), np.zeros((3, 2, 3), dtype=bool)
    held[1, 0, 1] = held[2] = True
    bowl = bowl_at(plant, np.full((3, 2, 3), 0.3))
    step = _damped_step(
        rng.normal(size=(3, 6)),
        rng.normal(size=(3, 6, 6)),
        rng.normal(size=(3, 2, 3)),
        np.full(3, 0.1),
        held,
        bowl,
    )
    assert np.abs(step[held]).max() < 1e-20 and np.abs(step[~held]).min() > 1e-6


def test_the_least_damping_grows_with_the_derivatives_from_an_absolute_one() -> None:
    slope = np.zeros((2, 6, 3))
    slope[1, 0, :2] = 3.0, 4.0
    options = DescentOptions(least_damping=1e-3, least_relative_damping=1e-2)
    np.testing.assert_allclose(_least(slope, options), [1e-3, 0.25])


def test_no_step_leaves_the_start_within_its_limits_and_tells_its_objective(plant: Plant) -> None:
    start, target = plant.sample(np.random.default_rng(1), (3,)), np.ones((3, 6))
    options = DescentOptions(n_steps=0)
    found = descend(plant, start, target, SIGMA, options, EffortCost(EnergyMeter(plant.upper), 0.5))
    np.testing.assert_array_equal(found.command, plant.feasible(start))
    np.testing.assert_allclose(found.wrench, plant.wrench(start), rtol=1e-12)
    missing = ((plant.wrench(start) - 1.0) / SIGMA) ** 2
    expected = missing.sum(1) + 0.5 * command_energy(start, plant.upper)
    np.testing.assert_allclose(found.objective, expected, rtol=1e-12)
    other = np.full((2, 3), 7.0)
    expected = missing.sum(1) + 0.5 * command_energy(start, other)
    scaled = EffortCost(EnergyMeter(other), 0.5)
    found = descend(plant, start, target, SIGMA, options, scaled)
    np.testing.assert_allclose(found.objective, expected, rtol=1e-12)
    np.testing.assert_allclose(
        descend(plant, start, target, SIGMA, options).objective, missing.sum(1), rtol=1e-12
    )


def test_rows_do_not_see_each_other(plant: Plant) -> None:
    """Among others that end earlier or later, a row ends where it ends alone."""
    rng = np.random.default_rng(2)
    start, target = plant.sample(rng, (6,)), 0.4 * plant.wrench(plant.sample(rng, (6,)))
    target[0] = plant.wrench(start[:1])[0]  # done at once
    options, cost = DescentOptions(n_steps=15), EffortCost(EnergyMeter(plant.upper), 1e-3)
    together = descend(plant, start, target, SIGMA, options, cost)
    for i in range(6):
        alone = descend(plant, start[i : i + 1], target[i : i + 1], SIGMA, options, cost)
        # Where the objective is flat to rounding, commands may differ by its root.
        np.testing.assert_allclose(together.objective[i], alone.objective[0], atol=1e-12)
        np.testing.assert_allclose(together.command[i], alone.command[0], atol=1e-4)
        np.testing.assert_allclose(together.wrench[i], plant.wrench(together.command[i]), atol=1e-9)


def test_it_stops_when_told_with_the_best_so_far(plant: Plant) -> None:
    start, target = plant.sample(np.random.default_rng(4), (2,)), np.full((2, 6), 0.3)
    one = descend(plant, start, target, SIGMA, DescentOptions(n_steps=1))
    stopped = descend(plant, start, target, SIGMA, DescentOptions(n_steps=20), is_over=lambda: True)
    np.testing.assert_array_equal(stopped.command, one.command)
    longer = descend(plant, start, target, SIGMA, DescentOptions(n_steps=20))
    assert (longer.objective < one.objective).all()


class Spring:
    """One fin whose commands are half of its wrench; it counts how often it was asked."""

    n_fins = 1
    lower, upper, width = np.full((1, 3), -10.0), np.full((1, 3), 10.0), np.full((1, 3), 20.0)
    full_turn = np.zeros(1, dtype=bool)

    def __init__(self) -> None:
        self.asked = 0

    def linearize(self, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.asked += 1
        slope = np.eye(6)[:, :3] / 2.0
        return np.asarray(command[:, 0] @ slope.T), np.tile(slope, (len(command), 1, 1))

    def feasible(self, command: np.ndarray) -> np.ndarray:
        return np.asarray(np.clip(command, self.lower, self.upper))


def settle(missing: float, **options: Any) -> tuple[float, int]:
    """The square root of where J ends, as a share of what was missing first, and how many steps it took."""
    target, spring = np.zeros((1, 6)), Spring()
    target[0, 1] = missing
    found = descend(spring, np.zeros((1, 1, 3)), target, np.ones(6), DescentOptions(**options))
    return float(np.sqrt(found.objective[0])) / missing, spring.asked - 1


def test_the_first_damping_is_that_of_a_full_range_and_one_plus_the_objective() -> None:
    """A range moves the wrench by 10, so a damping d leaves d / (100 + d) of what was missing."""
    for missing in (1e-3, 0.1, 3.0):
        for given in ({}, {"damping": 5.0}):
            damping = given.get("damping", 0.01) * (1.0 + missing**2)
            left, steps = settle(missing, n_steps=1, **given)
            assert steps == 1 and left == pytest.approx(damping / (100.0 + damping), rel=1e-6)


def test_damping_falls_by_its_factor_after_each_gain_as_far_as_it_may() -> None:
    first, second = 0.5 * (1.0 + 1e-4), 0.2 * 0.5 * (1.0 + 1e-4)
    left, _ = settle(0.01, n_steps=2, damping=0.5)
    assert left == pytest.approx(first / (100.0 + first) * second / (100.0 + second), rel=1e-5)
    left, _ = settle(0.01, n_steps=2, damping=0.5, least_damping=0.3)
    assert left == pytest.approx(first / (100.0 + first) * 0.3 / 100.3, rel=1e-5)
    left, _ = settle(0.01, n_steps=2, damping=0.5, least_relative_damping=1e-3)  # of 3 * 100
    assert left == pytest.approx(first / (100.0 + first) * 0.3 / 100.3, rel=1e-5)


def test_a_row_is_done_below_the_squared_tolerance_or_without_a_gain() -> None:
    """Each step leaves half of the error, a quarter of the objective."""
    half = {"damping": 100.0, "damping_factors": (1.0, 6.0)}
    assert settle(1e-4, n_steps=5, **half)[1] == 5
    # J is 1e-8 at first and 1e-8 / 4^k after k steps; the tolerance squared is 1e-9 or 1e-10.
    assert settle(1e-4, n_steps=50, tolerance=1e-9**0.5, **half)[1] == 2
    assert settle(1e-4, n_steps=50, tolerance=1e-10**0.5, **half)[1] == 4
    # Here each leaves 1000 / 1100 of the error: a gain of 0.21 of the objective that is left.
    slow = {"damping": 500.0, "damping_factors": (1.0, 6.0), "n_steps": 50}
    assert settle(1.0, tolerance=0.22, **slow)[1] == 1 < 5 < settle(1.0, tolerance=0.2, **slow)[1]


class Wall(Spring):
    """A spring whose wrench, but not its slope, says that nothing helps."""

    def linearize(self, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        wrench, slope = super().linearize(command)
        return -wrench, slope


@pytest.mark.parametrize(("largest", "steps"), [(5.0, 1), (7.0, 2), (35.0, 2), (37.0, 3)])
def test_damping_grows_six_times_after_each_step_that_does_not_help(largest: float, steps: int) -> None:
    """From one: a row is done once its damping is the largest."""
    wall, target = Wall(), np.zeros((1, 6))
    target[0, 1] = 1.0
    options = DescentOptions(damping=0.5, largest_damping=largest)
    found = descend(wall, np.zeros((1, 1, 3)), target, np.ones(6), options)
    assert wall.asked - 1 == steps
    assert found.objective[0] == 1.0 and (found.command == 0.0).all()


def test_what_has_no_range_stays_where_it_is() -> None:
    stiff = Limits((0.3, 0.3), (0.3, 1.4), (0.7, 0.7))
    plant = plant_of(Layout("stiff", (Fin("a", (0.2, 0.1, 0.0), 0.4, limits=stiff),)))
    wanted = plant.wrench(np.array([[[0.3, 1.1, 0.7]]]))
    found = descend(plant, plant.lower[None], wanted, SIGMA, DescentOptions())
    np.testing.assert_allclose(found.command[0, 0], [0.3, 1.1, 0.7], atol=1e-6)
