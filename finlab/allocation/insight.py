"""What a method's networks make of one target: what they propose, and which fins look at which."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Insight(NamedTuple):
    """One target on a layout of n fins that all work; the mixture has M components."""

    weight: Array
    """Weights of the components (M,)."""
    mean: Array
    """Their means (n, M, 3), commands normalized to -1..1 within each fin's limits."""
    std: Array
    """Their standard deviations (n, M, 3), in the same units."""
    attention: Array
    """How much each fin (rows) looks at each (columns), (n, n); rows sum to 1, itself included."""
