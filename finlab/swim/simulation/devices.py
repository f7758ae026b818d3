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
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.effectiveness import body_force, own_effectiveness
from finlab.physics import plant_of
from finlab.swim.control import Measurement
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.attitude import tilt_of_quaternion
from finlab.swim.vehicle.fin_motion import FinMotion, FinSteps


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


NORMALS_AT_ONCE = 512
"""Normal random numbers that are drawn from a generator at once: one at a time costs more."""


class NormalNumbers:
    """Standard normal numbers, in the order in which a generator gives them."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Takes a generator, which nobody else draws from."""
        self._rng = rng
        self._drawn: list[float] = []
        self._used = 0

    def take(self, count: int) -> list[float]:
        """Returns the next numbers, few of them."""
        start = self._used
        end = start + count
        if end > len(self._drawn):
            more = self._rng.standard_normal(NORMALS_AT_ONCE).tolist()
            self._drawn = self._drawn[start:] + more
            start = 0
            end = count
        self._used = end
        return self._drawn[start:end]


class SensorChannel:
    """One sensor at work: samples at its rate, held until the next one arrives."""

    def __init__(
        self,
        sensor: Sensor,
        read: Callable[[list[float]], list[float]],
        rng: np.random.Generator,
        normals: NormalNumbers,
    ) -> None:
        """Makes a sensor at the beginning of a run.

        Args:
            sensor: the sensor.
            read: from a state (13) to the true values.
            rng: of the run; the bias and what is lost come from a stream of their own, so that a
                run has the same noise with and without these.
            normals: the numbers of that generator, which all sensors share.
        """
        self._read = read
        self._period = 1.0 / sensor.rate_hz
        self._delay_s = sensor.delay_s
        self._dropout = sensor.dropout
        self._normals = normals
        self._loss_rng = rng.spawn(1)[0]
        self._noise = sensor.noise
        self._size = len(sensor.noise)
        bias = np.array(sensor.bias) * self._loss_rng.standard_normal(len(sensor.bias))
        self._bias: list[float] = bias.tolist()  # what each value is off for the whole run
        self.next_time = 0.0
        """When it samples next [s]."""
        # When a sample arrives, when it was taken, of which state, and its noise.
        self._in_transit: deque[tuple[float, float, list[float], list[float]]] = deque()
        self._first = True
        self._newest: Array = bias
        self.taken = 0.0
        """When the newest sample that has arrived was taken [s]."""

    def take(self, time: float, state: list[float]) -> None:
        """Samples a state (13) at a time [s]; the list is kept, and must not change."""
        self.next_time = max(self.next_time + self._period, time)
        noise = self._normals.take(self._size)
        lost = self._dropout > 0.0 and self._loss_rng.random() < self._dropout
        # The robot has waited at rest for its first samples.
        if self._first:
            self._in_transit.append((time, time, state, noise))
            self._first = False
        elif not lost:
            self._in_transit.append((time + self._delay_s, time, state, noise))

    def value(self, time: float) -> Array:
        """The newest sample that has arrived; the same array as before where there is no new
        one."""
        in_transit = self._in_transit
        arrived = None
        while in_transit and in_transit[0][0] <= time + 1e-9:
            arrived = in_transit.popleft()
        if arrived is not None:
            _, self.taken, state, normals = arrived
            true = self._read(state)
            values = zip(true, self._bias, self._noise, normals, strict=True)
            self._newest = np.array([x + bias + std * normal for x, bias, std, normal in values])
        return self._newest


def _marker(state: list[float]) -> list[float]:
    """Position [m] and heading [rad] of a state (13)."""
    x, y, z, qw, qx, qy, qz, *_ = state
    return [x, y, z, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))]


def _pressure(state: list[float]) -> list[float]:
    """Depth [m] of a state (13)."""
    return [-state[2]]


def _dvl(state: list[float]) -> list[float]:
    """Velocity [m/s] of a state (13)."""
    return state[7:10]


