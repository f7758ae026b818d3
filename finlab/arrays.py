"""Types of arrays, one formula for numpy, torch and CasADi, and many small linear systems at once."""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Numbers in double precision."""
AnyArray = NDArray[Any]
"""Numbers of a type that is given elsewhere: of single precision, complex, whole or truth values, too."""
Values = Any
"""A numpy array, a tensor or a symbol."""


def library_of(value: Any) -> Any:
    """Returns the module whose `sin`, `cos` ... work on `value`; numpy for arrays and plain numbers.

    Whoever made a tensor or a symbol has loaded its library; nothing is imported here.
    """
    module = type(value).__module__.partition(".")[0]
    return sys.modules[module] if module in ("torch", "casadi") else np


try:
    from numpy.linalg import _umath_linalg as _lapack
except ImportError:
    _lapack = np.linalg  # type: ignore[misc]


def solve(matrix: Array, right: Array) -> AnyArray:
    """Solutions (..., m, k) of systems (..., m, m) with right sides (..., m, k), broadcast; NaN where one is
    singular."""
    solution: AnyArray = _lapack.solve(matrix, right)
    return solution
