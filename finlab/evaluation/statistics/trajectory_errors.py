"""How far a robot is from where it should be: absolute and relative trajectory error, error of depth.

After J. Sturm et al., A Benchmark for the Evaluation of RGB-D SLAM Systems, IROS 2012. Robot and reference
share one world frame and one clock, so nothing is aligned and samples are paired by time. Only positions
count: the reference prescribes no attitude.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finlab.errors import DataError

Array = NDArray[np.float64]

RTE_DELTA_S = 5.0
"""Time between the two ends of a piece of path that the relative error compares [s]."""


def absolute_error(position: Array, reference: Array) -> float:
    """ATE: root mean square of the distance between positions (N, 3) and reference (N, 3) [m]."""
    return float(np.sqrt(np.square(position - reference).sum(axis=-1).mean()))


def relative_error(position: Array, reference: Array, delta: int) -> float:
    """RTE: root mean square difference of the displacements over `delta` samples, all pairs [m].

    Raises:
        DataError: there are no two samples that far apart.
    """
    if not 0 < delta < len(position):
        raise DataError(f"relative error: expected a step of 1 to {len(position) - 1} samples, got {delta}")
    error = position - reference
    return absolute_error(error[delta:], error[:-delta])


def depth_error(position: Array, reference: Array) -> float:
    """Root mean square error of the depth [m]."""
    return float(np.sqrt(np.square(position[:, 2] - reference[:, 2]).mean()))
