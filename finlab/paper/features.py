"""The paper's ten node features: position, mounting angle and six limits of each fin.

One function for training (torch) and inference (numpy): it takes arrays of either library and answers in
kind. What the network of method `mdn` sees is in `finlab.mdn.features`.
"""

import math

from finlab.arrays import Values, library_of

RAW_SIZE = 10
"""Number of node features (paper: x_i in R^10)."""
POSITION_SCALE = 0.3
"""Positions [m] of order one: the paper's layouts lie within."""
SCALES = (0.6, 2.1, math.pi)
"""Amplitude [rad], frequency [Hz] and zero direction [rad] of order one."""


def raw_features(position: Values, mounting_angle: Values, lower: Values, upper: Values) -> Values:
    """The node features (..., n, 10) of fins (..., n, 3), (..., n) with limits (..., n, 3), scaled."""
    xp = library_of(position)
    limits = [limit[..., i] / scale for i, scale in enumerate(SCALES) for limit in (lower, upper)]
    angle = mounting_angle[..., None] / math.pi
    return xp.concatenate([position / POSITION_SCALE, angle, xp.stack(limits, axis=-1)], axis=-1)
