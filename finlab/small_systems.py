"""Many small linear systems at once, where the wrapper around LAPACK would take longer than LAPACK.

`numpy.linalg.solve` is a loop over systems inside a wrapper that checks and converts what it is given; for a
dozen 6 x 6 systems the wrapper takes half of the time, seven times in each answer. The systems here are in
double precision and regularized, so there is nothing to check. The loop is no public part of numpy: where
another numpy keeps it elsewhere, the public function answers the same, a little later.
"""

import numpy as np

from finlab.arrays import AnyArray, Array

try:
    from numpy.linalg import _umath_linalg as _lapack
except ImportError:
    _lapack = np.linalg  # type: ignore[misc]


def solve(matrix: Array, right: Array) -> AnyArray:
    """Solutions (..., m, k) of systems (..., m, m) with right sides (..., m, k), broadcast."""
    solution: AnyArray = _lapack.solve(matrix, right)
    return solution
