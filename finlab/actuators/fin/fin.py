"""Fins: limits of the command, the servo that follows it, and the mounting on the hull.

Command: (half amplitude [rad], frequency [Hz], zero direction [rad]). Own frame: shaft, zero, shaft
x zero.
"""

from __future__ import annotations  # help() then prints `Rate`, not the bounds of one

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from finlab import axes
from finlab.actuators.actuator import (
    ACROSS,
    Actuator,
    Command,
    CommandNumber,
    CommandRow,
    Diameter,
    Faults,
    Indices,
    Kind,
    Uncertainty,
    held_limits,
    weakened,
)
from finlab.actuators.fin.fin_laws import stack_laws
from finlab.actuators.fin.fin_model import FIN_MODELS, FinModelSpec, Limits
from finlab.actuators.fin.fin_response import FinGroup, fin_table
from finlab.actuators.law import ActuatorLaw, FinLaw
from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.files.schema import Checked, Name

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

Coordinate = Annotated[float, Meta(ge=-10.0, le=10.0)]
"""A coordinate of a point on the hull [m]."""
Point = tuple[Coordinate, Coordinate, Coordinate]
"""A point on the hull, body frame [m]."""
MountingAngle = Annotated[float, Meta(ge=-axes.TURN - 1e-9, le=axes.TURN + 1e-9)]
"""Azimuth of a horizontal shaft [rad]; a turn in degrees, converted, may exceed it by rounding."""
Rate = Annotated[float, Meta(ge=1e-3, le=1000.0)]
"""A pole, an angular speed or a rate [1/s]; at most a hundred times what such servos reach."""
SAME_AXIS = 1e-9
"""Most by which two unit vectors that are the same may differ, from rounding."""
UCAT_AREA = 0.02
"""Area of a blade whose model does not say it: that of U-CAT's [m^2]."""
FORMULAS = tuple(name for name, parameters in FIN_MODELS.items() if parameters)
"""Models that need no file."""
BLADE_SIDES = {"drag": ("area",), "lighthill": ("length", "width")}
"""Models that know their blade -> parameters whose product is its area [m^2]."""


@dataclass(frozen=True)
class Servo(Checked):
    """The drive of one fin; what is left out is U-CAT's. Checked on construction.

    Amplitude, frequency and zero direction each follow their command through a critically damped
    filter with a double pole p, x'' = p (p (x* - x) - 2 x'): half of the way is done after 1.7 / p,
    nine tenths after 3.9 / p. The defaults are U-CAT's, as far as something is known of them.

    Args:
        amplitude_pole: double pole of the amplitude [rad/s]; the oscillators that drive the fins in
            U-CAT's open simulator (eeUVsim) have k_amp = 15, twice the pole.
        frequency_pole: double pole of the frequency [rad/s]. Our choice: nothing is published, and
            eeUVsim's oscillators take a new frequency at once; but a drive that is to beat faster
            must gather speed as one that is to beat wider must, so it has the pole of the
            amplitude.
        direction_pole: double pole of the zero direction [rad/s]; eeUVsim's k_zd = 7.
        speed_limit: largest angular speed of the fin [rad/s]; two turns a second in U-CAT's UWSim
            plug-in. It cuts the amplitude of fast flapping and slows the turning of a fin that
            flaps.
        amplitude_rate: largest change of the commanded amplitude from tick to tick [rad/s]: what
            the filter follows with a delay of two tenths of the amplitude.
        frequency_rate: the same of the commanded frequency [Hz/s].
        direction_rate: the same of the commanded zero direction [rad/s]. A fin that is commanded to
            turn back at once pushes in all directions between; one that is commanded step by step
            gives the others time to compensate.
    """

    KEYS: ClassVar[Mapping[str, str]] = {
        "amplitude_pole": "amplitude_pole_rad_s",
        "frequency_pole": "frequency_pole_rad_s",
        "direction_pole": "direction_pole_rad_s",
        "speed_limit": "speed_limit_rad_s",
        "amplitude_rate": "amplitude_rate_rad_s",
        "frequency_rate": "frequency_rate_hz_s",
        "direction_rate": "direction_rate_rad_s",
    }

    amplitude_pole: Rate = 7.5
    frequency_pole: Rate = 7.5
    direction_pole: Rate = 3.5
    speed_limit: Rate = 4 * math.pi
    amplitude_rate: Rate = 1.0
    frequency_rate: Rate = 3.0
    direction_rate: Rate = 5.0


class FinCommand(
    Command,
    frozen=True,
    rename={
        "amplitude": "amplitude_rad",
        "frequency": "frequency_hz",
        "zero_direction": "zero_direction_rad",
    },
):
    """The command of a fin, by name."""

    amplitude: float
    """Half amplitude [rad]."""
    frequency: float
    """Frequency [Hz]."""
    zero_direction: float
    """Direction about which it beats [rad]."""

    @property
    def words(self) -> str:
        direction = math.degrees(self.zero_direction)
        # In three quarters of the time that an f-string takes.
        return "%.3f rad, %.3f Hz, %.1f deg" % (self.amplitude, self.frequency, direction)  # noqa: UP031


