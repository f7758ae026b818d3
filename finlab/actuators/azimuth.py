"""Thrusters that turn, all round or within an arc: pods, and tilts.

Command: (angle [rad], force [N], 0). Own frame: turn_axis, zero, turn_axis x zero; at the angle a
the force points along cos(a) zero + sin(a) (turn_axis x zero).
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from msgspec import Meta

from finlab.actuators import actuator
from finlab.actuators.propeller import (
    T200,
    ForceRate,
    OpenWater,
    Propeller,
    PropellerLaw,
    Threshold,
    force_words,
    form_of,
    given_force,
)
from finlab.actuators.response import Form, Group, Plane
from finlab.actuators.thrust_model import Newtons, PowerLaw, ThrustModel, check_force
from finlab.actuators.thrust_power import ThrustPower, radial_table
from finlab.arrays import Array, Values
from finlab.axes import FILE_TURN_TOLERANCE, TURN, Direction3, Vector, is_full_turn
from finlab.errors import LayoutError
from finlab.files.schema import Name

Angle = Annotated[float, Meta(ge=-TURN - 1e-9, le=TURN + 1e-9)]
AngleDegrees = Annotated[float, Meta(ge=-360.0, le=360.0)]


class AzimuthLaw(PropellerLaw):
    """The law of n turning thrusters, whose commands are angle [rad] and force [N]."""

    column = 1

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        force = np.zeros_like(command)
        size = self.given(command)
        force[..., 1] = size * np.cos(command[..., 0])
        force[..., 2] = size * np.sin(command[..., 0])
        return force

    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        force = self.force(command)
        jacobian = np.zeros((*command.shape, 3))
        jacobian[..., 0, 1] = -force[..., 2]
        jacobian[..., 0, 2] = force[..., 1]
        angle = command[..., 0]
        free = self.given(command) == command[..., 1]
        jacobian[..., 1, 1] = np.cos(angle) * free
        jacobian[..., 1, 2] = np.sin(angle) * free
        return force, jacobian


class AzimuthGroup(Group):
    """What the turning thrusters of a robot offer for prices."""

    def __init__(self, azimuths: Sequence["Azimuth"], effectiveness: Array) -> None:
        """Takes turning thrusters and the wrench (m, 3, 6) per newton along each own axis."""
        low, high = np.array([azimuth.arc for azimuth in azimuths]).T
        self._given = np.array([given_force(azimuth) for azimuth in azimuths])
        self._power = ThrustPower([azimuth.model for azimuth in azimuths])
        middle, half = _arcs(low, high)
        self.responses = [
            _plane(azimuth, matrix[1:], float(middle[i]), float(half[i]))
            for i, (azimuth, matrix) in enumerate(zip(azimuths, effectiveness, strict=True))
        ]

    @property
    def forms(self) -> list[Form]:
        return [form_of("pod", given) for given in self._given]

    def radial_worth(self, price: Array, back: Array, ends: Array | None) -> Array:
        least, most = (self._given if ends is None else ends).T
        ahead = self._power.worth(price, np.maximum(least, 0.0), np.maximum(most, 0.0))
        astern = self._power.worth(-back, np.minimum(least, 0.0), np.minimum(most, 0.0))
        either = np.maximum(ahead, astern)
        return np.where(least >= 0.0, ahead, np.where(most < 0.0, astern, either))


def _plane(azimuth: "Azimuth", matrix: Array, middle: float, half: float) -> Plane:
    """What one offers; `matrix` (2, 6) is the wrench per newton."""
    least, most = given_force(azimuth)
    if 0.0 < least < azimuth.dead_band:
        least = 0.0  # what it is told then gives no force, and takes no power
    table = radial_table(azimuth.model, 1, max(least, 0.0), max(most, 0.0))
    reverse = radial_table(azimuth.model, -1, max(-most, 0.0), -least) if least < 0.0 else None
    return Plane(matrix, table, middle, half, band=azimuth.dead_band, reverse=reverse, high=most)


def _arcs(low: Array, high: Array) -> tuple[Array, Array]:
    """Middles and halves (m,) of arcs [rad]; pi is the half of a full turn."""
    return 0.5 * (low + high), np.where(is_full_turn(high - low), 0.5 * TURN, 0.5 * (high - low))


class AzimuthCommand(
    actuator.Command, frozen=True, rename={"angle": "angle_rad", "force": "force_n"}
):
    """The command of a thruster that turns, by name."""

    angle: float
    """Angle of its force from `zero` towards turn_axis x zero [rad]."""
    force: float
    """[N]."""
    input: float | None = None
    """As for a `ThrusterCommand`."""

    @property
    def words(self) -> str:
        return force_words(self.force, f" at {math.degrees(self.angle):.1f} deg", self.input)


@dataclass(frozen=True)
class Azimuth(Propeller):
    """A thruster that turns; its command is angle and force. Checked on construction."""

    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {
        "arc": ("arc_deg", tuple[AngleDegrees, AngleDegrees]),
        "turn_rate": ("turn_rate_deg_s", actuator.TurnRateDegrees),
    }
    LAW = AzimuthLaw
    GROUP = AzimuthGroup
    NUMBERS = (("angle", "rad"), ("force", "N"))
    COMMAND = AzimuthCommand
    LIMITS = ("arc", "force")
    RATES = ("turn_rate", "rate")
    AXES = ("turn_axis", "zero")
    POINTED = 1
    PUSHES = (1, 2)
    LAGS = 1
    THRUST = 1
    ANGLE = 0
    ARC = "arc"
    FAULTS = ("weak", "stuck", "running")
    LOOKS = "pod"
    OTHER = "Turns about"
    SAMPLE_ARC: ClassVar[tuple[float, float]] = (-math.pi, math.pi)
    BOXES = (
        actuator.Box(
            "Force [N]", "force", "Least and most; above 0: it cannot stop.", 1.0, pair=True
        ),
        actuator.Box(
            "Arc [°]",
            "arc",
            "Least and greatest angle from zero; −180 to 180 is any.",
            5.0,
            True,
            pair=True,
        ),
        actuator.Box(
            "Turn rate [°/s]", "turn_rate", "How fast it turns; 0: at once.", 5.0, True, True
        ),
        *Propeller.BOXES,
    )
    type: ClassVar[str] = "azimuth"

    name: Name
    """Unique within its layout."""
    position: actuator.Place
    """Where the force acts, body frame [m]."""
    turn_axis: Direction3
    """Unit vector about which the thruster turns, body frame."""
    zero: Direction3
    """Unit vector across it: direction of the force at angle 0; it turns towards turn_axis x
    zero."""
    force: tuple[Newtons, Newtons]
    """Least and most force [N]: below 0 for one that also pushes against its angle, above 0 for one
    that cannot stop."""
    model: ThrustModel
    """What power it takes."""
    arc: tuple[Angle, Angle] = (-math.pi, math.pi)
    """Least and greatest angle [rad]; a full turn means any angle."""
    dead_band: Threshold = 0.0
    """Forces smaller than this, other than 0, cannot be held [N]."""
    torque_per_newton: actuator.Metres = 0.0
    """Reaction torque about the direction of the force, per force, signed [m]."""
    turn_rate: actuator.TurnRate | None = None
    """How fast it turns at most [rad/s]; None where nothing limits it."""
    time_constant: actuator.Seconds = 0.1
    """Time in which the force comes to 63 % of a new one [s]."""
    rate: ForceRate | None = None
    """How fast the commanded force changes at most [N/s]; None where nothing limits it."""
    uncertainty: actuator.Uncertainty | None = None
    """How far its force may be from that; None where nothing is known of it."""
    diameter: actuator.Diameter | None = None
    """Of the propeller [m], for its jet; None where it is guessed from the force."""
    open_water: OpenWater | None = None
    """Thrust coefficient at rest and the advance ratio of no thrust; None where they are
    unknown."""
    hangs: bool = False
    """Whether damage has left it a single force, that of both limits, of any sign; no file says
    so."""

    def check_together(self) -> None:
        """See `Actuator`."""
        super().check_together()
        least, most = self.force
        hangs = self.hangs and least == most
        if not hangs and not (least < most and most > 0.0):
            raise LayoutError(
                f"expected a most force above 0 and above the least, got {least:g} and {most:g}; "
                "turn `zero` "
                "round where it only pulls",
                "force",
            )
        if not hangs and self.dead_band > self.force[1]:
            raise LayoutError(
                f"leaves no force, got {self.dead_band:g} beside {self.force[1]:g} N", "dead_band"
            )
        width = self.arc[1] - self.arc[0]
        if not 0.0 <= width <= TURN + FILE_TURN_TOLERANCE:
            low, high = map(math.degrees, self.arc)
            raise LayoutError(
                f"must rise, by at most one turn, got {low:g} and {high:g} deg", "arc"
            )
        check_force(self.model, self.force)

    @classmethod
    def sample(cls) -> Self:
        """See `Actuator`: a T200 of Blue Robotics at 16 V on a pod."""
        up = (0.0, 0.0, 1.0)
        rate = math.radians(120)
        force = (0.0, 51.44)
        model = PowerLaw(T200.forward)
        return cls(
            cls.type,
            (0.0, 0.0, 0.0),
            up,
            (1.0, 0.0, 0.0),
            force,
            model,
            cls.SAMPLE_ARC,
            turn_rate=rate,
        )

    def neutral(self, now: Array | None = None) -> Array:
        """See `Actuator`: it keeps its angle."""
        row = super().neutral(now)
        if now is not None and np.isfinite(now[0]):
            row[0] = now[0]
        return row

    def damaged(self, faults: actuator.Faults) -> Self:
        left = faults.weak
        low, high = self.force
        force = (
            self.force if left is None else actuator.weakened((max(low, left * low), high), left)
        )
        angle = faults.stuck if faults.running is None else faults.running[0]
        held = replace(self, force=force, arc=actuator.held_limits(angle, self.arc))
        return held if faults.running is None else held.hung(faults.running[1])

    @property
    def joints(self) -> Iterator[tuple[str, Vector, tuple[float, float] | None]]:
        yield (
            "_mount",
            self.turn_axis,
            None if is_full_turn(self.arc[1] - self.arc[0]) else self.arc,
        )
        yield "", self.zero, None


@dataclass(frozen=True)
class Tilt(Azimuth):
    """An azimuth thruster that turns within an arc. Checked on construction."""

    type: ClassVar[str] = "tilt"
    SAMPLE_ARC = (-math.pi / 3, math.pi / 3)

    def check_together(self) -> None:
        """See `Actuator`."""
        super().check_together()
        if is_full_turn(self.arc[1] - self.arc[0]):
            raise LayoutError("is missing: the arc of a tilt is less than a full turn", "arc")
