"""Fins: what one may be commanded, how fast it comes to that, and how it sits on the hull."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from finlab.errors import LayoutError
from finlab.layout.axes import FULL_TURN_TOLERANCE, TURN, Direction3, Vector, axes_across, cross
from finlab.layout.checked import Checked, Name
from finlab.layout.commanded import Uncertainty
from finlab.layout.fin_model import FinModelSpec

MAX_AMPLITUDE = math.pi / 2
"""Largest half amplitude a layout may allow [rad]; beyond it the fin would beat through the hull."""
MAX_FREQUENCY = 20.0
"""Largest frequency a layout may allow [Hz]; ten times what such servos reach."""
MAX_POSITION = 10.0
"""Largest coordinate of a fin [m]."""


Amplitude = Annotated[float, Meta(ge=0.0, le=MAX_AMPLITUDE)]
Frequency = Annotated[float, Meta(ge=0.0, le=MAX_FREQUENCY)]
Direction = Annotated[float, Meta(ge=-TURN, le=TURN)]
Coordinate = Annotated[float, Meta(ge=-MAX_POSITION, le=MAX_POSITION)]
MountingAngle = Annotated[float, Meta(ge=-TURN - 1e-9, le=TURN + 1e-9)]
LEAST = {"amplitude": 1e-4, "frequency": 1e-3}
"""Least amplitude [rad] and frequency [Hz] that is not 0."""
LEAST_WIDTH = 1e-6
"""Least width of a range [rad, Hz] that is not 0."""
SAME_AXIS = 1e-9
"""By how much two unit vectors that are the same may differ, from rounding."""


@dataclass(frozen=True)
class Limits(Checked):
    """What one fin may be commanded. The defaults are the nominal limits. Checked on construction."""

    KEYS: ClassVar[Mapping[str, str]] = {
        "amplitude": "amplitude_rad",
        "frequency": "frequency_hz",
        "zero_direction": "zero_direction_rad",
    }
    WRITTEN: ClassVar[Collection[str]] = ("amplitude", "frequency", "zero_direction")

    amplitude: tuple[Amplitude, Amplitude] = (0.05, 0.6)
    """Half amplitude [rad], (minimum, maximum)."""
    frequency: tuple[Frequency, Frequency] = (0.1, 2.1)
    """Frequency [Hz], (minimum, maximum)."""
    zero_direction: tuple[Direction, Direction] = (-math.pi, math.pi)
    """Zero direction [rad], (minimum, maximum), at most one turn apart; a full turn means any direction."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, key in self.KEYS.items():
            low, high = getattr(self, name)
            if low > high:
                raise LayoutError(f"minimum {low:g} is above maximum {high:g}; swap them", key)
            if name != "zero_direction" and (high < LEAST[name] or 0.0 < low < LEAST[name]):
                raise LayoutError(
                    f"the maximum must be at least {LEAST[name]:g}, the minimum 0 or as much, got {low:g} "
                    f"and {high:g}; leave the fin out if it never moves",
                    key,
                )
            if 0.0 < high - low < LEAST_WIDTH:
                raise LayoutError(
                    f"must span 0 or at least {LEAST_WIDTH:g}, got {high - low:g}; write one value twice", key
                )
        width = self.zero_direction[1] - self.zero_direction[0]
        if width > TURN + FULL_TURN_TOLERANCE:
            raise LayoutError(f"must span at most one turn (6.2832), got {width:.4f}", "zero_direction_rad")

    @property
    def lower(self) -> tuple[float, float, float]:
        """Least (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.amplitude[0], self.frequency[0], self.zero_direction[0]

    @property
    def upper(self) -> tuple[float, float, float]:
        """Greatest (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.amplitude[1], self.frequency[1], self.zero_direction[1]


Rate = Annotated[float, Meta(ge=1e-3, le=1000.0)]
"""A pole, a speed or a rate [per second]; at most a hundred times what such servos reach."""


@dataclass(frozen=True)
class Servo(Checked):
    """The drive of one fin; what is left out is U-CAT's. Checked on construction.

    Amplitude, frequency and zero direction each follow their command through a critically damped filter with
    a double pole p, x'' = p (p (x* - x) - 2 x'): half of the way is done after 1.7 / p, nine tenths after
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
    """Double pole of the amplitude [rad/s]; the oscillators that drive the fins in U-CAT's open simulator
    (eeUVsim) have k_amp = 15, twice the pole."""
    frequency_pole: Rate = 7.5
    """Double pole of the frequency [rad/s]. Our choice: nothing is published, and eeUVsim's oscillators take
    a new frequency at once; but a drive that is to beat faster must gather speed as one that is to beat wider
    must, so it has the pole of the amplitude."""
    direction_pole: Rate = 3.5
    """Double pole of the zero direction [rad/s]; eeUVsim's k_zd = 7."""
    speed_limit: Rate = 4 * math.pi
    """Fastest that the fin turns [rad/s]; two turns a second in U-CAT's UWSim plug-in. It cuts the amplitude
    of fast flapping and slows the turning of a fin that flaps."""

    amplitude_rate: Rate = 1.0
    """How fast the commanded amplitude changes at most from tick to tick [rad/s]: what the filter above
    follows with a delay of two tenths of the amplitude."""
    frequency_rate: Rate = 3.0
    """The same of the commanded frequency [Hz/s]."""
    direction_rate: Rate = 5.0
    """The same of the commanded zero direction [rad/s]. A fin that is commanded to turn back at once pushes
    wherever it points meanwhile; one that is commanded step by step gives the others time to compensate."""


@dataclass(frozen=True)
class Fin(Checked):
    """One fin on the hull, its shaft horizontal or in any direction. Checked on construction."""

    KEYS: ClassVar[Mapping[str, str]] = {"position": "position_m"}
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {
        "mounting_angle": ("mounting_angle_deg", Annotated[float, Meta(ge=-360.0, le=360.0)])
    }
    WRITTEN: ClassVar[Collection[str]] = ("limits", "model")
    type: ClassVar[str] = "fin"
    PUSHES: ClassVar[tuple[int, ...]] = (1, 2)
    HELD: ClassVar[int] = 2

    name: Name
    """Unique within its layout; `--failed NAME` and the app refer to it."""
    position: tuple[Coordinate, Coordinate, Coordinate]
    """Where the fin's force acts, body frame (x forward, y left, z up from the centre of gravity) [m]."""
    mounting_angle: MountingAngle | None = None
    """Azimuth of a horizontal shaft in the body xy plane, from +x, counter-clockwise [rad]; None where
    `shaft` and `zero` are given."""
    limits: Limits = Limits()
    """What the fin may be commanded."""
    model: FinModelSpec = FinModelSpec()
    """Which law gives its force."""
    servo: Servo = Servo()
    """How fast it comes to what is commanded."""
    shaft: Direction3 | None = None
    """Unit vector out of the hull along the shaft, body frame; None where `mounting_angle` is given."""
    zero: Direction3 | None = None
    """Unit vector across the shaft: the thrust's direction at zero direction 0; from there it turns towards
    shaft x zero. None where
    `mounting_angle` is given; zero is e_z x shaft then."""
    uncertainty: Uncertainty | None = None
    """How far its force may be from that; None where nothing is known of it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shaft is None and self.zero is None:
            if self.mounting_angle is None:
                raise LayoutError("required key is missing; give it, or shaft and zero", "mounting_angle_deg")
            return
        if self.mounting_angle is not None:
            raise LayoutError("give either mounting_angle_deg, or shaft and zero, not both", "shaft")
        shaft, zero = axes_across(("shaft", self.shaft), ("zero", self.zero))
        object.__setattr__(self, "shaft", shaft)
        object.__setattr__(self, "zero", zero)
        if math.dist(zero, (-shaft[1], shaft[0], 0.0)) < SAME_AXIS:
            # The shaft is horizontal, and zero where a mounting angle has it: one fin has one description.
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
    def frame(self) -> tuple[Vector, Vector, Vector]:
        """The fin's own axes in the body frame: shaft, zero, shaft x zero."""
        if self.shaft is None or self.zero is None:
            angle = self.mounting_angle or 0.0
            c, s = math.cos(angle), math.sin(angle)
            return (c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)
        return self.shaft, self.zero, cross(self.shaft, self.zero)
