"""A rudder, or any foil that steers by the water that flows past it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from finlab.errors import LayoutError
from finlab.layout.axes import Direction3
from finlab.layout.checked import Name
from finlab.layout.commanded import Commanded, Uncertainty
from finlab.layout.propellers import Place, Seconds, TurnRate, TurnRateDegrees

EFFICIENCY = 0.9
"""Induced drag of an elliptic wing over that of such a foil (Whicker and Fehlner, 1958)."""
Deflection = Annotated[float, Meta(ge=-math.pi / 2, le=math.pi / 2)]
DeflectionDegrees = Annotated[float, Meta(ge=-90.0, le=90.0)]
StallDegrees = Annotated[float, Meta(ge=5.0, le=70.0)]
Slope = Annotated[float, Meta(ge=0.05, le=10.0)]
Coefficient = Annotated[float, Meta(ge=0.0, le=10.0)]


@dataclass(frozen=True)
class Rudder(Commanded):
    """A foil on a shaft; its command is the deflection. Checked on construction.

    Its force is that of the flow: with the speed U across the shaft and the angle a between chord and flow,
    lift 1/2 density U^2 area CL(a) across the flow and drag 1/2 density U^2 area CD(a) along it. At rest it
    gives nothing.
    """

    KEYS: ClassVar[Mapping[str, str]] = {
        "position": "position_m",
        "area": "area_m2",
        "lift_slope": "lift_slope_per_rad",
        "drag": "drag_coefficient",
        "density": "density_kg_m3",
        "time_constant": "time_constant_s",
    }
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {
        "deflection": ("deflection_deg", tuple[DeflectionDegrees, DeflectionDegrees]),
        "stall": ("stall_deg", StallDegrees),
        "rate": ("rate_deg_s", TurnRateDegrees),
    }
    LIMITS, RATES, AXES, PUSHES = ("deflection",), ("rate",), ("shaft", "zero"), (2,)
    type: ClassVar[str] = "rudder"

    name: Name
    """Unique within its layout."""
    position: Place
    """Where the force acts, the centre of pressure, body frame [m]."""
    shaft: Direction3
    """Unit vector of the shaft, body frame."""
    zero: Direction3
    """Unit vector across it: from the trailing to the leading edge at deflection 0; it turns towards shaft x
    zero."""
    area: Annotated[float, Meta(ge=1e-6, le=1000.0)]
    """Area of the foil [m^2]."""
    deflection: tuple[Deflection, Deflection]
    """Least and greatest deflection [rad]."""
    aspect_ratio: Annotated[float, Meta(ge=0.05, le=100.0)]
    """Effective aspect ratio, 2 span^2 / area for a foil on a hull."""
    lift_slope: Slope | None = None
    """Lift coefficient per angle [1/rad]; from the aspect ratio after Whicker and Fehlner when None."""
    drag: Coefficient = 0.0065
    """Drag coefficient without lift; the default is that of a NACA 0015 section."""
    stall: Annotated[float, Meta(ge=0.08, le=1.23)] = 0.47
    """Angle between chord and flow at which the flow separates [rad]; lift then falls to that of a plate."""
    density: Annotated[float, Meta(ge=500.0, le=2000.0)] = 1000.0
    """Density of the water [kg/m^3]."""
    time_constant: Seconds = 0.1
    """Time in which the deflection comes to 63 % of a new one [s]."""
    rate: TurnRate | None = None
    """How fast the deflection changes at most [rad/s]; None where nothing limits it."""
    uncertainty: Uncertainty | None = None
    """How far its force may be from that; None where nothing is known of it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.deflection[0] < self.deflection[1]:
            low, high = map(math.degrees, self.deflection)
            raise LayoutError(
                f"expected a least below the greatest angle, got {low:g} and {high:g}", "deflection_deg"
            )

    @property
    def slope(self) -> float:
        """Lift coefficient per angle [1/rad], given or from the aspect ratio."""
        if self.lift_slope is not None:
            return self.lift_slope
        return 1.8 * math.pi * self.aspect_ratio / (math.hypot(self.aspect_ratio, 2.0) + 1.8)

    @property
    def induced(self) -> float:
        """Drag coefficient per squared lift coefficient."""
        return 1.0 / (math.pi * EFFICIENCY * self.aspect_ratio)
