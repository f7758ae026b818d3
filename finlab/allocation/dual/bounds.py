"""What no answer can undercut: the dual value at the prices found, by the laws of the actuators themselves.

For any price `p` of the wrench, an answer that gives the wrench `w` takes at least `p.w` less what all that
the actuators can give is worth at most at that price (weak duality). Compiled tables find the price; here
each actuator's own law says what its best command is worth, so that the bound does not lean on the tables.
"""

import numpy as np

from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import Array
from finlab.precision import ROUNDING


def proved_power(compiled: Compiled, wrench: Array, price: Array) -> Array:
    """Power (N,) [W] that no answer for wrenches (N, 6) undercuts, by prices (N, 6) [W/N, W/(N m)]."""
    robot = compiled.robot
    along = np.empty((3, compiled.count, len(wrench)))
    along[:, robot.order] = robot.answers.worth((price @ robot.effectiveness.T).T, robot.sets)
    ahead, back, worth = along
    for places, group in compiled.groups:
        own = group.worth(price)
        own = group.radial_worth(ahead[places].T, back[places].T) if own is None else own
        if own is not None:
            worth[places] = own.T
    paid = price * (wrench - compiled.beside)
    rounding = ROUNDING * (np.abs(paid).sum(axis=1) + np.abs(worth).sum(axis=0))
    return np.asarray(paid.sum(axis=1) - worth.sum(axis=0) - rounding)
