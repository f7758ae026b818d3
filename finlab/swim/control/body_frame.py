"""The paper's two body-frame controllers: waypoints, and speed with depth by PID.

Y. Hamamatsu, M. Kruusmaa, A. Ristolainen, "Layout-independent actuation allocator for fin-actuated
marine robots", section 3, whose formulas stand in its text without numbers; each docstring names
its subsection. The paper prints no gains. Ours follow from the robot's model and from how late its
actuators are, by one rule for all robots.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import wrapped_angle
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.damage import NO_DAMAGE
from finlab.swim.control.completion import Completion, axes_of
from finlab.swim.control.contract import Controller, Measurement, Setpoint
from finlab.swim.control.observer import MotionObserver
from finlab.swim.control.tracking_controller import TrackingController, inverse_delay, max_wrench_of

POSITION_BANDWIDTH = 0.4
"""Of position and depth, times the delay."""
HEADING_BANDWIDTH = 0.75
"""Of the heading, times the delay."""
SPEED_BANDWIDTH = 0.6
"""Of the speed, times the delay."""
DAMPING_RATIO = 0.7
"""Damping ratio of position, depth and heading."""
CRUISE = 0.15
"""Speed at which the water's drag counts [m/s]; the middle one of the paper's."""
HEADING_RADIUS_M = 0.15
"""Within this distance of a waypoint the heading counts in proportion to it: above it there is
none."""
FILTER_S = 0.3
"""Time constant of the filters of the measured speed and of derivatives [s]."""


class GainModel(NamedTuple):
    """What the gains of a robot follow from; inertia and drag of surge, sway, heave and yaw."""

    inverse_delay: float
    """Of actuators and sensors [1/s]."""
    inertia: Array
    """(4,) [kg, kg m^2]."""
    drag: Array
    """Drag per speed at `CRUISE` (4,) [N s/m, N m s]."""
    max_wrench: Array
    """Largest wrench (6,) that is asked for [N, N m]."""

    @classmethod
    def of(cls, layout: Layout, period_s: float) -> "GainModel":
        """That of a robot under a controller with this period [s]."""
        observer = MotionObserver(layout, period_s)
        drag = observer.inertia * observer.deceleration(np.full(4, CRUISE)) / CRUISE
        return cls(inverse_delay(layout), observer.inertia, drag, max_wrench_of(layout))


class WaypointController:
    """Heads for a waypoint (section 3, "Trajectory tracking controller").

    Of the error (dx, dy, dz) and the wrapped yaw error e towards the waypoint, Fx = k_d hypot(dx,
    dy) max(0, cos e), Fz = k_z dz, Tz = k_psi e, here with damping of speed, climb and yaw rate
    (`damping`; zeros are the printed law). The waypoint runs `lead_s` ahead on the path; odometry
    is `MotionObserver`'s.

    Gains: surge and heave are damped oscillators of `POSITION_BANDWIDTH`, or quicker where the drag
    alone damps more, and the heading one of `HEADING_BANDWIDTH`. The lead makes up for damping and
    drag: no steady lag.
    """

    name = "waypoint"
    period_s = 0.1

    def __init__(self, layout: Layout) -> None:
        """Takes the robot; errors as `make_controller`."""
        self.layout = layout
        self.axes, self.free = _axes(layout, self.name)
        model = GainModel.of(layout, self.period_s)
        self.max_wrench = model.max_wrench
        """Largest wrench (6,) that is asked for [N, N m]."""
        # m x'' + d x' + k x = 0 with k = m omega^2 and d = 2 zeta omega m, drag included.
        omega = POSITION_BANDWIDTH * model.inverse_delay
        omega_yaw = HEADING_BANDWIDTH * model.inverse_delay
        self.lead_s = 2.0 * DAMPING_RATIO / omega
        """How far ahead of now the waypoint is [s]."""
        stiffness = np.maximum(model.inertia * omega**2, model.drag / self.lead_s)
        damping = stiffness * self.lead_s - model.drag
        inertia_yaw = float(model.inertia[3])
        self.gains = float(stiffness[0]), float(stiffness[2]), inertia_yaw * omega_yaw**2
        """k_d [N/m], k_z [N/m] and k_psi [N m/rad]."""
        damping_yaw = 2.0 * DAMPING_RATIO * omega_yaw * inertia_yaw - float(model.drag[3])
        self.damping = float(damping[0]), float(damping[2]), max(damping_yaw, 0.0)
        """Against the speed ahead [N s/m], the climb [N s/m] and the yaw rate [N m s/rad]."""
        self.reset()

    def reset(self) -> None:
        """Forget the pose."""
        self._observer = MotionObserver(self.layout, self.period_s)

    def wrench(self, measurement: Measurement, setpoint: Setpoint, delivered: Array) -> Array:
        """Returns the wrench (6,) towards the waypoint [N, N m].

        Args:
            measurement: of now.
            setpoint: of now.
            delivered: wrench (6,) of the actuators since the last call [N, N m].
        """
        estimate = self._observer.step(measurement, delivered)
        lead = setpoint.velocity * self.lead_s + setpoint.acceleration * (0.5 * self.lead_s**2)
        dx, dy, dz = (setpoint.position + lead - estimate.position).tolist()
        distance = math.hypot(dx, dy)
        yaw_error = wrapped_angle(math.atan2(dy, dx) - estimate.yaw)
        e = yaw_error * min(1.0, distance / HEADING_RADIUS_M)
        error = distance * max(0.0, math.cos(e)), dz, e
        rate = estimate.velocity[0], estimate.world_velocity[2], estimate.yaw_rate
        wrench = np.zeros(6)
        wrench[[0, 2, 5]] = np.multiply(self.gains, error) - np.multiply(self.damping, rate)
        return np.asarray(wrench.clip(-self.max_wrench, self.max_wrench))


@dataclass
class Pid:
    """A PID loop in discrete time with anti-windup: its integral is held while the force is
    saturated and the error would push further."""

    proportional: float
    """Force [N] per error."""
    integral: float
    """Force [N] per integral of the error over time [s]."""
    derivative: float
    """Force [N] per rate of the error [1/s], which is filtered."""
    max_force: float
    """Largest force [N]."""
    period_s: float = 0.1
    """Time between calls [s]."""

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the errors."""
        self.integral_force = 0.0
        """What the integral gives [N]."""
        self._rate = 0.0  # of the error, filtered
        self._error_before: float | None = None

    def step(self, error: float) -> float:
        """Takes an error and returns the force [N]."""
        rate = 0.0
        if self._error_before is not None:
            rate = (error - self._error_before) / self.period_s
        self._rate += filter_gain(self.period_s) * (rate - self._rate)
        self._error_before = error
        unbounded = self.proportional * error + self.integral_force + self.derivative * self._rate
        force = min(max(unbounded, -self.max_force), self.max_force)
        is_saturated = force != unbounded
        if not is_saturated or error * unbounded < 0.0:
            self.integral_force += self.integral * error * self.period_s
        return force


