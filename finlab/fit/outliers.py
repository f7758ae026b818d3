"""Samples that contradict all others: a wrong unit, a bump of the rig, a cell that slipped."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from finlab.fit.gaussian_process import Component
from finlab.fit.measurements import Measurements

OUTLIER = 5.0
"""Error, over the usual one, beyond which a sample is left out."""


def find_outliers(measurements: Measurements, tell: Callable[[str], None]) -> NDArray[np.bool_]:
    """Returns which samples (n,) lie far off a fit to the others, in which such samples count for little.

    `tell` is called before each step.
    """
    turned, _ = measurements.thrust()
    sizes = np.linalg.norm(measurements.force, axis=-1)
    values = turned / (float(np.quantile(sizes, 0.98)) or float(sizes.max()))
    inputs = measurements.scaled(measurements.command)
    tell("looking for samples that contradict the others")
    along = Component(inputs, values[:, 0], wild=True)
    tell("looking for such samples across the thrust")
    across = Component(inputs, values[:, 1], size=along.mean, wild=True)
    return np.asarray((along.strange > OUTLIER) | (across.strange > OUTLIER))
