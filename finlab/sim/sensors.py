"""What the robot knows of itself: samples at each sensor's own rate, with noise."""

from dataclasses import dataclass, fields

import numpy as np

from finlab.arrays import Array
from finlab.control import Measurement
from finlab.physics.vehicle import euler


@dataclass(frozen=True)
class SensorSettings:
    """Rates and noise (standard deviations). No figures are published for U-CAT's sensors: these are our
    choice, of the order of data sheets of such instruments."""

    marker_rate_hz: float = 10.0
    """Of the camera that sees the markers [Hz]."""
    marker_position_m: float = 0.02
    """Of x and y, and of z, which controllers do not use [m]."""
    marker_yaw_rad: float = 0.02
    """Of the heading [rad]."""
    pressure_rate_hz: float = 20.0
    """Of the depth sensor [Hz]."""
    pressure_depth_m: float = 0.005
    """Of the depth [m]."""
    dvl_rate_hz: float = 5.0
    """Of the DVL [Hz]."""
    dvl_velocity_m_s: float = 0.01
    """Of each component of the velocity [m/s]."""
    imu_rate_hz: float = 50.0
    """Of the IMU [Hz]."""
    imu_rate_rad_s: float = 0.01
    """Of each angular rate [rad/s]."""
    imu_angle_rad: float = 0.01
    """Of roll and pitch [rad]."""


_NOISES = [field.name for field in fields(SensorSettings) if not field.name.endswith("_hz")]
NO_NOISE = SensorSettings(**dict.fromkeys(_NOISES, 0.0))
"""Perfect sensors at the usual rates."""


class Sensors:
    """Samples and holds."""

    def __init__(self, settings: SensorSettings, rng: np.random.Generator) -> None:
        self.settings = settings
        self._rng = rng
        self._due = {"marker": 0.0, "pressure": 0.0, "dvl": 0.0, "imu": 0.0}
        zeros = np.zeros(3)
        self._held = Measurement(0.0, zeros, 0.0, zeros, 0.0, zeros, 0.0, 0.0)

    def measure(self, time: float, state: Array) -> Measurement:
        """The newest samples at `time` [s] for a state (13,); to be called in order of time."""
        s, noise = self.settings, self._rng.standard_normal
        position, quaternion, velocity, rates = state[:3], state[3:7], state[7:10], state[10:13]
        held = self._held._replace(time=time)
        roll, pitch, yaw = (float(angle) for angle in euler(quaternion))
        if self._is_due("marker", s.marker_rate_hz, time):
            held = held._replace(
                position=position + s.marker_position_m * noise(3),
                yaw=yaw + s.marker_yaw_rad * float(noise()),
            )
        if self._is_due("pressure", s.pressure_rate_hz, time):
            held = held._replace(depth=float(-position[2]) + s.pressure_depth_m * float(noise()))
        if self._is_due("dvl", s.dvl_rate_hz, time):
            held = held._replace(velocity=velocity + s.dvl_velocity_m_s * noise(3))
        if self._is_due("imu", s.imu_rate_hz, time):
            angles = s.imu_angle_rad * noise(2)
            held = held._replace(
                rates=rates + s.imu_rate_rad_s * noise(3),
                roll=roll + float(angles[0]),
                pitch=pitch + float(angles[1]),
            )
        self._held = held
        return held

    def _is_due(self, name: str, rate_hz: float, time: float) -> bool:
        """Whether a sensor has a new sample, which is then taken."""
        if time < self._due[name] - 1e-9:
            return False
        self._due[name] = max(self._due[name] + 1.0 / rate_hz, time)
        return True
