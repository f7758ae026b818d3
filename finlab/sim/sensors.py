"""What the robot knows of itself: samples at each sensor's own rate, with noise, bias, delay and losses."""

import math
from collections import deque
from dataclasses import dataclass, fields, replace

import numpy as np

from finlab.arrays import Array
from finlab.control import Measurement
from finlab.errors import FinlabError


@dataclass(frozen=True)
class SensorSettings:
    """Rates, noise and bias (standard deviations), delays and losses. No figures are published for U-CAT's
    sensors: these are our choice, of the order of data sheets of such instruments.

    A bias is drawn once for a run and stays. A delay lies between a sample and its use; it counts in
    steps of the simulation, 0.01 or 0.02 s. A lost sample is not replaced: the one before goes on.

    Raises:
        FinlabError: a rate of none, a negative number, or a share of lost samples of 1 or more.
    """

    marker_rate_hz: float = 10.0
    """Of the camera that sees the markers [Hz]."""
    marker_position_m: float = 0.02
    """Noise of x and y, and of z, which controllers do not use [m]."""
    marker_position_bias_m: float = 0.01
    """Bias of each of them [m]; of a camera's calibration."""
    marker_yaw_rad: float = 0.02
    """Noise of the heading [rad]."""
    marker_yaw_bias_rad: float = 0.01
    """Its bias [rad]."""
    marker_delay_s: float = 0.08
    """How old a pose is when it arrives [s]: exposure, detection and transfer of a picture."""
    marker_dropout: float = 0.02
    """Share of poses that are lost, because no marker is seen."""
    pressure_rate_hz: float = 20.0
    """Of the depth sensor [Hz]."""
    pressure_depth_m: float = 0.005
    """Noise of the depth [m]."""
    pressure_depth_bias_m: float = 0.01
    """Its bias [m]; of the air's pressure, and of the sensor's place."""
    pressure_delay_s: float = 0.02
    """How old it is [s]."""
    pressure_dropout: float = 0.0
    """Share of samples that are lost."""
    dvl_rate_hz: float = 5.0
    """Of the DVL [Hz]."""
    dvl_velocity_m_s: float = 0.01
    """Noise of each component of the velocity [m/s]."""
    dvl_velocity_bias_m_s: float = 0.002
    """Bias of each [m/s]."""
    dvl_delay_s: float = 0.06
    """How old a velocity is [s]: the way of the sound, and averaging."""
    dvl_dropout: float = 0.02
    """Share of velocities that are lost, because the bottom is."""
    imu_rate_hz: float = 50.0
    """Of the IMU [Hz]."""
    imu_rate_rad_s: float = 0.01
    """Noise of each angular rate [rad/s]."""
    imu_rate_bias_rad_s: float = 0.001
    """Bias of each [rad/s]."""
    imu_angle_rad: float = 0.01
    """Noise of roll and pitch [rad]."""
    imu_angle_bias_rad: float = 0.01
    """Bias of each [rad]; of how the IMU is mounted."""
    imu_delay_s: float = 0.0
    """How old its samples are [s]."""
    imu_dropout: float = 0.0
    """Share of samples that are lost."""
    burst_s: float = 0.0
    """How long losses last on average [s]; at 0 each sample is lost by itself."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise FinlabError(f"sensors: {field.name}: expected a number from 0, got {value}")
            if field.name.endswith("_rate_hz") and value == 0.0:
                raise FinlabError(f"sensors: {field.name}: expected samples now and then, got {value} Hz")
            if field.name.endswith("_dropout") and value >= 1.0:
                raise FinlabError(f"sensors: {field.name}: expected a share below 1, got {value}")

    def later(self, seconds: float) -> "SensorSettings":
        """The same sensors, each so much later [s]."""
        return replace(self, **{name: getattr(self, name) + seconds for name in _of("_delay_s")})

    def losing(self, share: float, burst_s: float = 0.0) -> "SensorSettings":
        """The same sensors, each of which loses this share of its samples, in bursts of so long [s]."""
        return replace(self, burst_s=burst_s, **dict.fromkeys(_of("_dropout"), share))


def _of(ending: str) -> list[str]:
    return [field.name for field in fields(SensorSettings) if field.name.endswith(ending)]


_RATES = {name: getattr(SensorSettings, name) for name in _of("_rate_hz")}
NO_NOISE = SensorSettings(**{**{field.name: 0.0 for field in fields(SensorSettings)}, **_RATES})
"""Perfect sensors at the usual rates: no noise, bias, delay or losses."""
_BEYOND_NOISE = [field.name for field in fields(SensorSettings) if "_bias_" in field.name]
NOISE_ALONE = replace(
    SensorSettings(), **dict.fromkeys([*_BEYOND_NOISE, *_of("_delay_s"), *_of("_dropout")], 0.0)
)
"""The usual sensors with noise, but with no bias, delay or losses."""


class Channel:
    """One sensor: when it samples, what becomes of its samples."""

    def __init__(
        self,
        settings: SensorSettings,
        name: str,
        noise: list[float],
        bias: list[float],
        rng: np.random.Generator,
    ) -> None:
        """Takes the sensor's name in the settings, and the standard deviations of its values."""
        self._period: float = 1.0 / getattr(settings, f"{name}_rate_hz")
        self._delay: float = getattr(settings, f"{name}_delay_s")
        self._dropout: float = getattr(settings, f"{name}_dropout")
        # Losses as a chain of two states: how likely one begins and how likely it ends at a sample.
        self._ends = min(1.0 - self._dropout, self._period / max(settings.burst_s, 1e-9))
        self._begins = self._ends * self._dropout / (1.0 - self._dropout)
        self._lost = False
        # Another stream than the noise's, so that a run has the same noise with and without the rest.
        self._rng, self._fate, self._noise = rng, rng.spawn(1)[0], np.array(noise)
        self.bias: Array = np.array(bias) * self._fate.standard_normal(len(bias))
        """What each value is off for the whole run."""
        self._due = 0.0
        self._waiting: deque[tuple[float, Array]] = deque()
        self._first = True

    def is_due(self, time: float) -> bool:
        """Whether it samples now."""
        return time >= self._due - 1e-9

    def take(self, time: float, true: list[float]) -> None:
        """Sample what is true now."""
        self._due = max(self._due + self._period, time)
        sample = true + self.bias + self._noise * self._rng.standard_normal(len(true))
        if self._dropout:
            self._lost = self._fate.random() < (1.0 - self._ends if self._lost else self._begins)
        # The robot has waited at rest for its first samples.
        if self._first or not self._lost:
            self._waiting.append((time if self._first else time + self._delay, sample))
        self._first = False

    def arrived(self, time: float) -> Array | None:
        """The newest sample that has arrived since the last call, if there is one."""
        newest = None
        while self._waiting and self._waiting[0][0] <= time + 1e-9:
            newest = self._waiting.popleft()[1]
        return newest