@dataclass(frozen=True)
class Fin(Actuator):
    """One fin on the hull, its shaft horizontal or in any direction. Checked on construction.

    Args:
        name: unique within its layout; `--lost NAME` and the app refer to it.
        position: where the fin's force acts, body frame (x forward, y left, z up from the centre of
            gravity) [m].
        mounting_angle: azimuth of a horizontal shaft in the body's xy plane, from +x,
            counter-clockwise [rad]; None where `shaft` and `zero` are given.
        limits: least and greatest amplitude [rad], frequency [Hz] and zero direction [rad].
        model: the law of its force, by name and parameters, in SI units.
        servo: how fast it follows its command [rad/s, Hz/s].
        shaft: unit vector out of the hull along the shaft, body frame [1]; None where
            `mounting_angle` is given.
        zero: unit vector across the shaft, body frame [1]: the thrust's direction at zero direction
            0; from there it turns towards shaft x zero. None where `mounting_angle` is given; zero
            is e_z x shaft then.
        uncertainty: standard deviation of its force [N]; None: nothing is known of it.
        diameter: of a disc as large as the area that it sweeps, for its jet [m]; None: its blade is
            as large.

    Raises:
        LayoutError: a value is out of its bounds; the message names the argument.
    """

    KEYS: ClassVar[Mapping[str, str]] = {"position": "position_m", "diameter": "diameter_m"}
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {
        "mounting_angle": ("mounting_angle_deg", Annotated[float, Meta(ge=-360.0, le=360.0)])
    }
    WRITTEN: ClassVar[Collection[str]] = ("limits", "model")
    type: ClassVar[str] = "fin"
    KIND: ClassVar[Kind] = Kind(
        law=FinLaw,
        group=FinGroup,
        command=FinCommand,
        numbers=(
            CommandNumber(name="A", unit="rad"),
            CommandNumber(name="f", unit="Hz"),
            CommandNumber(name="phi", unit="rad", aims=True, wraps=True),
        ),
        axes=("shaft", "zero"),
        pushes_along=("zero", ACROSS),
        pointed="shaft",
        drawn_as="fin",
        faults=("weak", "torn", "stuck", "running"),
        models=FORMULAS,
    )

    name: Name
    position: Point
    mounting_angle: MountingAngle | None = None
    limits: Limits = Limits()
    model: FinModelSpec = FinModelSpec()
    servo: Servo = Servo()
    shaft: axes.Direction3 | None = None
    zero: axes.Direction3 | None = None
    uncertainty: Uncertainty | None = None
    diameter: Diameter | None = None

    def check_together(self) -> None:
        """See `Actuator`."""
        if self.shaft is None and self.zero is None:
            if self.mounting_angle is None:
                raise LayoutError("is missing; give it, or shaft and zero", "mounting_angle")
            return
        if self.mounting_angle is not None:
            raise LayoutError("give either a mounting angle, or shaft and zero, not both", "shaft")
        shaft, zero = axes.perpendicular_axes(("shaft", self.shaft), ("zero", self.zero))
        object.__setattr__(self, "shaft", shaft)
        object.__setattr__(self, "zero", zero)
        if math.dist(zero, (-shaft[1], shaft[0], 0.0)) < SAME_AXIS:
            # The shaft is horizontal, and zero as with a mounting angle: equal fins are to have
            # equal fields.
            object.__setattr__(self, "mounting_angle", math.atan2(shaft[1], shaft[0]))
            object.__setattr__(self, "shaft", None)
            object.__setattr__(self, "zero", None)

    @property
    def lower(self) -> CommandRow:
        """Least (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.limits.lower

    @property
    def upper(self) -> CommandRow:
        """Greatest (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.limits.upper

    @property
    def rates(self) -> CommandRow:
        """Largest changes of amplitude [rad/s], frequency [Hz/s] and zero direction [rad/s]."""
        return self.servo.amplitude_rate, self.servo.frequency_rate, self.servo.direction_rate

    @property
    def frame(self) -> tuple[axes.Vector3, axes.Vector3, axes.Vector3]:
        """The fin's own axes in the body frame: shaft, zero, shaft x zero."""
        if self.shaft is None or self.zero is None:
            angle = self.mounting_angle or 0.0
            cos = math.cos(angle)
            sin = math.sin(angle)
            return (cos, sin, 0.0), (-sin, cos, 0.0), (0.0, 0.0, 1.0)
        return self.shaft, self.zero, axes.cross(self.shaft, self.zero)

    @classmethod
    def laws(cls, actuators: Sequence[Any]) -> Sequence[tuple[Indices, ActuatorLaw]]:
        return stack_laws([fin.model for fin in actuators])

    @classmethod
    def sample(cls) -> Self:
        """See `Actuator`: U-CAT's fin."""
        return cls(name="fin", position=(0.0, 0.0, 0.0), mounting_angle=0.0)

    @property
    def reads(self) -> str | None:
        return str(self.model.values()["path"]) if self.model.type == "table" else None

    def reading(self, path: str) -> Self:
        return replace(self, model=FinModelSpec("table", (("path", path),)))

    def value(self, key: str) -> Any:
        """See `Actuator`; a parameter of the model is a field of it, too."""
        parameters = self.model.values()
        return parameters[key] if key in parameters else super().value(key)

    def with_value(self, key: str, value: Any) -> Self:
        """See `Actuator`; a parameter with its default value is left out, as files do."""
        if key in Limits.KEYS:
            return replace(self, limits=replace(self.limits, **{key: value}))
        rules = FIN_MODELS[self.model.type]
        if key not in rules:
            return super().with_value(key, value)
        parameters = {**dict(self.model.parameters), key: value}
        if value is None or math.isclose(value, rules[key].default, rel_tol=1e-12, abs_tol=0.0):
            del parameters[key]
        return replace(self, model=FinModelSpec(self.model.type, tuple(parameters.items())))

    def with_model(self, model_type: str) -> Self:
        shared = []
        for key, value in self.model.parameters:
            if key in FIN_MODELS[model_type]:
                shared.append((key, value))
        return replace(self, model=FinModelSpec(model_type, tuple(shared)))

    @property
    def takes(self) -> tuple[str, ...]:
        """See `Actuator`: the thrust of a table cannot be scaled."""
        return tuple(fault for fault in self.KIND.faults if fault != "torn" or self.reads is None)

    @property
    def jet(self) -> float:
        """See `Actuator`. A blade that beats by half a radian sweeps about its own area."""
        if self.diameter:
            return self.diameter
        parameters = self.model.values()
        sides = [float(parameters[name]) for name in BLADE_SIDES.get(self.model.type, ())]
        area = math.prod(sides) if sides else UCAT_AREA
        return math.sqrt(4.0 * area / math.pi)

    @property
    def delay_s(self) -> float:
        """See `Actuator`: 2 / p of its slowest double pole p."""
        servo = self.servo
        return 2.0 / min(servo.amplitude_pole, servo.frequency_pole, servo.direction_pole)

    def largest(self, speed: float) -> float:
        """See `Actuator`: a soft fin may push more with a smaller command than the largest."""
        return fin_table(self).largest

    def damaged(self, faults: Faults) -> Self:
        model = self.model if faults.torn is None else self.model.scaled(faults.torn)
        if faults.running is not None:
            amplitude, frequency, direction = faults.running
            limits = Limits(
                amplitude=(amplitude, amplitude),
                frequency=(frequency, frequency),
                zero_direction=(direction, direction),
            )
        else:
            limits = Limits(
                amplitude=weakened(self.limits.amplitude, faults.weak),
                frequency=weakened(self.limits.frequency, faults.weak),
                zero_direction=held_limits(faults.stuck, self.limits.zero_direction),
            )
        return replace(self, model=model, limits=limits)

    def scaled(self, share: float) -> Self:
        return self if self.reads else replace(self, model=self.model.scaled(share))

    @property
    def limits_words(self) -> str:
        low_a, high_a = self.limits.amplitude
        low_f, high_f = self.limits.frequency
        arc = axes.arc_words(*self.limits.zero_direction)
        return f"A {low_a:g}..{high_a:g} rad, f {low_f:g}..{high_f:g} Hz, {arc}, {self.model.type}"

    @property
    def direction_words(self) -> str:
        if self.mounting_angle is not None:
            return f"shaft at {math.degrees(self.mounting_angle):.1f} deg"
        return super().direction_words

    def turned(self, frame: ArrayLike, position: ArrayLike | None = None, **changes: Any) -> Self:
        """See `Actuator`: a shaft that is horizontal, with zero across it, becomes a mounting angle
        again."""
        return Actuator.turned(self, frame, position, mounting_angle=None, **changes)

    def image(self) -> Self:
        """See `Actuator`: a horizontal shaft keeps its mounting angle, so that `zero` of the image
        is the mirrored one reversed."""
        is_level = self.mounting_angle is not None
        frame = np.array(self.frame) * axes.MIRROR_SIGNS
        if is_level:
            frame = frame * [[1.0], [-1.0], [1.0]]
        limits = self.limits
        low, high = limits.zero_direction
        if not axes.is_full_turn(high - low):
            center = float(axes.wrapped((math.pi if is_level else 0.0) - 0.5 * (low + high)))
            half_angle = 0.5 * (high - low)
            limits = replace(limits, zero_direction=(center - half_angle, center + half_angle))
        return self.turned(frame, np.array(self.position) * axes.MIRROR_SIGNS, limits=limits)

    def settled(self, frame: Array) -> Array:
        """See `Actuator`: a fin that turns all round has zero as with a mounting angle, or, if its
        shaft is not horizontal, as near to ahead as the shaft allows."""
        low, high = self.limits.zero_direction
        if axes.is_full_turn(high - low):
            is_level = abs(frame[0, 2]) < axes.MIN_LENGTH
            if is_level:
                frame[1] = np.cross(axes.UP, frame[0])
            else:
                frame[1] = axes.perpendicular(frame[0], axes.FORWARD)
        return frame
