"""The paper's two body-frame controllers (its section III): waypoint, and speed with depth.

Both ask for surge, heave and yaw. The paper prints the laws and no gains; here these follow from the robot's
mass and damping and from how late its actuators are, so that the laws fit any robot.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from finlab.arrays import Array
from finlab.control.measurement import Controller, Measurement, Setpoint
from finlab.control.observer import AXES, MotionObserver
from finlab.control.tracking_controller import TrackingController, axes_of, gains_for
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.axes import wrapped

LEAD_S = 2.0
"""How far ahead on the path the waypoint runs [s]; surge that balances the damping over it leaves no lag."""
NEAR_M = 0.15
"""Within this distance of the waypoint the heading counts in proportion to it [m]."""
HEAVE, HEADING = 0.39, 0.66
"""Natural frequencies of the waypoint's loops over the bandwidth of velocities."""
SPEED, DEPTH, TURNING = 0.3, 0.25, 0.5
"""Poles of the speed's and the depth's loop, and the damping of yaw, over the bandwidth of velocities."""
CRUISE = 0.2
"""Speed at which the gains balance the damping [m/s]."""
FILTER_S = 0.3
"""Time constant of the filter of the DVL's speed [s]."""


class _BodyFrame:
    """What both share: a robot's axes, its model and the largest wrench."""

    name = "body frame"
    period_s = 0.1

    def __init__(self, layout: Layout) -> None:
        """Takes the robot as its designer knows it. Raises FinlabError: it dives by its pitch."""
        own, gains = axes_of(layout), gains_for(layout)
        if "Ty" in own:
            text = f"{layout.name!r:.60} dives by its pitch, which controller {self.name} does not command"
            raise FinlabError(f"controller: {text}; take tracking")
        self.layout = layout
        self.axes: tuple[str, ...] = tuple(axis for axis in ("Fx", "Fz", "Tz") if axis in own)
        self.free: tuple[str, ...] = () if "Fy" in own else ("Fy",)
        self.most = np.array(gains.max_wrench)
        """Largest wrench that is asked for (6,) [N, N m]."""
        self.pace = gains.velocity
        """Bandwidth of the robot's velocities [rad/s]."""
        self.observer = MotionObserver(layout, self.period_s)
        self.mass = self.observer.inertia[[0, 2, 3]]
        """Of surge, heave and yaw, with the water's [kg, kg m^2]."""
        model = self.observer.dynamics
        linear, quadratic = (np.array(part)[AXES][[0, 2, 3]] for part in (model.linear, model.quadratic))
        self.damping = linear + CRUISE * quadratic * [1.0, 0.0, 0.0]
        """Of surge, heave and yaw [N s/m, N m s]."""
        self.reset()

    def reset(self) -> None:
        """Forget all that was seen."""
        self.observer = MotionObserver(self.layout, self.period_s)

    def limited(self, surge: float, heave: float, yaw: float) -> Array:
        """The wrench (6,) of three components, each at most as large as the robot is asked for."""
        return np.array([surge, 0.0, heave, 0.0, 0.0, yaw]).clip(-self.most, self.most)