class Sensors:
    """Samples and holds."""

    def __init__(self, settings: SensorSettings, rng: np.random.Generator) -> None:
        """Draws the biases of this run."""
        self.settings = s = settings
        self._marker = Channel(
            s,
            "marker",
            [s.marker_position_m] * 3 + [s.marker_yaw_rad],
            [s.marker_position_bias_m] * 3 + [s.marker_yaw_bias_rad],
            rng,
        )
        self._pressure = Channel(s, "pressure", [s.pressure_depth_m], [s.pressure_depth_bias_m], rng)
        self._dvl = Channel(s, "dvl", [s.dvl_velocity_m_s] * 3, [s.dvl_velocity_bias_m_s] * 3, rng)
        self._imu = Channel(
            s,
            "imu",
            [s.imu_angle_rad] * 2 + [s.imu_rate_rad_s] * 3,
            [s.imu_angle_bias_rad] * 2 + [s.imu_rate_bias_rad_s] * 3,
            rng,
        )
        zeros = np.zeros(3)
        self._held = Measurement(0.0, zeros, 0.0, zeros, 0.0, zeros, 0.0, 0.0)

    def measure(self, time: float, state: Array) -> Measurement:
        """The newest samples at `time` [s] for a state (13,); to be called in order of time."""
        self.sample(time, state)
        held = self._held._replace(time=time)
        if (pose := self._marker.arrived(time)) is not None:
            held = held._replace(position=pose[:3], yaw=float(pose[3]))
        if (depth := self._pressure.arrived(time)) is not None:
            held = held._replace(depth=float(depth[0]))
        if (velocity := self._dvl.arrived(time)) is not None:
            held = held._replace(velocity=velocity)
        if (turning := self._imu.arrived(time)) is not None:
            held = held._replace(rates=turning[2:], roll=float(turning[0]), pitch=float(turning[1]))
        self._held = held
        return held

    def sample(self, time: float, state: Array) -> None:
        """Let the sensors sample a state (13,) that nobody asks about yet."""
        x, y, z, qw, qx, qy, qz, *motion = state.tolist()
        if self._marker.is_due(time):
            yaw = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
            self._marker.take(time, [x, y, z, yaw])
        if self._pressure.is_due(time):
            self._pressure.take(time, [-z])
        if self._dvl.is_due(time):
            self._dvl.take(time, motion[:3])
        if self._imu.is_due(time):
            roll = math.atan2(2 * (qw * qx + qy * qz), 1 - 2 * (qx * qx + qy * qy))
            pitch = math.asin(min(max(2 * (qw * qy - qz * qx), -1.0), 1.0))
            self._imu.take(time, [roll, pitch, *motion[3:]])
