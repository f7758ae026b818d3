"""Small convex box-constrained quadratic programs, against SciPy and by hand."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from finlab.allocation.baselines.box_least_squares import (
    BoxSettings,
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
