"""One fin: where it sits, how its shaft points, what it may be asked to do.

The fin frame is right-handed: x' = shaft = (cos a, sin a, 0) out of the hull, y' = e_h = (-sin a, cos a, 0)
the horizontal thrust axis, z' = e_z = (0, 0, 1), with a the mounting angle. A command is (half amplitude
[rad], frequency [Hz], zero direction [rad]); the mean force is T [cos(zero direction) e_h + sin(zero
direction) e_z].
"""

import math
from dataclasses import dataclass

from finlab.errors import LayoutError
from finlab.layout.fin_model import FinModelSpec
from finlab.layout.rules import MAX_NAME_LENGTH, interval, number, numbers, text

MAX_AMPLITUDE = math.pi / 2
"""Largest half amplitude a layout may allow [rad]; beyond it the fin would beat through the hull."""
MAX_FREQUENCY = 20.0
"""Largest frequency a layout may allow [Hz]; ten times what such servos reach."""
MAX_POSITION = 10.0
"""Largest coordinate of a fin [m]."""


@dataclass(frozen=True)
class Limits:
    """What one fin may be commanded. The defaults are the nominal limits. Checked on construction."""

    amplitude: tuple[float, float] = (0.05, 0.6)
    """Half amplitude [rad], (minimum, maximum); the maximum is above 0."""

    frequency: tuple[float, float] = (0.1, 2.1)
    """Frequency [Hz], (minimum, maximum); the maximum is above 0."""

    zero_direction: tuple[float, float] = (-math.pi, math.pi)
    """Zero direction [rad], (minimum, maximum), at most one turn apart; a full turn means any direction."""

    def __post_init__(self) -> None:
        amplitude = interval(self.amplitude, "amplitude_rad", 0.0, MAX_AMPLITUDE)
        frequency = interval(self.frequency, "frequency_hz", 0.0, MAX_FREQUENCY)
        zero_direction = interval(self.zero_direction, "zero_direction_rad", -2 * math.pi, 2 * math.pi)
        # The energy proxy divides by these two maxima.
        if amplitude[1] <= 0.0:
            raise LayoutError(
                "the maximum must be above 0; leave the fin out if it never moves", "amplitude_rad"
            )
        if frequency[1] <= 0.0:
            raise LayoutError(
                "the maximum must be above 0; leave the fin out if it never moves", "frequency_hz"
            )
        width = zero_direction[1] - zero_direction[0]
        if width > 2 * math.pi + 1e-6:
            raise LayoutError(f"must span at most one turn (6.2832), got {width:.4f}", "zero_direction_rad")
        object.__setattr__(self, "amplitude", amplitude)
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "zero_direction", zero_direction)

    @property
    def lower(self) -> tuple[float, float, float]:
        """Least (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.amplitude[0], self.frequency[0], self.zero_direction[0]

    @property
    def upper(self) -> tuple[float, float, float]:
        """Greatest (amplitude [rad], frequency [Hz], zero direction [rad])."""
        return self.amplitude[1], self.frequency[1], self.zero_direction[1]


@dataclass(frozen=True)
class Fin:
    """One fin on the hull. Checked on construction."""

    name: str
    """Unique within its layout; `--failed NAME` and the app refer to it."""

    position: tuple[float, float, float]
    """Where the fin's force acts, body frame (x forward, y left, z up from the centre of gravity) [m]."""

    mounting_angle: float
    """Azimuth of the shaft in the body xy plane, from +x, counter-clockwise [rad]."""

    limits: Limits = Limits()
    """What the fin may be commanded."""

    model: FinModelSpec = FinModelSpec()
    """Which law gives its force."""

    def __post_init__(self) -> None:
        x, y, z = numbers(self.position, "position_m", 3, -MAX_POSITION, MAX_POSITION)
        object.__setattr__(self, "name", text(self.name, "name", MAX_NAME_LENGTH))
        object.__setattr__(self, "position", (x, y, z))
        angle = number(self.mounting_angle, "mounting_angle")
        if abs(angle) > 2 * math.pi + 1e-9:
            raise LayoutError(
                f"must lie within one turn either way, got {math.degrees(angle):g} deg", "mounting_angle_deg"
            )
        object.__setattr__(self, "mounting_angle", angle)
