"""The paper's two body-frame controllers: waypoints, and speed with depth by PID.

Y. Hamamatsu, M. Kruusmaa, A. Ristolainen, "Layout-independent actuation allocator for fin-actuated
marine robots", section 3, whose formulas stand in its text without numbers; each docstring names
its subsection. The paper prints no gains. Ours follow from the robot's model and from how late its
actuators are, by one rule for all robots.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.swim.control.contract import Completion, Controller, Measurement, Setpoint, axes_of
from finlab.swim.control.observer import MotionObserver
from finlab.swim.control.tracking_controller import TrackingController, most_of, pace_of

SLOW, TURN, SPEED = 0.4, 0.75, 0.6
"""Bandwidths of position and depth, of the heading and of the speed, times the delay."""
DAMPING = 0.7
"""Damping ratio of position, depth and heading."""
CRUISE = 0.15
"""Speed at which the water's drag counts [m/s]; the middle one of the paper's."""
NEAR_M = 0.15
"""Within this distance of a waypoint the heading counts in proportion to it: above it there is
none."""
FILTER_S = 0.3
"""Time constant of the filters of the measured speed and of derivatives [s]."""


def _model(layout: Layout, period_s: float) -> tuple[float, Array, Array, Array]:
    """Inverse of the delay of actuators and sensors [1/s]; of surge, sway, heave and yaw the
    inertia (4,), the drag per speed at `CRUISE` (4,), and the largest wrench (6,) that is asked
    for."""
    observer = MotionObserver(layout, period_s)
    drag = observer.inertia * observer.slowed_by(np.full(4, CRUISE)) / CRUISE
    return pace_of(layout), observer.inertia, drag, most_of(layout)


class WaypointController:
    """Heads for a waypoint (section 3, "Trajectory tracking controller").

    Of the error (dx, dy, dz) and the wrapped yaw error e towards the waypoint, Fx = k_d hypot(dx,
    dy) max(0, cos e), Fz = k_z dz, Tz = k_psi e, here with damping of speed, climb and yaw rate
    (`damping`; zeros are the printed law). The waypoint runs `lead_s` ahead on the path; odometry
    is `MotionObserver`'s.

    Gains: surge and heave are damped oscillators of `SLOW`, or quicker where the drag alone damps
    more, and the heading one of `TURN`. The lead makes up for damping and drag: no steady lag.
    """

    name = "waypoint"
    period_s = 0.1

    def __init__(self, layout: Layout) -> None:
        """Takes the robot; errors as `make_controller`."""
        self.layout = layout
        self.axes, self.free = _axes(layout, self.name)
        pace, inertia, drag, self.most = _model(layout, self.period_s)
        slow = SLOW * pace
        turn = TURN * pace
        self.lead_s = 2.0 * DAMPING / slow
        """How far ahead of now the waypoint is [s]."""
        spring = np.maximum(inertia * slow**2, drag / self.lead_s)
        damping = spring * self.lead_s - drag
        self.gains = float(spring[0]), float(spring[2]), float(inertia[3]) * turn**2
        """k_d [N/m], k_z [N/m] and k_psi [N m/rad]."""
        yaw = max(2.0 * DAMPING * turn * float(inertia[3]) - float(drag[3]), 0.0)
        self.damping = float(damping[0]), float(damping[2]), yaw
        """Against the speed ahead [N s/m], the climb [N s/m] and the yaw rate [N m s/rad]."""
        self.reset()

    def reset(self) -> None:
        """Forget the pose."""
        self._observer = MotionObserver(self.layout, self.period_s)

    def wrench(self, measurement: Measurement, setpoint: Setpoint, delivered: Array) -> Array:
        """Returns the wrench (6,) towards the waypoint [N, N m]; `delivered` is that of the fins so
        far."""
        now = self._observer.step(measurement, delivered)
        ahead = setpoint.velocity * self.lead_s + setpoint.acceleration * (0.5 * self.lead_s**2)
        dx, dy, dz = (setpoint.position + ahead - now.position).tolist()
        distance = math.hypot(dx, dy)
        e = float(wrapped(math.atan2(dy, dx) - now.yaw)) * min(1.0, distance / NEAR_M)
        toward = distance * max(0.0, math.cos(e)), dz, e
        motion = now.velocity[0], now.world_velocity[2], now.yaw_rate
        wrench = np.zeros(6)
        wrench[[0, 2, 5]] = np.multiply(self.gains, toward) - np.multiply(self.damping, motion)
        return np.asarray(wrench.clip(-self.most, self.most))


@dataclass
class Pid:
    """A PID loop in discrete time that does not wind up: its integral rests while the force is
    bounded and the error would push further."""

    proportional: float
    """Force [N] per error."""
    integral: float
    """Per integral of the error over time [s]."""
    derivative: float
    """Per rate of the error, which is filtered."""
    most: float
    """Largest force [N]."""
    period_s: float = 0.1
    """Time between calls [s]."""

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the errors."""
        self.summed, self._rate = 0.0, 0.0
        """What the integral gives [N], and the filtered rate."""
        self._last: float | None = None

    def step(self, error: float) -> float:
        """Takes an error and returns the force [N]."""
        rate = 0.0 if self._last is None else (error - self._last) / self.period_s
        self._rate += filter_share(self.period_s) * (rate - self._rate)
        self._last = error
        wanted = self.proportional * error + self.summed + self.derivative * self._rate
        force = min(max(wanted, -self.most), self.most)
        if force == wanted or error * wanted < 0.0:
            self.summed += self.integral * error * self.period_s
        return force


