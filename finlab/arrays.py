"""Types of arrays, shares that stand for nothing, one formula for numpy, torch and CasADi, small
systems."""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Numbers in double precision."""
AnyArray = NDArray[Any]
"""Numbers of a type that is given elsewhere: of single precision, complex, whole or truth values,
too."""
Values = Any
"""A numpy array, a tensor or a symbol."""

ROUNDING = 1e-12
"""Share of a value that the rounding of sums may take."""
NOTHING = 1e-9
"""Share from which on a thing counts as there: far above rounding, far below what anybody can
feel."""
NEARLY = 1e-6
"""Share of a thing that may be missing where it counts as whole."""
FINE = 1e-5
"""Share by which a compiled table may be off between its points."""
CLOSE = 1e-4
"""Share that is not worth another search."""
ROUNDS = 12
"""Most times that something is repeated that mostly settles after a few."""


def library_of(value: Any) -> Any:
    """Returns the module whose `sin`, `cos` ... work on `value`; numpy for arrays and plain
    numbers.

    Whoever made a tensor or a symbol has loaded its library; nothing is imported here.
    """
    if type(value) is np.ndarray:
        return np
    module = type(value).__module__.partition(".")[0]
    return sys.modules[module] if module in ("torch", "casadi") else np


try:
    from numpy.linalg import _umath_linalg as _lapack
except ImportError:
    _lapack = np.linalg  # type: ignore[misc]


def solve(matrix: Array, right: Array) -> AnyArray:
    """Solutions (..., m, k) of systems (..., m, m) with right sides (..., m, k), broadcast; NaN
    where one is singular."""
    solution: AnyArray = _lapack.solve(matrix, right)
    return solution
