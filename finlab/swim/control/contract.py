"""Contract of controllers: measurements, setpoints, protocols, and the axes that are commanded or
left open.

A controller commands some axes of the wrench, holds others at zero, and may leave some free. Few
fins, or few that are left, may not be able to hold zeros: two fins have four forces to choose for
six axes. A target that asks for the impossible spoils what the controller wants, so the open axes
are set to what the fins give with it; and free axes to what they give with the least force.
"""

import math
from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from finlab.arrays import Array
from finlab.axes import mask_of
from finlab.layout import Layout
from finlab.layout.damage import Damage
from finlab.layout.effectiveness import layout_effectiveness

NO_WRENCH = np.zeros(6)
"""Wrench of actuators that have given nothing [N, N m]."""
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


LEVER_M = 0.25
"""Torques count as forces at this lever when open axes are traded against each other [m]; about
U-CAT's."""
RANK_TOLERANCE = 1e-6
"""Singular values below this share of the largest count as zero."""


class Completion:
    """Wanted axes to whole wrenches, for one layout with some fins lost. Linear in the wanted
    axes."""

    def __init__(
        self, layout: Layout, lost: Sequence[str], axes: Sequence[str], free: Sequence[str] = ()
    ) -> None:
        """Prepares for the actuators that work.

        Args:
            layout: the robot.
            lost: names of actuators that do not work.
            axes: names of the axes that are commanded, c below.
            free: names of those that may be anything; the others are held at 0, h below.

        Raises:
            LayoutError: an unknown name, or no actuator is left.
        """
        # Forces y with B_c y = w_c exactly, of which B_h y = 0 comes nearest: with the
        # pseudoinverse B_c^+ and a basis N of the null space of B_c,
        #     y = (B_c^+ - N (B_h N)^+ B_h B_c^+) w_c.
        scale = np.array([1.0, 1.0, 1.0, 1 / LEVER_M, 1 / LEVER_M, 1 / LEVER_M])
        B = layout_effectiveness(layout.without(lost) if lost else layout) * scale[:, None]
        chosen = mask_of(axes)
        B_c = B[chosen]
        B_h = B[~mask_of((*axes, *free))]
        U, singular_values, V_T = np.linalg.svd(B_c)
        largest = max(float(singular_values[0]), 1e-9)
        rank = int((singular_values > RANK_TOLERANCE * largest).sum())
        self.controllable = rank == len(B_c)
        """Whether the working actuators can give any small combination of the wanted axes."""
        B_c_inverse = V_T[:rank].T @ np.diag(1.0 / singular_values[:rank]) @ U[:, :rank].T
        N = V_T[rank:].T
        correction = N @ np.linalg.pinv(B_h @ N, rcond=RANK_TOLERANCE) @ B_h @ B_c_inverse
        scaled = B @ (B_c_inverse - correction) * scale[chosen] / scale[:, None]
        self.matrix = np.zeros((6, 6))
        """Wrench with the wanted axes filled in, to the whole wrench (6, 6)."""
        self.matrix[:, chosen] = np.where(np.abs(scaled) < 1e-9, 0.0, scaled)
        self._transposed = np.ascontiguousarray(self.matrix.T)

    def __call__(self, wrench: Array) -> Array:
        """Wrenches (..., 6) whose wanted axes are asked for, whole."""
        whole: Array = wrench @ self._transposed
        return whole


def axes_of(layout: Layout) -> tuple[str, ...]:
    """The axes that are commanded: surge, heave and yaw, and sway where that costs nothing. Fins
    that push sideways hardly push ahead: with them sway is headed against. A robot that lifts by
    rudders alone dives by its pitch, and one that does not lift at all is steered in the plane."""
    surge_heave_yaw = ("Fx", "Fz", "Tz")
    rudders = layout.flow_driven
    without_rudders = layout.without(rudders) if len(rudders) < layout.n else layout
    candidates: list[tuple[Layout, tuple[str, ...]]] = []
    if not layout.n_fins:
        candidates.append((without_rudders, ("Fx", "Fy", "Fz", "Tz")))
    candidates.append((without_rudders, surge_heave_yaw))
    if rudders:
        candidates.append((layout, ("Fx", "Ty", "Tz")))
    if not layout.n_fins:
        candidates.append((layout, ("Fx", "Fy", "Tz")))
    for robot, axes in candidates:
        if Completion(robot, (), axes).controllable:
            return axes
    return surge_heave_yaw


def steers(layout: Layout, lost: Sequence[str] = ()) -> bool:
    """Whether what works of a robot can give the axes that are commanded independently, in
    small."""
    return Completion(layout, lost, axes_of(layout)).controllable


def steerable_loss(layout: Layout, count: int, lost: Sequence[str] = ()) -> tuple[str, ...] | None:
    """Returns the names of the first actuators without which a robot can still be steered.

    Args:
        layout: the robot.
        count: how many besides the lost ones.
        lost: names of actuators that do not work anyway.

    Returns:
        Their names; None where there are no such.
    """
    working = [name for name in layout.names if name not in lost]
    if count >= len(working):
        return None
    for more_lost in combinations(working, count):
        if count == 0 or steers(layout, (*lost, *more_lost)):
            return more_lost
    return None
