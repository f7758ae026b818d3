"""The one interface of all controllers: what they are told, what they aim at, what they answer."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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


class Setpoint(NamedTuple):
    """What the robot should do now; a controller takes what it needs."""

    position: Array
    """Waypoint (3,) in the world [m]; x and y may be NaN where only depth counts."""
    surge: float
    """Speed along x [m/s]."""


class Controller(Protocol):
    """Turns measurements into a wrench; called at a fixed rate."""

    name: str
    """What it is called in logs and tables."""
    axes: tuple[str, ...]
    """Axes of the wrench that it commands; the others are to stay as near zero as the fins can hold them."""
    lead_s: float
    """How far ahead of now [s] the waypoint should be taken from a trajectory."""
    period_s: float
    """Time between calls [s]."""

    def reset(self) -> None:
        """Forget everything, as before the first call."""

    def wrench(self, measurement: Measurement, setpoint: Setpoint) -> Array:
        """Returns the wrench (6,) [N, N m] in the body frame."""
        ...
