"""The core's systems of six equations, beside numpy."""

import ctypes
import math

import numpy as np
import pytest

from finlab.arrays import Array
from tests.core.internal_functions import at, functions


def factor_of(matrix: Array) -> tuple[int, Array]:
    """Whether a symmetric matrix (6, 6) is regular, and its factor, of the lower triangle alone."""
    factor = np.tril(matrix)
    return int(functions().fl_factor(at(factor))), factor


@pytest.mark.parametrize("seed", range(5))
def test_equations_are_solved(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(6, 6))
    matrix = root @ root.T + 0.1 * np.eye(6)
    right = rng.normal(size=6)
    code, factor = factor_of(matrix)
    solution = np.zeros(6)
    functions().fl_solve(at(factor), at(right), at(solution))
    assert code == 1
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, right), rtol=1e-9)


@pytest.mark.parametrize("negative", range(6))
def test_a_matrix_with_a_direction_that_falls_is_singular(negative: int) -> None:
    rng = np.random.default_rng(negative)
    axes = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    size = np.ones(6)
    size[negative] = -1.0
    assert factor_of(axes * size @ axes.T)[0] == 0
    assert factor_of(np.full((6, 6), np.nan))[0] == 0


def test_squares_are_added_to_the_lower_triangle() -> None:
    rng = np.random.default_rng(1)
    matrix = np.zeros((6, 6))
    row = rng.normal(size=6)
    functions().fl_add_square(at(matrix), at(row), ctypes.c_double(2.5))
    np.testing.assert_allclose(matrix, np.tril(2.5 * np.outer(row, row)), rtol=1e-12)
    trace = functions().fl_trace
    trace.restype = ctypes.c_double
    assert trace(at(matrix)) == pytest.approx(2.5 * row @ row)


@pytest.mark.parametrize("turns", [-2, -1, 0, 1, 3])
def test_angles_are_wrapped_to_half_a_turn_either_way(turns: int) -> None:
    wrap = functions().fl_wrap_angle
    wrap.restype = ctypes.c_double
    for angle in (-math.pi, -2.0, 0.0, 1.0, 3.14):
        assert wrap(ctypes.c_double(angle + 2.0 * math.pi * turns)) == pytest.approx(
            angle, abs=1e-9
        )
