"""The yardstick of a robot, with which errors are compared, and the figures by which methods are judged."""

from functools import lru_cache

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics.objective import EffortMeter
from finlab.physics.plant import Plant, plant_of

STEPS = (9, 9, 17)
"""Values of each of its three numbers that an actuator is tried with, evenly spread over its limits."""
LEAST_LEVER = 1e-3
"""Least ratio [m] of the scale of torques to that of forces, for robots whose actuators turn nothing."""


def yardstick(layout: Layout) -> Array:
    """The scales (6,) of a robot's wrench: three times F [N], three times T [N m].

    F is the root of the sum of squares of the actuators' largest forces, T that of their largest torques
    about the origin, each actuator alone. A robot that gives nothing has F = 1 N. Raises DataError: a fin's
    force table cannot be read."""
    plant = Plant(layout)
    share = np.stack(np.meshgrid(*(np.linspace(0.0, 1.0, count) for count in STEPS), indexing="ij"), -1)
    command = plant.lower + share.reshape(-1, 1, 3) * plant.width
    wrench = np.einsum("kni,niw->knw", plant.force(command), plant.effectiveness)
    force = float(np.sqrt((wrench[..., :3] ** 2).sum(-1).max(0).sum())) or 1.0
    torque = float(np.sqrt((wrench[..., 3:] ** 2).sum(-1).max(0).sum()))
    scale = np.repeat([force, max(torque, LEAST_LEVER * force)], 3)
    scale.setflags(write=False)
    return scale


REACHED = 1e-3
"""Share of the yardstick up to which an error is none: the wrench counts as delivered."""


def judged_power(plant: Plant, command: Array) -> Array:
    """Mean mechanical power (N,) [W] of commands (N, n, 3); what has failed (NaN) takes none."""
    return np.asarray(np.nansum(plant.power(command), axis=-1))


def judged_effort(layout: Layout, command: Array) -> Array:
    """Effort `J_en` (N,) of commands (N, n, 3), the paper's energy proxy, without what has failed (NaN)."""
    failed = np.isnan(command).any(axis=-1, keepdims=True)
    return np.asarray(_meter(layout)(np.where(failed, 0.0, command) if failed.any() else command))


def costs(layout: Layout, command: Array) -> tuple[Array, Array]:
    """Effort (K,) and power (K,) [W] of commands (K, n, 3) of fins that all work."""
    return _meter(layout)(command), judged_power(plant_of(layout), command)


@lru_cache(maxsize=256)
def _meter(layout: Layout) -> EffortMeter:
    return EffortMeter(layout.upper)