def filter_gain(period_s: float) -> float:
    """Share of a difference that a low-pass filter of `FILTER_S` closes in a period [s]."""
    return 1.0 - math.exp(-period_s / FILTER_S)


class VelocityController:
    """Keeps a speed and a depth (section 3, "Velocity controller").

    Fx by PID of the speed, DVL's after a low-pass filter; Fz by PID of the depth, from the
    pressure; Tz = -k_r r against the IMU's yaw rate; all within bounds. It takes speed and depth of
    the path, not its course: the robot goes where its nose points.

    Gains by poles: the speed is a damped oscillator of `SPEED_BANDWIDTH`, whose derivative gain
    adds a tenth of the mass; the depth one of `POSITION_BANDWIDTH` with a third pole, of its
    integral, at half of that.
    """

    name = "velocity"
    period_s = 0.1

    def __init__(self, layout: Layout) -> None:
        """Takes the robot; errors as `make_controller`."""
        self.axes, self.free = _axes(layout, self.name)
        model = GainModel.of(layout, self.period_s)
        inertia_surge, _, inertia_heave, inertia_yaw = model.inertia.tolist()
        drag_surge, _, drag_heave, _ = model.drag.tolist()
        # Speed: (m + k_D) u'' + (d + k_P) u' + k_I u = 0 with k_D = m / 10.
        omega = SPEED_BANDWIDTH * model.inverse_delay
        mass = 1.1 * inertia_surge
        self.surge = Pid(
            proportional=max(2.0 * DAMPING_RATIO * omega * mass - drag_surge, 0.0),
            integral=omega**2 * mass,
            derivative=0.1 * inertia_surge,
            max_force=float(model.max_wrench[0]),
            period_s=self.period_s,
        )
        # Depth: m (s^2 + a s + omega^2) (s + b) = m s^3 + (d + k_D) s^2 + k_P s + k_I.
        omega = POSITION_BANDWIDTH * model.inverse_delay
        a = 2.0 * DAMPING_RATIO * omega
        b = 0.5 * omega
        self.depth = Pid(
            proportional=inertia_heave * (omega**2 + a * b),
            integral=inertia_heave * omega**2 * b,
            derivative=max(inertia_heave * (a + b) - drag_heave, 0.0),
            max_force=float(model.max_wrench[2]),
            period_s=self.period_s,
        )
        self.yaw_damping = inertia_yaw * HEADING_BANDWIDTH * model.inverse_delay
        """k_r [N m s/rad]."""
        self.max_yaw = float(model.max_wrench[5])
        """Largest torque about z [N m]."""
        self.reset()

    def reset(self) -> None:
        """Forget speed and integrals."""
        self.surge.reset()
        self.depth.reset()
        self._speed: float | None = None

    def wrench(self, measurement: Measurement, setpoint: Setpoint, delivered: Array) -> Array:
        """Returns the wrench (6,) that keeps speed and depth [N, N m].

        Args:
            measurement: of now.
            setpoint: of now.
            delivered: not used: the integrals learn what is missing.
        """
        measured = float(measurement.velocity[0])
        before = measured if self._speed is None else self._speed
        self._speed = before + filter_gain(self.period_s) * (measured - before)
        wrench = np.zeros(6)
        wrench[0] = self.surge.step(setpoint.surge - self._speed)
        wrench[2] = self.depth.step(float(setpoint.position[2]) + measurement.depth)
        torque = -self.yaw_damping * float(measurement.rates[2])
        wrench[5] = min(max(torque, -self.max_yaw), self.max_yaw)
        return wrench


def _axes(layout: Layout, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Axes that are commanded, of surge, heave and yaw what the robot can give, and those that are
    free.

    Raises:
        FinlabError: it cannot surge and turn, or dives by its pitch alone.
    """
    able = axes_of(layout)
    axes = tuple(axis for axis in ("Fx", "Fz", "Tz") if axis in able)
    if "Ty" in able or not Completion(layout, NO_DAMAGE, axes).controllable:
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
