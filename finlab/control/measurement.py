"""Measurements, setpoints, and the protocols of controllers and learners."""

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout

NO_WRENCH = np.zeros(6)
"""Of fins that have given nothing."""


class Measurement(NamedTuple):
    """The newest sample of every sensor. World: z up; body: x forward, y left, z up."""

    time: float
    """Now [s]; a slow sensor's sample may be older."""
    position: Array
    """Position (3,) in the world [m], from the markers that a camera sees."""
    yaw: float
    """Heading from the world's x, counter-clockwise [rad], from the same markers."""
    velocity: Array
    """Velocity (3,) over ground in the body frame [m/s], from the DVL."""
    depth: float
    """Depth below the world's origin, -z [m], from the pressure."""
    rates: Array
    """Angular rates (3,) in the body frame [rad/s], from the IMU."""
    roll: float
    """Roll [rad], from the IMU."""
    pitch: float
    """Pitch [rad], positive with the nose down, from the IMU."""
    ages: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    """How old the samples of markers, pressure, DVL and IMU are by their time stamps [s]."""

    def as_array(self) -> Array:
        """Position, roll, pitch, yaw, velocity and rates side by side (12,), as a log keeps them."""
        pose = [*self.position[:2], -self.depth, self.roll, self.pitch, self.yaw]
        return np.array([*pose, *self.velocity, *self.rates])


class Setpoint(NamedTuple):
    """What the robot should do now; a controller takes what it needs."""

    position: Array
    """Waypoint (3,) in the world [m]."""
    surge: float
    """Speed along x [m/s]."""
    velocity: Array = np.zeros(3)
    """Velocity (3,) of the waypoint in the world [m/s]."""
    acceleration: Array = np.zeros(3)
    """Its acceleration (3,) [m/s^2]."""
    onward: float = math.nan
    """Heading [rad] in which the path goes on from here, where it rests, too; NaN where it goes nowhere."""


class Controller(Protocol):
    """Turns measurements into a wrench; called at a fixed rate."""

    name: str
    axes: tuple[str, ...]
    """Axes of the wrench that it commands; the others are to stay as near zero as the fins can hold them, but
    for the free ones."""
    free: tuple[str, ...]
    """Axes that may be whatever the fins give along with the others at the least force."""
    period_s: float
    """Time between calls [s]."""

    def reset(self) -> None:
        """Forget everything, as before the first call."""

    def wrench(self, measurement: Measurement, setpoint: Setpoint, delivered: Array) -> Array:
        """Returns the wrench (6,) [N, N m] in the body frame.

        Args:
            measurement: the newest samples.
            setpoint: what to do.
            delivered: wrench (6,) that the fins have given since the last call, as far as known [N, N m].
        """
        ...


@runtime_checkable
class Foresighted(Protocol):
    """A controller that knows what its path will take."""

    def ahead(self, setpoints: Sequence[Setpoint]) -> Array:
        """Wrenches (K, 6) [N, N m] that will be asked for at K setpoints after the first, a period apart; the
        first is that of the last call of `wrench`."""
        ...


class Learner(Protocol):
    """Finds out on the way what a robot is; called at every tick."""

    factor: Array
    """By what commands to the robot as it was learned are multiplied for its drives (n, 3): a thruster's
    command is the force that it gives, and a weak one is asked for more."""

    def step(self, measured: Array, command: Array) -> Layout | None:
        """Returns the robot as it is now believed to be, where that has changed.

        Args:
            measured: position [m], roll, pitch, yaw [rad], velocity [m/s] and rates [rad/s] (12,).
            command: of the drives until the next call (n, 3), NaN for those at rest.
        """
        ...
