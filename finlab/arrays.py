"""Types of arrays, relative tolerances, and what numpy, torch and CasADi have in common.

All rooms use it. The tolerances have the same names and values in the C core
(`finlab/core/src/internal.h`); a test holds both against docs/theory/numbers.md.
"""

import math
import sys
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""An array in double precision."""
AnyArray = NDArray[Any]
"""An array of any type of number: of single precision, complex, whole or truth values, too."""
Values = Any
"""A numpy array, a torch tensor or a CasADi symbol."""

ROUNDING = 1e-12
"""Relative error that the rounding of sums may have."""
NOTHING = 1e-9
"""Share of a quantity below which it counts as 0: far above rounding, far below what anybody can
feel."""
NEARLY = 1e-6
"""Share of a quantity that may be missing where it counts as whole."""
FINE = 1e-5
"""Relative error that a table may have between its points."""
CLOSE = 1e-4
"""Relative gain that is not worth another search."""
EXACT = 1e-8
"""Normalized error up to which commands need no further step."""
ROUNDS = 12
"""Most iterations of a search that mostly settles after a few."""


def library_of(value: Any) -> Any:
    """Returns the module whose `sin`, `cos` ... work on a value: `numpy`, `torch` or `casadi`.

    Whoever made a tensor or a symbol has loaded its library; nothing is imported here.
    """
    if type(value) is np.ndarray:
        return np
    module = type(value).__module__.partition(".")[0]
    return sys.modules[module] if module in ("torch", "casadi") else np


def has_nan(array: Array) -> bool:
    """Returns whether a contiguous array holds NaN; a product tells it in half the time of `isnan`
    and `any`."""
    numbers = array.ravel()
    return math.isnan(numbers @ numbers)


def solve_or_nan(matrix: Array, right: Array) -> AnyArray:
    """Solves linear systems, of which some may be singular.

    Args:
        matrix: matrices (..., m, m).
        right: right sides (..., m, k), with as many axes.

    Returns:
        Solutions (..., m, k), broadcast; NaN where a matrix is singular.
    """
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        # numpy says that one of them is singular, and not which: solve them one by one.
        batch = np.broadcast_shapes(matrix.shape[:-2], right.shape[:-2])
    matrices = np.broadcast_to(matrix, (*batch, *matrix.shape[-2:]))
    rights = np.broadcast_to(right, (*batch, *right.shape[-2:]))
    solution: AnyArray = np.full(rights.shape, np.nan, np.result_type(matrix, right))
    for index in np.ndindex(batch):
        with suppress(np.linalg.LinAlgError):
            solution[index] = np.linalg.solve(matrices[index], rights[index])
    return solution
