"""The fault monitor of `finlab.swim.control`, fed by what an IMU, a DVL, a pressure sensor and the
drives send.

All times are by the node's clock that is never set. A sample is as old as its stamp says: the
monitor's time is that of the newest sample of the IMU, and each sample is taken once.
"""

import math
from collections import deque

import numpy as np

from finlab.arrays import Array
from finlab.errors import CommandError
from finlab.layout import Damage, Layout
from finlab.swim.control import Diagnosis, DriveTelemetry, FaultMonitor, Finding, Measurement
from finlab.swim.vehicle import GRAVITY
from finlab_allocator.frames import UNIT_TOLERANCE, StaticFrames, rotation_of
from finlab_allocator.input_checks import DriveSample, ImuSample
from finlab_allocator.parameters import Parameters

SUSPECTED = 0.5
"""Probability of a fault from which on an actuator that is not named yet is told of."""
WATER_DENSITY = 1000.0
"""Of the water, by which pressures are depths [kg/m^3]."""
NEVER_S = 1e9
"""Age of a sample that never came [s]."""
COMMANDS_KEPT = 1000
"""How many commands are kept for the monitor, where no sample of the IMU comes."""


class FaultWatch:
    """Believes of each actuator that it is whole, lost, weak, reversed or stuck, by how the robot
    moves."""

    def __init__(self, layout: Layout, parameters: Parameters, frames: StaticFrames) -> None:
        """Believes that all are whole.

        Args:
            layout: the robot; what its body does not say is U-CAT's.
            parameters: of the node: its frame, its period, and what is heard.
            frames: static transforms, of the IMU's frame and others.
        """
        self._layout = layout
        self._frame = parameters.frame
        self._frames = frames
        self._parameters = parameters
        self._monitor = FaultMonitor(layout, period_s=parameters.period_s)
        self.diagnosis: Diagnosis | None = None
        """What is believed; None before the first step."""
        self._told: set[str] = set()
        self._attitude: tuple[float, float, float] | None = None  # roll, pitch, yaw
        self._rates = np.zeros(3)
        # The monitor takes a velocity for new where its numbers are others; NaN is none.
        self._velocity = np.full(3, np.nan)
        self._velocity_at_s = -math.inf
        self._force_sum = np.zeros(3)  # of specific forces since the last step
        self._force_count = 0
        self._depth = math.nan
        self._depth_at_s = -math.inf
        self._drive_speed = np.full(layout.n, np.nan)
        self._drive_current = np.full(layout.n, np.nan)
        self._drives_at_s = np.full(layout.n, -NEVER_S)
        self._imu_at_s = -math.inf
        self._stepped_at_s = -math.inf
        self._commands: deque[tuple[float, Array]] = deque(maxlen=COMMANDS_KEPT)
        self._now_s = 0.0

    @property
    def period_s(self) -> float:
        """Time between steps [s]."""
        return FaultMonitor.period_s

    def on_imu(self, sample: ImuSample, taken_s: float) -> None:
        """Takes a sample of the IMU.

        Args:
            sample: as it came.
            taken_s: when it was taken [s].

        Raises:
            CommandError: it holds no numbers or no orientation, or its frame is unknown.
        """
        rates = sample.rates
        orientation = sample.orientation
        length = float(np.linalg.norm(orientation))
        if not np.isfinite(rates).all() or not abs(length - 1.0) <= UNIT_TOLERANCE:
            raise CommandError(
                "imu: expected finite rates and an orientation, got "
                f"{rates.tolist()} and {orientation.tolist()}; a filter estimates orientations"
            )
        # Orientation of the robot: R_wb = R_wi R_bi^T.
        of_imu = self._frames.rotation(self._frame, sample.frame or self._frame)
        rotation = rotation_of(orientation / length) @ of_imu.T
        roll = math.atan2(rotation[2, 1], rotation[2, 2])
        pitch = math.asin(max(-1.0, min(1.0, -rotation[2, 0])))
        yaw = math.atan2(rotation[1, 0], rotation[0, 0])
        self._attitude = (roll, pitch, yaw)
        self._rates = of_imu @ rates
        self._imu_at_s = taken_s
        if self._parameters.accelerometer and np.isfinite(sample.acceleration).all():
            place = self._frames.origin(self._frame, sample.frame or self._frame)
            self._monitor.accelerometer_place = place
            self._force_sum += of_imu @ sample.acceleration
            self._force_count += 1

    def on_pressure(self, pressure_pa: float, taken_s: float) -> None:
        """Takes a pressure of the water.

        Args:
            pressure_pa: [Pa]; of the air or not.
            taken_s: when it was measured [s].

        Raises:
            CommandError: it is no finite number.
        """
        if not math.isfinite(pressure_pa):
            raise CommandError(f"pressure: expected a finite number of Pa, got {pressure_pa}")
        self._depth = pressure_pa / (WATER_DENSITY * GRAVITY)
        self._depth_at_s = taken_s

    def on_drives(self, sample: DriveSample, taken_s: float) -> None:
        """Takes what drives say of themselves.

        Args:
            sample: as it came.
            taken_s: when it was taken [s].

        Raises:
            CommandError: it names no actuator of the robot.
        """
        for name, speed, current in zip(
            sample.names, sample.speed.tolist(), sample.current.tolist(), strict=True
        ):
            if name not in self._layout.names:
                known = ", ".join(self._layout.names)
                raise CommandError(
                    f"drives: no actuator {name!r:.60}, expected names of {known:.200}"
                )
            k = self._layout.index(name)
            self._drive_speed[k] = speed
            self._drive_current[k] = current
            self._drives_at_s[k] = taken_s

    def _telemetry(self, taken_s: float) -> DriveTelemetry | None:
        """The newest samples of the drives at a time [s]; None where they are not heard."""
        if self._parameters.drives == "off":
            return None
        ages = np.maximum(taken_s - self._drives_at_s, 0.0)
        is_signed = self._parameters.drives == "signed"
        return DriveTelemetry(self._drive_speed, self._drive_current, ages, is_signed)

    def _specific_force(self) -> Array:
        """The mean specific force (3,) since the last step [m/s^2]; NaN without a sample."""
        if not self._force_count:
            return np.full(3, np.nan)
        mean = self._force_sum / self._force_count
        self._force_sum = np.zeros(3)
        self._force_count = 0
        return np.asarray(mean)

    def on_velocity(self, twist: Array, taken_s: float) -> None:
        """Takes a velocity of the robot in its own frame.

        Args:
            twist: (6,) [m/s, rad/s].
            taken_s: when it was measured [s].
        """
        self._velocity = twist[:3].copy()
        self._velocity_at_s = taken_s

    def on_command(self, command: Array, now_s: float) -> None:
        """Takes a command that goes to the drives.

        Args:
            command: (n, 3), NaN for lost actuators.
            now_s: now [s].
        """
        self._commands.append((now_s, command))

    def hears(self, now_s: float, most_s: float) -> bool:
        """Returns whether the IMU has sent something.

        Args:
            now_s: now [s].
            most_s: age up to which it counts [s].
        """
        self._now_s = now_s
        return 0.0 <= now_s - self._imu_at_s <= most_s

    def tell(self, name: str, is_lost: bool) -> None:
        """Takes an actuator for lost, or for repaired, since somebody says so."""
        if is_lost:
            self._told.add(name)
        else:
            self._told.discard(name)
        self.diagnosis = self._monitor.tell(name, 0.0 if is_lost else 1.0)

    def step(self) -> Damage | None:
        """Looks at how the robot moves.

        Returns:
            What is broken; None where the IMU has sent nothing since the last step.
        """
        taken_s = self._imu_at_s
        if self._attitude is None or taken_s == self._stepped_at_s:
            return None
        roll, pitch, yaw = self._attitude
        # Negative where the velocity is newer than the sample of the IMU.
        age_of_velocity_s = taken_s - self._velocity_at_s
        measurement = Measurement(
            time=taken_s,
            position=np.zeros(3),
            yaw=yaw,
            velocity=self._velocity,
            depth=self._depth,
            rates=self._rates,
            roll=roll,
            pitch=pitch,
            ages=(0.0, _finite(taken_s - self._depth_at_s), _finite(age_of_velocity_s), 0.0),
            acceleration=self._specific_force(),
            drives=self._telemetry(taken_s),
        )
        self.diagnosis = self._monitor.step(measurement, self._command_until(taken_s))
        self._stepped_at_s = taken_s
        return self.diagnosis.damage

    def _command_until(self, taken_s: float) -> Array | None:
        """The command that was in force in the middle of the time since the last step; None where
        there was none."""
        start_s = self._stepped_at_s
        if not math.isfinite(start_s):
            start_s = taken_s - self.period_s
        middle_s = 0.5 * (start_s + taken_s)
        while len(self._commands) > 1 and self._commands[1][0] <= middle_s:
            self._commands.popleft()
        if not self._commands or self._commands[0][0] > middle_s:
            return None
        return self._commands[0][1]

    def sent(self, command: Array) -> Array:
        """Returns what goes to the drives for the commands (n, 3) of an answer: more of weak
        thrusters, and now and then a trial of a lost one."""
        return self._monitor.sent(command)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is wrong with which actuator."""
        return () if self.diagnosis is None else self.diagnosis.findings

    @property
    def is_unknown(self) -> bool:
        """Whether the robot moves as no fault of an actuator explains."""
        return self.diagnosis is not None and self.diagnosis.unknown

    def phrases(self) -> list[str]:
        """Returns a phrase for each actuator that is not whole, or is suspected of it."""
        phrases = [f"{each.name} {self._said_of(each)}" for each in self.findings]
        return phrases + [f"{name} in doubt ({share:.2f})" for name, share in self._suspected()]

    def heard(self) -> list[tuple[str, str]]:
        """Returns what the sensors have said last that parameters let the monitor hear, by name;
        an empty value of one that has said nothing."""
        values = []
        if self._parameters.pressure:
            depth = f"{self._depth:.3f}" if math.isfinite(self._depth_at_s) else ""
            values.append(("depth [m]", depth))
        if self._parameters.drives != "off":
            is_heard = self._drives_at_s > -NEVER_S
            names = [
                name for name, is_it in zip(self._layout.names, is_heard, strict=True) if is_it
            ]
            values.append(("drives heard", ", ".join(names)))
        return values

    def values(self) -> list[tuple[str, str]]:
        """Returns the evidence: names and values for each actuator that is not whole."""
        if self.diagnosis is None:
            return []
        values = [("unknown", str(self.diagnosis.unknown).lower())]
        for each in self.findings:
            index = self._layout.index(each.name)
            strength = self.diagnosis.strength[index]
            deviation = self.diagnosis.strength_std[index]
            values.append((f"{each.name}: kind", each.kind))
            if each.name not in self._told:
                values.append((f"{each.name}: age [s]", f"{self._now_s - each.since_s:.1f}"))
            values.append((f"{each.name}: probability", f"{each.probability:.4f}"))
            if each.kind == "stuck":
                values.append((f"{each.name}: stuck at", self._stuck_at(each)))
            else:
                values.append((f"{each.name}: strength", f"{strength:.3f}"))
                values.append((f"{each.name}: strength, std", f"{deviation:.3f}"))
        for name, share in self._suspected():
            values.append((f"{name}: suspected", f"{share:.4f}"))
        return values

    def _suspected(self) -> list[tuple[str, float]]:
        """Actuators that are not named yet, with the probability of a fault."""
        if self.diagnosis is None:
            return []
        named = {each.name for each in self.findings}
        of_all = zip(self._layout.names, self.diagnosis.probability.tolist(), strict=True)
        return [(name, share) for name, share in of_all if share >= SUSPECTED and name not in named]

    def _said_of(self, finding: Finding) -> str:
        """What is wrong with one, since when and how sure."""
        what = finding.kind
        if finding.kind in ("weak", "fouled"):
            # Without the drives' currents a fouled one is weak, and no more is known.
            kind = "weak or fouled" if finding.kind == "weak" else "fouled"
            what = f"{kind}, at {100.0 * finding.value:.0f} %"
        elif finding.kind == "stuck":
            what = f"stuck at {self._stuck_at(finding)}"
        if finding.name in self._told:
            return f"{what}, as was said"
        age_s = self._now_s - finding.since_s
        return f"{what} for {age_s:.1f} s ({finding.probability:.3f})"

    def _stuck_at(self, finding: Finding) -> str:
        """The force or the angle at which one is stuck."""
        part = self._layout.actuators[self._layout.index(finding.name)]
        unit = "rad" if part.KIND.sticks_at_angle else "N"
        return f"{finding.value:.3g} {unit}"


def _finite(age_s: float) -> float:
    """An age [s], or 0 of what never came."""
    return age_s if math.isfinite(age_s) else 0.0
