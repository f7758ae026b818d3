"""The water that meets each actuator of a robot that moves."""

import numpy as np

from finlab.arrays import Array


def inflow_of(flow: Array, position: Array, axes: Array) -> Array:
    """Returns the velocity (..., n, 3) of each actuator's place through the water, in its own frame [m/s].

    Args:
        flow: velocity (..., 6) of the body relative to the water [m/s, rad/s], body frame.
        position: places (n, 3), body frame [m].
        axes: own frames (n, 3, 3), rows in the body frame.
    """
    moved = flow[..., None, :3] + np.cross(flow[..., None, 3:], position)
    result: Array = np.einsum("...nb,nab->...na", moved, axes)
    return result
