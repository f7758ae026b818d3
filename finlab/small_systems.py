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
) -> Array:
    """A step whose variables stay within limits: solve, hold what crosses a limit there, solve again.

    Args:
        free_step: the step (R, ...), from values for the held variables and which those are (R, ...); it
            leaves them as they are.
        low: least step of each variable, 0 or below.
        high: largest step, 0 or above.
        passes: most times that the step is solved; what still crosses a limit then is cut off.
    """
    step: Array = np.zeros(low.shape)
    held = np.zeros(low.shape, bool)
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


def solve(matrix: Array, right: Array) -> AnyArray:
    """Solutions (..., m, k) of systems (..., m, m) with right sides (..., m, k), broadcast."""
    solution: AnyArray = _lapack.solve(matrix, right)
    return solution
