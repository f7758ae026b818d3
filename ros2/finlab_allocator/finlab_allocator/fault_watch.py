"""The fault monitor of `finlab.swim.control`, fed by what an IMU and a DVL send."""

import math

import numpy as np

from finlab.arrays import Array
from finlab.errors import CommandError
from finlab.layout import Damage, Layout
from finlab.swim.control import Diagnosis, FaultMonitor, Measurement
from finlab_allocator.frames import UNIT_TOLERANCE, StaticFrames, rotation_of

CERTAIN = 0.5
"""Probability of a fault from which on it is told of."""


class FaultWatch:
    """Believes of each actuator that it is whole, lost, weak or stuck, by how the robot moves."""

    def __init__(self, layout: Layout, frame: str, frames: StaticFrames) -> None:
        """Believes that all are whole.

        Args:
            layout: the robot; what its body does not say is U-CAT's.
            frame: the robot's frame.
            frames: static transforms, of the IMU's frame and others.
        """
        self._layout = layout
        self._frame = frame
        self._frames = frames
        self._monitor = FaultMonitor(layout)
        self.diagnosis: Diagnosis | None = None
        """What is believed; None before the first step."""
        self._attitude: tuple[float, float, float] | None = None  # roll, pitch, yaw
        self._rates = np.zeros(3)
        # The monitor takes a velocity for new where its numbers are others; NaN is none.
        self._velocity = np.full(3, np.nan)
        self._imu_at_s = -math.inf

    @property
    def period_s(self) -> float:
        """Time between steps [s]."""
        return self._monitor.period_s

    def on_imu(self, rates: Array, orientation: Array, frame: str, now_s: float) -> None:
        """Takes a sample of the IMU.

        Args:
            rates: angular velocity (3,) in the IMU's frame [rad/s].
            orientation: quaternion x, y, z, w (4,) of the IMU's frame in one with z up.
            frame: the IMU's frame; empty for that of the robot.
            now_s: now [s].

        Raises:
            CommandError: it holds no numbers or no orientation, or its frame is unknown.
        """
        length = float(np.linalg.norm(orientation))
        if not np.isfinite(rates).all() or not abs(length - 1.0) <= UNIT_TOLERANCE:
            raise CommandError(
                "imu: expected finite rates and an orientation, got "
                f"{rates.tolist()} and {orientation.tolist()}; a filter estimates orientations"
            )
        # Orientation of the robot: R_wb = R_wi R_bi^T.
        of_imu = self._frames.rotation(self._frame, frame or self._frame)
        rotation = rotation_of(orientation / length) @ of_imu.T
        roll = math.atan2(rotation[2, 1], rotation[2, 2])
        pitch = math.asin(max(-1.0, min(1.0, -rotation[2, 0])))
        yaw = math.atan2(rotation[1, 0], rotation[0, 0])
        self._attitude = (roll, pitch, yaw)
        self._rates = of_imu @ rates
        self._imu_at_s = now_s

    def on_velocity(self, twist: Array) -> None:
        """Takes a velocity of the robot in its own frame (6,) [m/s, rad/s]."""
        self._velocity = twist[:3].copy()

    def hears(self, now_s: float, most_s: float) -> bool:
        """Returns whether the IMU has sent something.

        Args:
            now_s: now [s].
            most_s: age up to which it counts [s].
        """
        return 0.0 <= now_s - self._imu_at_s <= most_s

    def tell(self, name: str, is_lost: bool) -> None:
        """Takes an actuator for lost, or for repaired, since somebody says so."""
        self.diagnosis = self._monitor.tell(name, 0.0 if is_lost else 1.0)

    def step(self, now_s: float, command: Array | None) -> Damage | None:
        """Looks at how the robot moves.

        Args:
            now_s: now [s].
            command: commands (n, 3) in force since the last step, NaN for lost actuators.

        Returns:
            What is broken; None before the IMU has sent something.
        """
        if self._attitude is None:
            return None
        roll, pitch, yaw = self._attitude
        measurement = Measurement(
            time=now_s,
            position=np.zeros(3),
            yaw=yaw,
            velocity=self._velocity,
            depth=0.0,
            rates=self._rates,
            roll=roll,
            pitch=pitch,
        )
        self.diagnosis = self._monitor.step(measurement, command)
        return self.diagnosis.damage

    def findings(self) -> list[str]:
        """Returns a phrase for each actuator that is taken for broken, with how likely it is."""
        if self.diagnosis is None:
            return []
        damage = self.diagnosis.damage
        probability = dict(zip(self._layout.names, self.diagnosis.probability, strict=True))
        words = {name: "lost" for name in damage.lost}
        words |= {name: f"at {100.0 * share:.0f} %" for name, share in damage.weak.items()}
        words |= {name: f"at {100.0 * share:.0f} %" for name, share in damage.torn.items()}
        words |= {name: f"stuck at {value:.3g}" for name, value in damage.stuck.items()}
        found = [f"{name} {what} ({probability[name]:.2f})" for name, what in words.items()]
        for name, value in probability.items():
            if name not in words and value >= CERTAIN:
                found.append(f"{name} in doubt ({value:.2f})")
        return found
