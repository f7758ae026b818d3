"""Fins: what one may be commanded, how fast it comes to that, and how it sits on the hull.

Command: (half amplitude [rad], frequency [Hz], zero direction [rad]). Own frame: shaft, zero, shaft
x zero.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from finlab import axes
from finlab.actuators.actuator import (
    Actuator,
    Box,
    Command,
    Diameter,
    Faults,
    Places,
    Uncertainty,
    held_limits,
    key_words,
    weakened,
)
from finlab.actuators.fin.fin_laws import stack_laws
from finlab.actuators.fin.fin_model import (
    FIN_MODELS,
    MAX_FREQUENCY,
    FinModelSpec,
    Limits,
    Parameter,
)
from finlab.actuators.fin.fin_response import FinGroup, fin_table
from finlab.actuators.law import ActuatorLaw, FinLaw
from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.files.schema import Checked, Name

Coordinate = Annotated[float, Meta(ge=-10.0, le=10.0)]
MountingAngle = Annotated[float, Meta(ge=-axes.TURN - 1e-9, le=axes.TURN + 1e-9)]
SAME_AXIS = 1e-9
"""By how much two unit vectors that are the same may differ, from rounding."""
UCAT_AREA = 0.02
"""Area of a blade whose model does not say it: that of U-CAT's [m^2]."""
FORMULAS = tuple(name for name, parameters in FIN_MODELS.items() if parameters)
"""Models that need no file."""


Rate = Annotated[float, Meta(ge=1e-3, le=1000.0)]
"""A pole, a speed or a rate [per second]; at most a hundred times what such servos reach."""


@dataclass(frozen=True)
class Servo(Checked):
    """The drive of one fin; what is left out is U-CAT's. Checked on construction.

    Amplitude, frequency and zero direction each follow their command through a critically damped
    filter with a double pole p, x'' = p (p (x* - x) - 2 x'): half of the way is done after 1.7 / p,
    nine tenths after
    3.9 / p. The defaults are U-CAT's, as far as something is known of them.
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
    """Double pole of the amplitude [rad/s]; the oscillators that drive the fins in U-CAT's open
    simulator (eeUVsim) have k_amp = 15, twice the pole."""
    frequency_pole: Rate = 7.5
    """Double pole of the frequency [rad/s]. Our choice: nothing is published, and eeUVsim's
    oscillators take a new frequency at once; but a drive that is to beat faster must gather speed
    as one that is to beat wider must, so it has the pole of the amplitude."""
    direction_pole: Rate = 3.5
    """Double pole of the zero direction [rad/s]; eeUVsim's k_zd = 7."""
    speed_limit: Rate = 4 * math.pi
    """Fastest that the fin turns [rad/s]; two turns a second in U-CAT's UWSim plug-in. It cuts the
    amplitude of fast flapping and slows the turning of a fin that flaps."""

    amplitude_rate: Rate = 1.0
    """How fast the commanded amplitude changes at most from tick to tick [rad/s]: what the filter
    above follows with a delay of two tenths of the amplitude."""
    frequency_rate: Rate = 3.0
    """The same of the commanded frequency [Hz/s]."""
    direction_rate: Rate = 5.0
    """The same of the commanded zero direction [rad/s]. A fin that is commanded to turn back at
    once pushes wherever it points meanwhile; one that is commanded step by step gives the others
    time to compensate."""


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
    """[Hz]."""
    zero_direction: float
    """Direction about which it beats [rad]."""

    @property
    def words(self) -> str:
        direction = math.degrees(self.zero_direction)
        return f"{self.amplitude:.3f} rad, {self.frequency:.3f} Hz, {direction:.1f} deg"


def _box(law: str, key: str, rule: Parameter) -> Box:
    unit = f" [{rule.unit}]".replace("^2", "²").replace("^3", "³") if rule.unit else ""
    hint = f"{rule.meaning[0].upper()}{rule.meaning[1:]}. Usual: {rule.default:g}."
    return Box(
        f"{key_words(key)}{unit}",
        key,
        hint,
        (abs(rule.default) or 1.0) / 20,
        law=law,
        usual=rule.default,
    )


