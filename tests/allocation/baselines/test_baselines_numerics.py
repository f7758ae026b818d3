"""The numerical parts of the model-based methods against independent references."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from finlab.allocation.baselines.box_least_squares import solve_box_quadratics
from finlab.layout import random_layout
from finlab.physics import plant_of

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35])


def test_feasible_wraps_full_turns_and_clips_the_rest() -> None:
    rng = np.random.default_rng(1)
    layout = random_layout(rng, n_fins=5, limits="varied")
    plant = plant_of(layout)
    wild = rng.normal(scale=20.0, size=(100, 5, 3))
    tame = plant.feasible(wild)
    assert (tame >= plant.lower).all() and (tame <= plant.upper).all()
    turns = (tame - wild)[:, plant.full_turn, 2] / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)
    np.testing.assert_array_equal(plant.feasible(tame), tame)


@pytest.mark.parametrize("n_variables", [1, 6, 15, 48])
def test_box_quadratics_agree_with_scipy(n_variables: int) -> None:
    rng = np.random.default_rng(n_variables)
    matrix = rng.normal(size=(40, 6, n_variables))
    right = 3.0 * rng.normal(size=(40, 6))
    lower, upper = -rng.uniform(0, 1, (40, n_variables)), rng.uniform(0, 1, (40, n_variables))
    weight = 1e-2
    hessian = np.einsum("bki,bkj->bij", matrix, matrix) + weight * np.eye(n_variables)
    gradient = -np.einsum("bki,bk->bi", matrix, right)
    found = solve_box_quadratics(hessian, gradient, lower, upper)
    assert (found >= lower).all() and (found <= upper).all()
    for i in range(len(found)):
        stacked = np.vstack([matrix[i], np.sqrt(weight) * np.eye(n_variables)])
        padded = np.concatenate([right[i], np.zeros(n_variables)])
        expected = lsq_linear(stacked, padded, (lower[i], upper[i]), method="bvls", tol=1e-14).x
        np.testing.assert_allclose(found[i], expected, atol=1e-6)


def test_box_quadratics_meet_their_optimality_conditions() -> None:
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(500, 6, 12))
    hessian = np.einsum("bki,bkj->bij", matrix, matrix) + 1e-4 * np.eye(12)
    gradient = 5.0 * rng.normal(size=(500, 12))
    x = solve_box_quadratics(hessian, gradient, -np.ones((500, 12)), np.ones((500, 12)))
    slope = np.einsum("bij,bj->bi", hessian, x) + gradient
    assert np.abs(x - np.clip(x - slope, -1, 1)).max() < 1e-7


def test_a_fixed_variable_stays() -> None:
    x = solve_box_quadratics(
        np.eye(2)[None], np.array([[-1.0, -1.0]]), np.zeros((1, 2)), np.array([[0.0, 5.0]])
    )
    np.testing.assert_allclose(x, [[0.0, 1.0]])