class WaypointController(_BodyFrame):
    """To a waypoint: Fx = k_x d max(0, cos e_psi), Fz = k_z dz, Tz = k_psi e_psi (section III-A), from the
    odometry that the sensors give. Climbing and yaw rate are damped in addition: fins answer too late for
    the water alone to do it. Where the waypoint moves it is taken `LEAD_S` ahead."""

    name = "waypoint"

    def __init__(self, layout: Layout) -> None:
        """Takes the robot as its designer knows it. Raises FinlabError: it dives by its pitch."""
        super().__init__(layout)
        heave, yaw = HEAVE * self.pace, HEADING * self.pace
        self.gains = np.array([self.damping[0] / LEAD_S, self.mass[1] * heave**2, self.mass[2] * yaw**2])
        """k_x, k_z [N/m] and k_psi [N m/rad]."""
        own = [self.gains[1] * LEAD_S, 1.4 * self.mass[2] * yaw] - self.damping[1:]
        self.damped = np.maximum(own, 0.0)
        """What is added to the water's damping of heave [N s/m] and yaw [N m s]."""

    def wrench(self, measurement: Measurement, setpoint: Setpoint, given: Array) -> Array:
        """Returns the wrench (6,) [N, N m] to the setpoint's waypoint; `given` is that of the actuators until
        now."""
        now = self.observer.step(measurement, given)
        away = setpoint.position + LEAD_S * setpoint.velocity - now.position
        far = math.hypot(away[0], away[1])
        turn = float(wrapped(math.atan2(away[1], away[0]) - now.yaw)) * min(far / NEAR_M, 1.0)
        surge, heave, yaw = self.gains * [far * max(0.0, math.cos(turn)), away[2], turn]
        climb, spin = self.damped * [now.world_velocity[2], now.yaw_rate]
        return self.limited(surge, heave - climb, yaw - spin)


@dataclass
class Pid:
    """A PID law whose integral stands still while its output is cut off."""

    gains: tuple[float, float, float]
    """Proportional, integral and derivative."""
    most: float
    """Largest output."""
    integral: float = field(default=0.0, init=False)
    """Integral of the error."""

    def step(self, error: float, slope: float, dt: float) -> float:
        """The output for an error that changes by `slope` a second, after `dt` [s]."""
        proportional, integral, derivative = self.gains
        total = self.integral + error * dt
        output = proportional * error + integral * total + derivative * slope
        if abs(output) <= self.most or output * error < 0.0:
            self.integral = total
        return min(max(output, -self.most), self.most)


class VelocityController(_BodyFrame):
    """To a speed and a depth (section III-B): a PID law on the DVL's filtered surge velocity, one on the
    depth by the pressure, a proportional law against the IMU's yaw rate. It holds the path's speed and depth,
    not its place or heading."""

    name = "velocity"

    def reset(self) -> None:
        """Forget all that was seen."""
        super().reset()
        (surge, heave, self._turning), (drag, sinking, _) = self.mass, self.damping
        w, d = SPEED * self.pace, DEPTH * self.pace
        self.speed = Pid((2.0 * surge * w - drag, surge * w**2, 0.0), float(self.most[0]))
        """Two poles at w."""
        gains = (3.0 * heave * d**2, heave * d**3, max(3.0 * heave * d - sinking, 0.0))
        self.depth = Pid(gains, float(self.most[2]))
        """Three poles at d; a negative depth error is one upwards."""
        self._seen: float | None = None

    def wrench(self, measurement: Measurement, setpoint: Setpoint, given: Array) -> Array:
        """Returns the wrench (6,) [N, N m] to the setpoint's speed and depth; `given` is not needed."""
        share, surge = 1.0 - math.exp(-self.period_s / FILTER_S), float(measurement.velocity[0])
        self._seen = surge if self._seen is None else self._seen + share * (surge - self._seen)
        rise = float(setpoint.position[2]) + measurement.depth
        heave = self.depth.step(rise, -float(measurement.velocity[2]), self.period_s)
        ahead = self.speed.step(setpoint.surge - self._seen, 0.0, self.period_s)
        return self.limited(ahead, heave, -TURNING * self.pace * self._turning * float(measurement.rates[2]))


CONTROLLERS: dict[str, type[TrackingController | WaypointController | VelocityController]] = {
    "tracking": TrackingController,
    "waypoint": WaypointController,
    "velocity": VelocityController,
}
"""Name -> what makes the controller for the robot that is believed in; the default first."""


def controller_of(name: str, layout: Layout) -> Controller:
    """A controller by its name. Raises FinlabError: there is none of that name, or not for this robot."""
    if name not in CONTROLLERS:
        raise FinlabError(f"controller: expected one of {', '.join(CONTROLLERS)}, got {name!r:.40}")
    return CONTROLLERS[name](layout)
