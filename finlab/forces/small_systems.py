"""Many small linear systems at once, where the wrapper around LAPACK would take longer than LAPACK.

`numpy.linalg.solve` is a loop over systems inside a wrapper that checks and converts what it is given; for a
dozen 6 x 6 systems the wrapper takes half of the time, seven times in each answer. The systems here are in
double precision and regularized, so there is nothing to check. The loop is no public part of numpy: where
another numpy keeps it elsewhere, the public function answers the same, a little later.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array

Held = NDArray[np.bool_]


def step_within(
    free_step: Callable[[Array, Held], Array],
    low: Array,
    high: Array,
    passes: int,
    held: Held | None = None,
) -> Array:
    """A step whose variables stay within limits: solve, hold what crosses a limit there, solve again.

    Args:
        free_step: the step (R, ...), from values for the held variables and which those are (R, ...); it
            leaves them as they are.
        low: least step of each variable, 0 or below.
        high: largest step, 0 or above.
        passes: most times that the step is solved; what still crosses a limit then is cut off.
        held: variables that are held at no step from the start.
    """
    step: Array = np.zeros(low.shape)
    held = np.zeros(low.shape, bool) if held is None else held
    for _ in range(passes):
        free = free_step(step, held)
        out = (free < low) | (free > high)
        if not out.any():
            return free
        held = held | out
        step = np.where(held, np.minimum(np.maximum(free, low), high), 0.0)
    return np.where(out, step, free)


try:
    from numpy.linalg import _umath_linalg as _lapack
except ImportError:
    _lapack = np.linalg  # type: ignore[misc]


RANK = 1e-13
"""Eigenvalues of a matrix below this share of the largest one are rounding."""


def solve_symmetric(matrix: Array, right: Array) -> Array:
    """Solutions (..., m, k) of symmetric systems (..., m, m), singular ones among them.

    A regularization that is smaller than what rounding has lost of a matrix leaves it singular, as large fins
    far out in one line may do. The shortest of the best solutions is then taken, of all systems at once.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, right), np.float64)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(matrix, rcond=RANK, hermitian=True) @ right)


def solve(matrix: Array, right: Array) -> AnyArray:
    """Solutions (..., m, k) of systems (..., m, m) with right sides (..., m, k), broadcast."""
    solution: AnyArray = _lapack.solve(matrix, right)
    return solution