def _imu(state: list[float]) -> list[float]:
    """Roll, pitch [rad] and angular rates [rad/s] of a state (13)."""
    return [*tilt_of_quaternion(*state[3:7]), *state[10:]]


READINGS: dict[str, Callable[[list[float]], list[float]]] = {
    "marker": _marker,
    "pressure": _pressure,
    "dvl": _dvl,
    "imu": _imu,
}
"""What each of `SENSORS` reads of a state (13)."""


class Sensors:
    """Samples and holds."""

    def __init__(self, settings: SensorSettings, rng: np.random.Generator) -> None:
        """Draws the biases of this run."""
        normals = NormalNumbers(rng)
        self._channels = [
            SensorChannel(getattr(settings, name), READINGS[name], rng, normals) for name in SENSORS
        ]

    def measure(self, time: float, state: list[float]) -> Measurement:
        """The newest samples at `time` [s] for a state (13); to be called in order of time."""
        self.sample(time, state)
        marker, pressure, dvl, imu = self._channels
        pose = marker.value(time)
        depth = pressure.value(time)
        velocity = dvl.value(time)
        turning = imu.value(time)
        roll, pitch = turning[:2].tolist()
        return Measurement(
            time=time,
            position=pose[:3],
            yaw=float(pose[3]),
            velocity=velocity,
            depth=float(depth[0]),
            rates=turning[2:],
            roll=roll,
            pitch=pitch,
            ages=(time - marker.taken, time - pressure.taken, time - dvl.taken, time - imu.taken),
        )

    def sample(self, time: float, state: list[float]) -> None:
        """Let the sensors sample a state (13) whose measurement is not needed yet."""
        for channel in self._channels:
            if time >= channel.next_time - 1e-9:
                channel.take(time, state)


STEP_S = 0.02
"""Longest step that resolves the forces [s]."""


class ActuatorSteps(NamedTuple):
    """How n actuators moved in K steps, whatever the water does meanwhile."""

    fins: FinSteps | None
    """What the fins did; None of a robot without."""
    others: Array
    """Commands (K, n - n_fins, 3) that the others followed, means over each step."""

    def at(self, k: int) -> "ActuatorSteps":
        """One of the steps."""
        step = slice(k, k + 1)
        fins = None if self.fins is None else FinSteps(*(values[step] for values in self.fins))
        return ActuatorSteps(fins, self.others[step])


FORCE = slice(0, 3)
"""Columns of what actuators give: forces in own frames [N]."""
INERTIAL_POWER = 3
"""Column of it: inertial power [W]; none of what is no fin."""
DRIVING_POWER = 4
"""Column of it: driving power [W]; of what is no fin that of its law."""
N_COLUMNS = 5
"""How many columns it has."""


