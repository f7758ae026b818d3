"""Devices of a robot that swims: sensors at work, and actuators that push in the water that meets
them.

Samples come at the own rate of each sensor, with noise, bias, delay and losses.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.physics import plant_of
from finlab.swim.control import Measurement
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.attitude import rotation_of_quaternion, tilt_of
from finlab.swim.vehicle.fin_motion import FinMotion, fin_power


@dataclass(frozen=True)
class Sensor:
    """When a sensor samples and what becomes of its samples. Noise and bias are standard
    deviations."""

    rate_hz: float
    """How often it samples [Hz]."""
    noise: tuple[float, ...]
    """Of each of its values."""
    bias: tuple[float, ...]
    """Of each of its values; drawn once for a run."""
    delay_s: float = 0.0
    """How old a sample is when it arrives [s]; it counts in steps of the simulation, 0.01 or 0.02
    s."""
    dropout: float = 0.0
    """Share of samples that are lost; the one before goes on."""

    def perfect(self) -> "Sensor":
        """The same at its rate, with no noise, bias, delay or losses."""
        none = (0.0,) * len(self.noise)
        return Sensor(self.rate_hz, none, none)


SENSORS = ("marker", "pressure", "dvl", "imu")
"""Sensors of a robot, fields of `SensorSettings`."""


@dataclass(frozen=True)
class SensorSettings:
    """The robot's sensors. No figures are published for U-CAT's: these are our choice, of the order
    of data sheets of such instruments. Raises FinlabError: a rate of none, a negative number, or a
    share of lost samples of 1 or more."""

    marker: Sensor = Sensor(10.0, (0.02,) * 4, (0.01,) * 4, 0.08, 0.02)
    """Camera that sees markers: x, y, z, which controllers do not use [m], heading [rad]."""
    pressure: Sensor = Sensor(20.0, (0.005,), (0.01,), 0.02)
    """Depth [m]; its bias is of the air's pressure and of the sensor's place."""
    dvl: Sensor = Sensor(5.0, (0.01,) * 3, (0.002,) * 3, 0.06, 0.02)
    """Velocity [m/s]; late by the way of the sound and by averaging."""
    imu: Sensor = Sensor(50.0, (0.01,) * 5, (0.01,) * 2 + (0.001,) * 3)
    """Roll, pitch [rad] and angular rates [rad/s]."""

    def __post_init__(self) -> None:
        for name in SENSORS:
            sensor: Sensor = getattr(self, name)
            values = (sensor.rate_hz, sensor.delay_s, sensor.dropout, *sensor.noise, *sensor.bias)
            from_0 = all(math.isfinite(value) and value >= 0.0 for value in values)
            if not from_0 or sensor.rate_hz == 0.0 or sensor.dropout >= 1.0:
                raise FinlabError(
                    f"sensors: {name}: expected numbers from 0, a rate above it and a dropout "
                    f"below 1, got {sensor}"
                )

    def each(self, change: Callable[[Sensor], Sensor]) -> "SensorSettings":
        """The same, each sensor changed."""
        return SensorSettings(*(change(getattr(self, name)) for name in SENSORS))

    def later(self, seconds: float) -> "SensorSettings":
        """The same sensors, each so much later [s]."""
        return self.each(lambda sensor: replace(sensor, delay_s=sensor.delay_s + seconds))


NO_NOISE = SensorSettings().each(Sensor.perfect)
"""Perfect sensors at the usual rates: no noise, bias, delay or losses."""
NOISE_ALONE = SensorSettings().each(lambda sensor: replace(sensor.perfect(), noise=sensor.noise))
"""The usual sensors with noise, but with no bias, delay or losses."""


class SensorChannel:
    """One sensor at work: samples at its rate, held until the next one arrives."""

    def __init__(self, sensor: Sensor, rng: np.random.Generator) -> None:
        """Takes the sensor, and where its noise comes from."""
        self._sensor = sensor
        self._period = 1.0 / sensor.rate_hz
        # Another stream than the noise's, so that a run has the same noise with and without the
        # rest.
        self._rng = rng
        self._loss_rng = rng.spawn(1)[0]
        self._noise = np.array(sensor.noise)
        self.bias: Array = np.array(sensor.bias) * self._loss_rng.standard_normal(len(sensor.bias))
        """What each value is off for the whole run."""
        self._next_time = 0.0
        # When a sample arrives, when it was taken, and its values.
        self._in_transit: deque[tuple[float, float, Array]] = deque()
        self._first = True
        self._newest = self.bias
        self.taken = 0.0
        """When the newest sample that has arrived was taken [s]."""

    def is_due(self, time: float) -> bool:
        """Whether it samples now."""
        return time >= self._next_time - 1e-9

    def take(self, time: float, true: list[float]) -> None:
        """Samples the true values at a time [s]."""
        self._next_time = max(self._next_time + self._period, time)
        sample = true + self.bias + self._noise * self._rng.standard_normal(len(true))
        lost = self._sensor.dropout > 0.0 and self._loss_rng.random() < self._sensor.dropout
        # The robot has waited at rest for its first samples.
        if self._first or not lost:
            self._in_transit.append(
                (time if self._first else time + self._sensor.delay_s, time, sample)
            )
        self._first = False

    def value(self, time: float) -> Array:
        """The newest sample that has arrived; the same array as before where there is no new
        one."""
        while self._in_transit and self._in_transit[0][0] <= time + 1e-9:
            _, self.taken, self._newest = self._in_transit.popleft()
        return self._newest


class Sensors:
    """Samples and holds."""

    def __init__(self, settings: SensorSettings, rng: np.random.Generator) -> None:
        """Draws the biases of this run."""
        self._channels = [SensorChannel(getattr(settings, name), rng) for name in SENSORS]

    def measure(self, time: float, state: Array) -> Measurement:
        """The newest samples at `time` [s] for a state (13,); to be called in order of time."""
        self.sample(time, state)
        pose, depth, velocity, turning = (channel.value(time) for channel in self._channels)
        marker, pressure, dvl, imu = (time - channel.taken for channel in self._channels)
        roll, pitch = turning[:2].tolist()
        ages = marker, pressure, dvl, imu
        return Measurement(
            time,
            pose[:3],
            float(pose[3]),
            velocity,
            float(depth[0]),
            turning[2:],
            roll,
            pitch,
            ages,
        )

    def sample(self, time: float, state: Array) -> None:
        """Let the sensors sample a state (13,) whose measurement is not needed yet."""
        x, y, z, qw, qx, qy, qz, *motion = state.tolist()
        marker, pressure, dvl, imu = self._channels
        if marker.is_due(time):
            yaw = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
            marker.take(time, [x, y, z, yaw])
        if pressure.is_due(time):
            pressure.take(time, [-z])
        if dvl.is_due(time):
            dvl.take(time, motion[:3])
        if imu.is_due(time):
            imu.take(time, [*tilt_of(rotation_of_quaternion(qw, qx, qy, qz)), *motion[3:]])


STEP_S = 0.02
"""Longest step that resolves the forces [s]."""


class ActuatorOutput(NamedTuple):
    """What n actuators do in a step."""

    force: Array
    """Forces (n, 3) in own frames [N]."""
    power: Array
    """Inertial and driving power (2, n) [W]; of what is no fin, none and that of its law."""


class ActuatorForce:
    """The actuators of one layout, the true one."""

    step_s = STEP_S

    def __init__(self, layout: Layout, fins: FinMotion) -> None:
        """Takes the true robot and how its fins move."""
        self.motion = ActuatorMotion(layout, fins)
        self._beat = fins
        of_fins = self.motion.fin_indices
        of_others = self.motion.other_indices
        self._plant = plant_of(layout)
        self.effectiveness = own_effectiveness(layout)
        """Wrench (n, 3, 6) of 1 N along each own axis, about the true centre of gravity."""
        if len(of_fins):
            self._fins = plant_of(layout.fins_alone)
        if len(of_others):
            others = tuple(layout.actuators[i] for i in of_others)
            self._others = plant_of(replace(layout, actuators=others))

    def step(self, command: Array, dt: float, water: Array, share: Array) -> ActuatorOutput:
        """Follows a command (n, 3) for `dt` [s].

        Args:
            command: NaN rows are lost and give nothing.
            dt: length of the step [s].
            water: how the robot moves through the water (6,) [m/s, rad/s], body frame.
            share: of its force that each actuator gives (n,).
        """
        motion = self.motion
        motion.step(command, dt)
        fins = np.zeros((0, 3))
        fin_watts = np.zeros((2, 0))
        others = np.zeros((0, 3))
        watts = np.zeros((2, 0))
        if len(motion.fin_indices):
            fins = self.of_fins(dt) * share[motion.fin_indices, None]
            fin_watts = np.array(fin_power(*self._beat.speed_and_acceleration(), self._fins.blade))
        if len(motion.other_indices):
            mean = 0.5 * (motion.others.value_before + motion.others.value)
            works = share[motion.other_indices] * motion.pushes[motion.other_indices]
            others = self._others.force(mean, flow=water) * works[:, None]
            spent = self._others.power(mean, flow=water) * motion.pushes[motion.other_indices]
            watts = np.array([0.0 * spent, spent])
        return ActuatorOutput(motion.joined(fins, others), motion.joined(fin_watts.T, watts.T).T)

    def wrenches(self, force: Array, water: Array) -> Array:
        """Returns the wrench (n, 6) [N, N m] of each actuator's force (n, 3) [N], with an equal
        share of what they do to each other; `water` as in `step`."""
        offset = self._plant.offset(force, flow=water) / len(force)
        return np.asarray(np.einsum("nk,nkw->nw", force, self.effectiveness) + offset)

    def of_fins(self, dt: float) -> Array:
        """Force (n, 3) of each fin in its own frame [N], the mean over the step `dt` [s] that has
        just been taken."""
        command = self._beat.mean_command
        command[:, 2] = wrapped(command[:, 2])
        # One that does not beat gives nothing, whatever its law.
        beats = (command[:, 0] > 0.0) & (command[:, 1] > 0.0)
        return self._fins.force(command) * beats[:, None]
