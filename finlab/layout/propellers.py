"""Thrusters: with an axis fixed in the robot, or with one that turns (azimuth, tilt)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from finlab.errors import LayoutError
from finlab.layout.axes import FILE_TURN_TOLERANCE, TURN, Direction3, Vector, cross, is_full_turn, unit_vector
from finlab.layout.checked import Name
from finlab.layout.commanded import Commanded, Uncertainty
from finlab.layout.thrust_model import KEYS, MAX_FORCE, Newtons, ThrustModel, check_force

Metres = Annotated[float, Meta(ge=-100.0, le=100.0)]
"""A coordinate of a place on a robot, or an arm of torque [m]."""
Place = tuple[Metres, Metres, Metres]
Seconds = Annotated[float, Meta(ge=0.0, le=1000.0)]
ForceRate = Annotated[float, Meta(ge=1e-6, le=1e9)]
Threshold = Annotated[float, Meta(ge=0.0, le=MAX_FORCE)]


@dataclass(frozen=True)
class Thruster(Commanded):
    """A thruster with a fixed axis; its command is the force. Checked on construction."""

    KEYS: ClassVar[Mapping[str, str]] = KEYS
    LIMITS, RATES, PUSHES = ("force",), ("rate",), (0,)
    type: ClassVar[str] = "thruster"

    name: Name
    """Unique within its layout."""
    position: Place
    """Where the force acts, body frame [m]."""
    axis: Direction3
    """Unit vector, body frame: direction of the force on the robot for a positive force."""
    force: tuple[Newtons, Newtons]
    """Least and most force [N]; one of them is 0 where the thruster pushes one way only."""
    model: ThrustModel
    """What power it takes."""
    dead_band: Threshold = 0.0
    """Forces smaller than this, other than 0, cannot be held [N]."""
    torque_per_newton: Metres = 0.0
    """Reaction torque about the axis per force, signed [m]."""
    time_constant: Seconds = 0.1
    """Time in which the force comes to 63 % of a new one [s]."""
    rate: ForceRate | None = None
    """How fast the commanded force changes at most [N/s]; None where nothing limits it."""
    uncertainty: Uncertainty | None = None
    """How far its force may be from that; None where nothing is known of it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "axis", unit_vector("axis", self.axis))
        least, most = self.force
        if not least <= 0.0 <= most or least == most:
            raise LayoutError(
                f"must include 0, and more than that, got {least:g} and {most:g}",
                "force_n",
            )
        if self.dead_band > max(-least, most):
            raise LayoutError(
                f"leaves no force, got {self.dead_band:g} beside {least:g} .. {most:g} N", "dead_band_n"
            )
        check_force(self.model, self.force)

    @property
    def frame(self) -> tuple[Vector, Vector, Vector]:
        """Own axes in the body frame: the axis, and two across it."""
        first, across = self.axis, [0.0, 0.0, 0.0]
        across[min(range(3), key=lambda i: abs(first[i]))] = 1.0
        x, y, z = cross(first, (across[0], across[1], across[2]))
        size = math.hypot(x, y, z)
        second = x / size, y / size, z / size
        return first, second, cross(first, second)


Angle = Annotated[float, Meta(ge=-TURN - 1e-9, le=TURN + 1e-9)]
TurnRate = Annotated[float, Meta(ge=1e-3, le=1000.0)]
AngleDegrees = Annotated[float, Meta(ge=-360.0, le=360.0)]
TurnRateDegrees = Annotated[float, Meta(ge=0.06, le=57000.0)]


@dataclass(frozen=True)
class Azimuth(Commanded):
    """A thruster that turns; its command is angle and force. Checked on construction."""

    KEYS: ClassVar[Mapping[str, str]] = KEYS
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {
        "arc": ("arc_deg", tuple[AngleDegrees, AngleDegrees]),
        "turn_rate": ("turn_rate_deg_s", TurnRateDegrees),
    }
    LIMITS, RATES, AXES = ("arc", "force"), ("turn_rate", "rate"), ("turn_axis", "zero")
    PUSHES, LAGS = (1, 2), 1
    type: ClassVar[str] = "azimuth"

    name: Name
    """Unique within its layout."""
    position: Place
    """Where the force acts, body frame [m]."""
    turn_axis: Direction3
    """Unit vector about which the thruster turns, body frame."""
    zero: Direction3
    """Unit vector across it: direction of the force at angle 0; it turns towards turn_axis x zero."""
    force: tuple[Newtons, Newtons]
    """Least and most force [N]: below 0 for one that also pushes against its angle, above 0 for one that
    cannot stop."""
    model: ThrustModel
    """What power it takes."""
    arc: tuple[Angle, Angle] = (-math.pi, math.pi)
    """Least and greatest angle [rad]; a full turn means any angle."""
    dead_band: Threshold = 0.0
    """Forces smaller than this, other than 0, cannot be held [N]."""
    torque_per_newton: Metres = 0.0
    """Reaction torque about the direction of the force, per force, signed [m]."""
    turn_rate: TurnRate | None = None
    """How fast it turns at most [rad/s]; None where nothing limits it."""
    time_constant: Seconds = 0.1
    """Time in which the force comes to 63 % of a new one [s]."""
    rate: ForceRate | None = None
    """How fast the commanded force changes at most [N/s]; None where nothing limits it."""
    uncertainty: Uncertainty | None = None
    """How far its force may be from that; None where nothing is known of it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        least, most = self.force
        if not (least < most and most > 0.0):
            raise LayoutError(
                f"expected a most force above 0 and above the least, got {least:g} and {most:g}; turn `zero` "
                "round where it only pulls",
                "force_n",
            )
        if self.dead_band > self.force[1]:
            raise LayoutError(
                f"leaves no force, got {self.dead_band:g} beside {self.force[1]:g} N", "dead_band_n"
            )
        width = self.arc[1] - self.arc[0]
        if not 0.0 <= width <= TURN + FILE_TURN_TOLERANCE:
            low, high = map(math.degrees, self.arc)
            raise LayoutError(f"must rise, by at most one turn, got {low:g} and {high:g}", "arc_deg")
        check_force(self.model, self.force)


@dataclass(frozen=True)
class Tilt(Azimuth):
    """An azimuth thruster that turns within an arc. Checked on construction."""

    type: ClassVar[str] = "tilt"

    def __post_init__(self) -> None:
        super().__post_init__()
        if is_full_turn(self.arc[1] - self.arc[0]):
            raise LayoutError(
                "required key is missing: the arc of a tilt is less than a full turn", "arc_deg"
            )
