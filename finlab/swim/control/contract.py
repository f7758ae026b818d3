"""Contract of controllers: measurements, setpoints, protocols, and what weak actuators are told.

A controller commands some axes of the wrench, holds others at zero, and may leave some free
(`completion.py`).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.damage import Damage

NO_WRENCH = np.zeros(6)
"""Wrench of actuators that have given nothing [N, N m]."""
LEVER_M = 0.25
"""Torques count as forces at this lever when open axes are traded against each other [m]; about
U-CAT's."""
NOT_MEASURED = np.full(3, math.nan)
"""Of a sensor that is not there."""


class DriveTelemetry(NamedTuple):
    """The newest samples of n drives, as ESCs send them; NaN where there is none."""

    speed: Array
    """Speeds (n,), positive as commands of a force are, in a unit that all have in common."""
    current: Array
    """Currents (n,) [A]."""
    ages: Array
    """How old each is (n,) [s]."""
    is_signed: bool = True
    """Whether the sign of the speed says which way a drive turns; few ESCs know."""


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
    acceleration: Array = NOT_MEASURED
    """Specific force (3,) in the body frame [m/s^2] as accelerometers show it, (0, 0, 9.81) at
    rest: the mean of all samples of the IMU since the measurement before; NaN where there is
    none."""
    drives: DriveTelemetry | None = None
    """What the drives say of themselves; None where they say nothing."""

    def as_array(self) -> Array:
        """Position, roll, pitch, yaw, velocity and rates side by side (12,), as a log keeps
        them."""
        x, y, _ = self.position.tolist()
        pose = (x, y, -self.depth, self.roll, self.pitch, self.yaw)
        return np.array([*pose, *self.velocity.tolist(), *self.rates.tolist()])


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
    """Heading [rad] in which the path goes on from here, where it rests, too; NaN where it goes
    nowhere."""


class Controller(Protocol):
    """Turns measurements into a wrench; called at a fixed rate."""

    name: str
    axes: tuple[str, ...]
    """Axes of the wrench that it commands; the others are to stay as near zero as the fins can hold
    them, but for the free ones."""
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
            delivered: wrench (6,) that the fins have given since the last call, as far as known [N,
            N m].
        """
        ...


@runtime_checkable
class Foresighted(Protocol):
    """A controller that knows what its path will take."""

    def ahead(self, setpoints: Sequence[Setpoint]) -> Array:
        """Wrenches (K, 6) [N, N m] that will be asked for at K setpoints after the first, a period
        apart; the first is that of the last call of `wrench`."""
        ...


class Learner(Protocol):
    """Finds out on the way what a robot is; called at every tick."""

    factor: Array
    """By what commands to the robot as it was learned are multiplied for its drives (n, 3): a
    thruster's command is the force that it gives, and a weak one is asked for more."""

    def step(self, measured: Array, command: Array) -> Layout | None:
        """Returns the robot as it is now believed to be, where that has changed.

        Args:
            measured: position [m], roll, pitch, yaw [rad], velocity [m/s] and rates [rad/s] (12,).
            command: of the drives until the next call (n, 3), NaN for those at rest.
        """
        ...


def asked_of_weak(layout: Layout, damage: Damage, command: Array) -> Array:
    """Returns what drives are told for a command (n, 3): weak thrusters are asked for more than
    they are to give.

    Args:
        layout: the robot.
        damage: its damage; a fin that is torn has a smaller law instead.
        command: of the allocator, forces that the actuators are to give.
    """
    if not damage.weak:
        return command
    result = command.copy()
    for name, share in damage.weak.items():
        index = layout.index(name)
        result[index, layout.actuators[index].KIND.force_number or 0] /= share
    return result