def filter_share(period_s: float) -> float:
    """Share of a difference that a filter of `FILTER_S` closes in a period [s]."""
    return 1.0 - math.exp(-period_s / FILTER_S)


class VelocityController:
    """Keeps a speed and a depth (section 3, "Velocity controller").

    Fx by PID of the speed, DVL's after a low-pass filter; Fz by PID of the depth, from the
    pressure; Tz = -k_r r against the IMU's yaw rate; all within bounds. It takes speed and depth of
    the path, not its course: the robot goes where its nose points.

    Gains by poles: the speed is a damped oscillator of `SPEED`, whose derivative gain adds a tenth
    of the mass; the depth one of `SLOW` with a third pole, of its integral, at half of that.
    """

    name = "velocity"
    period_s = 0.1

    def __init__(self, layout: Layout) -> None:
        """Takes the robot; errors as `make_controller`."""
        self.axes, self.free = _axes(layout, self.name)
        pace, inertia, drag, most = _model(layout, self.period_s)
        slow = SLOW * pace
        fast = SPEED * pace
        mass = 1.1 * float(inertia[0])
        heavy = float(inertia[2])
        damped = max(2.0 * DAMPING * fast * mass - float(drag[0]), 0.0)
        self.surge = Pid(
            damped, fast**2 * mass, 0.1 * float(inertia[0]), float(most[0]), self.period_s
        )
        a = 2.0 * DAMPING * slow
        b = 0.5 * slow
        damped = max(heavy * (a + b) - float(drag[2]), 0.0)
        spring = heavy * (slow**2 + a * b)
        self.depth = Pid(spring, heavy * slow**2 * b, damped, float(most[2]), self.period_s)
        self.yaw_damping, self.max_yaw = float(inertia[3]) * TURN * pace, float(most[5])
        """k_r [N m s/rad], and the largest torque about z [N m]."""
        self.reset()

    def reset(self) -> None:
        """Forget speed and integrals."""
        self.surge.reset()
        self.depth.reset()
        self._speed: float | None = None

    def wrench(self, measurement: Measurement, setpoint: Setpoint, delivered: Array) -> Array:
        """Returns the wrench (6,) that keeps speed and depth [N, N m]."""
        seen = float(measurement.velocity[0])
        before = seen if self._speed is None else self._speed
        self._speed = before + filter_share(self.period_s) * (seen - before)
        wrench = np.zeros(6)
        wrench[0] = self.surge.step(setpoint.surge - self._speed)
        wrench[2] = self.depth.step(float(setpoint.position[2]) + measurement.depth)
        wrench[5] = min(
            max(-self.yaw_damping * float(measurement.rates[2]), -self.max_yaw), self.max_yaw
        )
        return wrench


def _axes(layout: Layout, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Axes that are commanded, of surge, heave and yaw what the robot can give, and those that are
    free.

    Raises:
        FinlabError: it cannot surge and turn, or dives by its pitch alone.
    """
    able = axes_of(layout)
    axes = tuple(axis for axis in ("Fx", "Fz", "Tz") if axis in able)
    if "Ty" in able or not Completion(layout, (), axes).controllable:
        raise FinlabError(
            f"controller: {name} commands Fx, Fz and Tz, which {layout.name!r:.60} cannot give "
            "independently; take tracking"
        )
    return axes, () if "Fy" in able else ("Fy",)


CONTROLLERS: dict[str, Callable[[Layout], Controller]] = {
    "tracking": TrackingController,
    "waypoint": WaypointController,
    "velocity": VelocityController,
}
"""Name -> what makes the controller of a robot; the default first."""


def make_controller(name: str, layout: Layout) -> Controller:
    """The controller of that name for a robot.

    Raises:
        FinlabError: no such controller, or the robot cannot give the axes that it commands.
    """
    if name not in CONTROLLERS:
        raise FinlabError(f"controller: expected one of {', '.join(CONTROLLERS)}, got {name!r:.60}")
    return CONTROLLERS[name](layout)