class ActuatorForce:
    """The actuators of one layout, the true one."""

    step_s = STEP_S

    def __init__(self, layout: Layout, fins: FinMotion) -> None:
        """Takes the true robot and how its fins move."""
        self.motion = ActuatorMotion(layout, fins)
        self._beat = fins
        self._plant = plant_of(layout)
        self.feels_flow = self._plant.feels_flow
        """Whether what the actuators give depends on how the robot moves through the water, by
        their laws or by what they do to each other."""
        self._frames = layout.frames
        # The wrench (3 n, 6) of 1 N along each own axis of each actuator.
        self._effectiveness = own_effectiveness(layout).reshape(-1, 6)
        others = tuple(layout.actuators[i] for i in self.motion.other_indices)
        self._n_others = len(others)
        if len(self.motion.fin_indices):
            self._fins = plant_of(layout.fins_alone)
        self.laws_feel_flow = False
        """Whether their laws alone do."""
        if others:
            self._others = plant_of(replace(layout.with_actuators(others), interaction=None))
            self.laws_feel_flow = self._others.feels_flow

    def move(self, command: Array, dt: float, count: int) -> ActuatorSteps:
        """Follows a command (n, 3) over steps.

        Args:
            command: NaN rows are lost and give nothing.
            dt: length of a step [s].
            count: how many, K.
        """
        of_fins, of_others = self.motion.split(command)
        fins = self._beat.steps(of_fins, dt, count) if len(of_fins) else None
        if not len(of_others):
            return ActuatorSteps(fins, np.zeros((count, 0, 3)))
        values = self.motion.others.steps(of_others, dt, count)
        return ActuatorSteps(fins, 0.5 * (values[:-1] + values[1:]))

    def output(self, steps: ActuatorSteps, dt: float, share: Array, water: Array | None) -> Array:
        """Returns what the actuators give in steps that have just been taken (K, n, 5): see
        `FORCE`, `INERTIAL_POWER` and `DRIVING_POWER`.

        Args:
            steps: what `move` returned, or part of it in order.
            dt: length of a step [s].
            share: of its force that each actuator gives (n,).
            water: how the robot moves through the water (6,) [m/s, rad/s], body frame, where that
                matters; in one step.
        """
        motion = self.motion
        if steps.fins is None:
            return self._output_of_others(steps.others, share, water)
        if not self._n_others:
            return self._output_of_fins(steps.fins, dt, share)
        of_fins = self._output_of_fins(steps.fins, dt, share[motion.fin_indices])
        of_others = self._output_of_others(steps.others, share[motion.other_indices], water)
        output = np.empty((len(of_fins), len(share), N_COLUMNS))
        output[:, motion.fin_indices] = of_fins
        output[:, motion.other_indices] = of_others
        return output

    def _output_of_fins(self, steps: FinSteps, dt: float, share: Array) -> Array:
        """What the fins give (K, n_fins, 5)."""
        output = np.empty((*steps.beats.shape, N_COLUMNS))
        np.multiply(self.of_fins(steps, dt), share[:, None], out=output[..., FORCE])
        output[..., INERTIAL_POWER] = steps.inertial_power
        output[..., DRIVING_POWER] = steps.driving_power
        return output

    def _output_of_others(self, command: Array, share: Array, water: Array | None) -> Array:
        """What the actuators that are no fins give (K, n - n_fins, 5) by commands (K, n - n_fins,
        3); those that have stopped give and take nothing."""
        works = self.motion.others_work
        output = np.zeros((*command.shape[:-1], N_COLUMNS))
        force = self._others.force(command, flow=water)
        np.multiply(force, (share * works)[:, None], out=output[..., FORCE])
        power = self._others.power(command, flow=water)
        np.multiply(power, works, out=output[..., DRIVING_POWER])
        return output

    def wrench(self, force: Array, water: Array | None) -> Array:
        """Returns the wrenches (K, 6) [N, N m] of forces (K, n, 3) [N], with what the actuators do
        to each other; `water` as of `output`."""
        wrench: Array = force.reshape(len(force), -1) @ self._effectiveness
        if self._plant.interaction is None:
            return wrench
        return np.asarray(wrench + self._plant.offset(force, flow=water))

    def in_body(self, force: Array, delivered: Array) -> Array:
        """Returns forces in the body frame (n, 3) [N], with an equal share of what the actuators do
        to each other.

        Args:
            force: in own frames (n, 3) [N].
            delivered: the wrench (6,) of all [N, N m].
        """
        by_actuator = body_force(force, self._frames)
        if self._plant.interaction is None:
            return np.asarray(by_actuator)
        of_interaction = delivered[:3] - by_actuator.sum(axis=0)
        return np.asarray(by_actuator + of_interaction / len(force))

    def of_fins(self, steps: FinSteps, dt: float) -> Array:
        """Forces (K, n_fins, 3) of the fins in their own frames [N], means over steps of `dt`
        [s]."""
        # One that does not beat gives nothing, whatever its law.
        return np.asarray(self._fins.force(steps.mean_command) * steps.beats[..., None])
