"""Samples that contradict all others: a wrong unit, a bump of the rig, a cell that slipped."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from finlab.fit.gaussian_process import Component
from finlab.fit.measurements import Measurements

OUTLIER = 5.0
"""Error, over the usual one, beyond which a sample is left out."""
ROUNDS = 3
"""Fits that look for such samples, each without those that the one before has found."""


def find_outliers(measurements: Measurements, tell: Callable[[str], None]) -> NDArray[np.bool_]:
    """Returns which samples (n,) lie far off a fit to the others.

    Outliers bend the first fit, so that their neighbours look like outliers, too: those that a fit
    without all of them explains are kept. `tell` is called before each step.
    """
    turned, _ = measurements.thrust()
    sizes = np.linalg.norm(measurements.force, axis=-1)
    largest = float(np.quantile(sizes, 0.98)) or float(sizes.max())
    values = turned / largest
    inputs = measurements.scaled(measurements.command)
    out = np.zeros(len(inputs), dtype=bool)
    for _ in range(ROUNDS):
        kept, before = ~out, out
        tell("looking for samples that contradict the others")
        along = Component(inputs[kept], values[kept, 0], wild=True)
        tell("looking for such samples across the thrust")
        across = Component(inputs[kept], values[kept, 1], size=along.mean, wild=True)
        size = along.expect(inputs)
        out = np.zeros_like(out)
        for component, value in ((along, values[:, 0]), (across, values[:, 1])):
            error, deviation = component.unseen(inputs, value, size)
            error[kept], deviation[kept] = component.left_out, component.left_out_deviation
            out |= np.abs(error) > OUTLIER * deviation
        if (out == before).all():
            break
    return np.asarray(out)
