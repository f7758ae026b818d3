"""Small convex box-constrained quadratic programs, against SciPy and by hand."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from finlab.allocation.baselines.box_least_squares import (
    EXACTLY,
    BoxSettings,
    _search,
    solve_box_quadratics,
)
from finlab.arrays import Array


def problems(seed: int, spread: float) -> tuple[Array, ...]:
    """Thirty problems of five variables: Hessians, gradients, limits; their factors and right sides."""
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(30, 7, 5)) * spread ** rng.normal(size=(30, 1, 5))
    right = rng.normal(size=(30, 7))
    ends = np.sort(0.4 * rng.normal(size=(2, 30, 5)), axis=0)
    hessian = factor.swapaxes(1, 2) @ factor
    gradient = -np.einsum("bij,bi->bj", factor, right)
    return hessian, gradient, ends[0], ends[1], factor, right


@pytest.mark.parametrize("spread", [1.0, 3.0])
def test_solutions_are_those_of_an_active_set_solver(spread: float) -> None:
    hessian, gradient, lower, upper, factor, right = problems(1, spread)
    found = solve_box_quadratics(hessian, gradient, lower, upper)
    assert ((found >= lower) & (found <= upper)).all()
    for k in range(30):
        known = lsq_linear(factor[k], right[k], (lower[k], upper[k]), method="bvls", tol=1e-14)
        np.testing.assert_allclose(found[k], known.x, atol=1e-7)
    assert 0.1 < ((found == lower) | (found == upper)).mean() < 0.95


def test_a_hessian_that_rounding_has_left_singular_has_a_solution() -> None:
    """One of two problems has two variables that are one; with the other it is solved at once."""
    twins = 1e12 * np.ones((2, 2))
    hessian = np.stack([twins, np.diag([2.0, 1.0])])
    gradient = np.array([[-1e12, -1e12], [-2.0, 3.0]])
    found = solve_box_quadratics(hessian, gradient, np.full((2, 2), -1.0), np.ones((2, 2)))
    np.testing.assert_allclose(found, [[0.5, 0.5], [1.0, -1.0]], rtol=1e-9)


def test_it_takes_no_more_steps_than_it_may() -> None:
    hessian, gradient, lower, upper, *_ = problems(2, 1.0)
    start = np.clip(0.0, lower, upper)
    over = solve_box_quadratics(hessian, gradient, lower, upper, is_over=lambda: True)
    np.testing.assert_array_equal(over, start)
    none = solve_box_quadratics(hessian, gradient, lower, upper, BoxSettings(max_steps=0))
    np.testing.assert_array_equal(none, start)
    one = solve_box_quadratics(hessian, gradient, lower, upper, BoxSettings(max_steps=1))
    assert (one != start).any()
    assert not np.allclose(one, solve_box_quadratics(hessian, gradient, lower, upper))


def test_a_loose_tolerance_ends_at_a_small_projected_gradient() -> None:
    hessian, gradient, lower, upper, *_ = (0.2 * values for values in problems(3, 1.0))
    found = solve_box_quadratics(hessian, gradient, lower, upper, BoxSettings(tolerance=0.3))
    slope = np.einsum("bij,bj->bi", hessian, found) + gradient
    left = np.abs(found - np.clip(found - slope, lower, upper)).max(axis=1)
    most = 0.3 * np.minimum(np.abs(gradient).max(axis=1), 1.0)
    assert (left <= most).all() and (left > 1e-6).any()


def value(hessian: Array, slope: Array, move: Array) -> float:
    return float(slope @ move + 0.5 * move @ hessian @ move)


@pytest.mark.parametrize("limit", [0.6, 100.0])
def test_the_first_halved_step_that_falls_enough_is_taken(limit: float) -> None:
    hessian = np.array([[[4.0, 1.0], [1.0, 2.0]]])
    slope, at = np.array([[2.0, -1.0]]), np.array([[0.1, 0.2]])
    low, high = np.full((1, 2), -limit), np.full((1, 2), limit)
    for scale in (0.3, 0.65, 0.71, 0.72, 1.5, 6.0, 40.0):
        step = -scale * slope
        for length in 0.5 ** np.arange(20):
            expected = np.clip(at + length * step, low, high)
            move = (expected - at)[0]
            if value(hessian[0], slope[0], move) <= 1e-4 * (slope[0] @ move) < 0.0:
                break
        patient = BoxSettings(halvings=20)
        np.testing.assert_allclose(_search(hessian, slope, at, step, low, high, patient), expected)


def test_where_the_bent_path_does_not_fall_the_straight_way_to_the_limit_does() -> None:
    """The path bends at once, where the second variable meets its limit, and leads uphill from there."""
    hessian, slope = np.array([[[1.0, 0.99], [0.99, 1.0]]]), np.array([[1.0, 1.2]])
    at, low, high = np.array([[0.0, -0.999]]), np.full((1, 2), -1.0), np.full((1, 2), 100.0)
    step = -np.linalg.solve(hessian[0], slope[0])[None]
    assert step[0, 0] > 5.0 and step[0, 1] < -5.0
    for length in 0.5 ** np.arange(5):
        assert value(hessian[0], slope[0], (np.clip(at + length * step, low, high) - at)[0]) > 0.0
    found = _search(hessian, slope, at, step, low, high, EXACTLY)
    np.testing.assert_allclose(found, at + step * 0.001 / -step[0, 1], atol=1e-12)
    assert found[0, 1] == -1.0 and value(hessian[0], slope[0], (found - at)[0]) < 0.0


def test_where_the_straight_way_has_no_length_a_projected_gradient_step_falls() -> None:
    """As long as the largest sum of a row's sizes, 3, allows."""
    hessian, slope = np.array([[[2.0, 1.0], [1.0, 2.0]]]), np.array([[0.3, 9.0]])
    at, low, high = np.array([[1.0, 0.2]]), np.full((1, 2), -1.0), np.full((1, 2), 1.0)
    found = _search(hessian, slope, at, np.array([[0.4, 0.4]]), low, high, EXACTLY)
    np.testing.assert_allclose(found, [[1.0 - 0.1, -1.0]], atol=1e-12)
    assert value(hessian[0], slope[0], found[0] - at[0]) < 0.0


def test_variables_that_others_push_out_of_their_limits_rest() -> None:
    """Random problems whose solution lies in a corner of many limits are solved in few steps."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(200, 6, 15))
    hessian = root.swapaxes(1, 2) @ root + 1e-4 * np.eye(15)
    gradient = rng.normal(size=(200, 15))
    lower, upper = np.full((200, 15), -0.5), np.full((200, 15), 0.5)
    found = solve_box_quadratics(hessian, gradient, lower, upper, BoxSettings(max_steps=25))
    left = np.abs(found - np.clip(found - np.einsum("bij,bj->bi", hessian, found) - gradient, lower, upper))
    assert (np.abs(found) == 0.5).mean() > 0.3 and (left.max(axis=1) < 1e-8).mean() > 0.95
