"""Linear systems side by side, of which some are singular."""

import numpy as np

from finlab.arrays import solve_or_nan


def test_a_singular_system_is_nan_and_spoils_no_other() -> None:
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(2, 3, 4, 4)) + 4.0 * np.eye(4)
    wanted = rng.normal(size=(2, 3, 4, 2))
    right = matrix @ wanted
    np.testing.assert_allclose(solve_or_nan(matrix, right), wanted, atol=1e-12)
    matrix[1, 2] = 0.0
    solution = solve_or_nan(matrix, right)
    assert np.isnan(solution[1, 2]).all()
    np.testing.assert_allclose(solution[0], wanted[0], atol=1e-12)
    np.testing.assert_allclose(solution[1, :2], wanted[1, :2], atol=1e-12)


def test_one_matrix_serves_many_right_sides() -> None:
    matrix = np.array([[2.0, 0.0], [0.0, 4.0]])
    right = np.array([[[2.0], [4.0]], [[6.0], [8.0]]])
    np.testing.assert_array_equal(solve_or_nan(matrix, right)[..., 0], [[1.0, 1.0], [3.0, 2.0]])
    assert np.isnan(solve_or_nan(np.zeros((2, 2)), right)).all()