@dataclass(frozen=True)
class Fin(Actuator):
    """One fin on the hull, its shaft horizontal or in any direction. Checked on construction."""

    KEYS: ClassVar[Mapping[str, str]] = {"position": "position_m", "diameter": "diameter_m"}
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {
        "mounting_angle": ("mounting_angle_deg", Annotated[float, Meta(ge=-360.0, le=360.0)])
    }
    WRITTEN: ClassVar[Collection[str]] = ("limits", "model")
    type: ClassVar[str] = "fin"
    LAW = FinLaw
    GROUP = FinGroup
    NUMBERS = (("A", "rad"), ("f", "Hz"), ("phi", "rad"))
    COMMAND = FinCommand
    AXES = ("shaft", "zero")
    PUSHES = (1, 2)
    ANGLE = 2
    HELD = 2
    FAULTS = ("weak", "torn", "stuck", "running")
    LOOKS = "fin"
    OTHER = "Zero"
    BOXES = (
        Box(
            "A [°]",
            "amplitude",
            "Half of the beat: least and most, up to 90.",
            5.0,
            True,
            pair=True,
        ),
        Box("f [Hz]", "frequency", f"Least and most, up to {MAX_FREQUENCY:g} Hz.", pair=True),
        Box(
            "φ [°]",
            "zero_direction",
            "From and to; −180 to 180 is any direction.",
            5.0,
            True,
            pair=True,
        ),
    )
    MODELS = FORMULAS
    LAW_BOXES = tuple(
        _box(law, key, rule) for law in FORMULAS for key, rule in FIN_MODELS[law].items()
    )

    name: Name
    """Unique within its layout; `--lost NAME` and the app refer to it."""
    position: tuple[Coordinate, Coordinate, Coordinate]
    """Where the fin's force acts, body frame (x forward, y left, z up from the centre of gravity)
    [m]."""
    mounting_angle: MountingAngle | None = None
    """Azimuth of a horizontal shaft in the body xy plane, from +x, counter-clockwise [rad]; None
    where `shaft` and `zero` are given."""
    limits: Limits = Limits()
    """What the fin may be commanded."""
    model: FinModelSpec = FinModelSpec()
    """Which law gives its force."""
    servo: Servo = Servo()
    """How fast it comes to what is commanded."""
    shaft: axes.Direction3 | None = None
    """Unit vector out of the hull along the shaft, body frame; None where `mounting_angle` is
    given."""
    zero: axes.Direction3 | None = None
    """Unit vector across the shaft: the thrust's direction at zero direction 0; from there it turns
    towards shaft x zero. None where `mounting_angle` is given; zero is e_z x shaft then."""
    uncertainty: Uncertainty | None = None
    """How far its force may be from that; None where nothing is known of it."""
    diameter: Diameter | None = None
    """Of a disc as large as the area that it sweeps [m], for its jet; None where its blade is as
    large."""

    def check_together(self) -> None:
        """See `Actuator`."""
        if self.shaft is None and self.zero is None:
            if self.mounting_angle is None:
                raise LayoutError("is missing; give it, or shaft and zero", "mounting_angle")
            return
        if self.mounting_angle is not None:
            raise LayoutError("give either a mounting angle, or shaft and zero, not both", "shaft")
        shaft, zero = axes.axes_across(("shaft", self.shaft), ("zero", self.zero))
        object.__setattr__(self, "shaft", shaft)
        object.__setattr__(self, "zero", zero)
        if math.dist(zero, (-shaft[1], shaft[0], 0.0)) < SAME_AXIS:
            # The shaft is horizontal, and zero where a mounting angle has it: one fin has one
            # description.
            object.__setattr__(self, "mounting_angle", math.atan2(shaft[1], shaft[0]))
            object.__setattr__(self, "shaft", None)
            object.__setattr__(self, "zero", None)

    @property
    def lower(self) -> tuple[float, float, float]:
        """Least (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.limits.lower

    @property
    def upper(self) -> tuple[float, float, float]:
        """Greatest (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.limits.upper

    @property
    def rates(self) -> tuple[float, float, float]:
        """Fastest changes of amplitude [rad/s], frequency [Hz/s] and zero direction [rad/s]."""
        return self.servo.amplitude_rate, self.servo.frequency_rate, self.servo.direction_rate

    @property
    def frame(self) -> tuple[axes.Vector, axes.Vector, axes.Vector]:
        """The fin's own axes in the body frame: shaft, zero, shaft x zero."""
        if self.shaft is None or self.zero is None:
            angle = self.mounting_angle or 0.0
            c = math.cos(angle)
            s = math.sin(angle)
            return (c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)
        return self.shaft, self.zero, axes.cross(self.shaft, self.zero)

    @classmethod
    def laws(cls, parts: Sequence[Any]) -> Sequence[tuple[Places, ActuatorLaw]]:
        return stack_laws([fin.model for fin in parts])

    @classmethod
    def sample(cls) -> Self:
        """See `Actuator`: U-CAT's fin."""
        return cls("fin", (0.0, 0.0, 0.0), 0.0)

    @property
    def reads(self) -> str | None:
        return str(self.model.values()["path"]) if self.model.type == "table" else None

    def reading(self, path: str) -> Self:
        return replace(self, model=FinModelSpec("table", (("path", path),)))

    def value(self, key: str) -> Any:
        known = self.model.values()
        return known[key] if key in known else super().value(key)

    def with_value(self, key: str, value: Any) -> Self:
        if key in Limits.KEYS:
            return replace(self, limits=replace(self.limits, **{key: value}))
        known = FIN_MODELS[self.model.type]
        if key not in known:
            return super().with_value(key, value)
        parameters = {**dict(self.model.parameters), key: value}
        if value is None or math.isclose(value, known[key].default, rel_tol=1e-12, abs_tol=0.0):
            del parameters[key]  # files say only what is not usual
        return replace(self, model=FinModelSpec(self.model.type, tuple(parameters.items())))

    def with_model(self, kind: str) -> Self:
        shared = tuple(
            (key, value) for key, value in self.model.parameters if key in FIN_MODELS[kind]
        )
        return replace(self, model=FinModelSpec(kind, shared))

    @property
    def takes(self) -> tuple[str, ...]:
        """See `Actuator`: the thrust of a table cannot be scaled."""
        return tuple(fault for fault in self.FAULTS if fault != "torn" or self.reads is None)

    @property
    def jet(self) -> float:
        """See `Actuator`. A blade that beats by half a radian sweeps about its own area."""
        known = self.model.values()
        blades = {"drag": ("area",), "lighthill": ("length", "width")}
        sides = [float(known[name]) for name in blades.get(self.model.type, ())]
        return self.diameter or math.sqrt(4.0 * math.prod(sides or [UCAT_AREA]) / math.pi)

    @property
    def delay_s(self) -> float:
        """See `Actuator`: 2 / p of its slowest double pole p."""
        return 2.0 / min(
            self.servo.amplitude_pole, self.servo.frequency_pole, self.servo.direction_pole
        )

    def largest(self, speed: float) -> float:
        """See `Actuator`: a soft fin may push more with a smaller command than the largest."""
        return fin_table(self).largest

    def damaged(self, faults: Faults) -> Self:
        own = self.limits
        model = self.model if faults.torn is None else self.model.scaled(faults.torn)
        if faults.running is not None:
            amplitude, frequency, direction = ((value, value) for value in faults.running)
            return replace(self, model=model, limits=Limits(amplitude, frequency, direction))
        amplitude, frequency = (
            weakened(ends, faults.weak) for ends in (own.amplitude, own.frequency)
        )
        limits = Limits(amplitude, frequency, held_limits(faults.stuck, own.zero_direction))
        return replace(self, model=model, limits=limits)

    def scaled(self, share: float) -> Self:
        return self if self.reads else replace(self, model=self.model.scaled(share))

    @property
    def limits_words(self) -> str:
        a, b = self.limits.amplitude
        c, d = self.limits.frequency
        arc = axes.arc_words(*self.limits.zero_direction)
        return f"A {a:g}..{b:g} rad, f {c:g}..{d:g} Hz, {arc}, {self.model.type}"

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
        """See `Actuator`: a horizontal shaft keeps its mounting angle, whose zero is the other way
        round there."""
        level = self.mounting_angle is not None
        frame = np.array(self.frame) * axes.MIRROR * ([[1.0], [-1.0], [1.0]] if level else 1.0)
        limits = self.limits
        low, high = self.limits.zero_direction
        if not axes.is_full_turn(high - low):
            middle = float(axes.wrapped((math.pi if level else 0.0) - 0.5 * (low + high)))
            half = 0.5 * (high - low)
            limits = replace(limits, zero_direction=(middle - half, middle + half))
        return self.turned(frame, np.array(self.position) * axes.MIRROR, limits=limits)

    def settled(self, frame: Array) -> Array:
        """See `Actuator`: a fin that turns all round has zero where a mounting angle has it, or
        ahead."""
        low, high = self.limits.zero_direction
        if axes.is_full_turn(high - low):
            level = abs(frame[0, 2]) < axes.SHORT
            frame[1] = np.cross(axes.UP, frame[0]) if level else axes.across(frame[0], axes.AHEAD)
        return frame
