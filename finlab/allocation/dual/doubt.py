"""What the uncertainty of actuators costs, for answers that are to be trusted.

The expected squared miss, each axis over the yardstick s, is a sum over the actuators where they err by
themselves: the variance of each force, (share F)^2 + floor^2, times the squares of its effectiveness over s.
Its part that depends on the force is a square of it, so that the dual takes it as more power. What actuators
of one fit or table have in common is left out, as is the drag that comes with a rudder's lift; fins that are
not alike all round count by their mean.
"""

import numpy as np

from finlab.arrays import Array
from finlab.layout.layout import Layout
from finlab.uncertainty.known import uncertainties


def price_of_doubt(layout: Layout, scale: Array, robust: float) -> Array | None:
    """Returns what a squared force of each actuator costs for the squared effectiveness of each axis (n, 6)
    [W, W/m^2 per N^2]; None where nothing does.

    Args:
        layout: the robot.
        scale: yardstick (6,) of the miss [N, N m].
        robust: what an expected miss of 1 % of the yardstick costs [W]; it grows with the square.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    if robust == 0.0:
        return None
    shares = np.array([0.0 if own is None else own.share for own in uncertainties(layout)])
    return np.multiply.outer(robust * shares**2, (0.01 * scale) ** -2.0) if shares.any() else None
