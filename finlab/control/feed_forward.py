"""What a path will take: the wrenches that a robot's own model needs along it, told some ticks before."""

from collections.abc import Sequence

import numpy as np

from finlab.arrays import Array
from finlab.control.measurement import Setpoint
from finlab.control.observer import AXES, MotionObserver


def wrenches_along(
    observer: MotionObserver, setpoints: Sequence[Setpoint], current: Array, slow: float, period_s: float
) -> Array:
    """Wrenches (K, 6) [N, N m] of a robot that moves as K setpoints say, nose ahead.

    Args:
        observer: the robot's inertia and damping.
        setpoints: at least two, a period apart.
        current: horizontal velocity (2,) of the water in the world [m/s].
        slow: speed through the water [m/s] below which turning counts less and less.
        period_s: time between setpoints [s].
    """
    velocity = np.array([setpoint.velocity for setpoint in setpoints])
    acceleration = np.array([setpoint.acceleration for setpoint in setpoints])
    (x, y), (ax, ay) = (velocity[:, :2] - current).T, acceleration[:, :2].T
    speed = np.hypot(x, y)
    turning = (x * ay - y * ax) / np.maximum(speed * speed, slow * slow)
    faster = (x * ax + y * ay) / np.maximum(speed, 1e-3)
    rest = np.zeros(len(speed))
    motion = np.stack([speed, rest, velocity[:, 2], turning], axis=-1)
    changes = np.stack([faster, rest, acceleration[:, 2], np.gradient(turning, period_s)], axis=-1)
    result = np.zeros((len(speed), 6))
    result[:, AXES] = observer.inertia * (changes + observer.slowed_by(motion))
    return result
