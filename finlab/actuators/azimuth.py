"""Thrusters that turn, all round or within an arc: azimuths (pods) and tilts.

Command: (angle [rad], force [N], 0). Own frame: turn_axis, zero, turn_axis x zero; at the angle a
the force points along cos(a) zero + sin(a) (turn_axis x zero).
"""

from __future__ import annotations  # help() then prints `Newtons`, not the bounds of one

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from msgspec import Meta

from finlab import axes
from finlab.actuators.actuator import (
    ACROSS,
    Command,
    CommandNumber,
    Diameter,
    Faults,
    Kind,
    Metres,
    Place,
    Seconds,
    TurnRate,
    TurnRateDegrees,
    Uncertainty,
    held_limits,
    weakened,
)
from finlab.actuators.propeller import (
    FORMULAS,
    T200,
    T200_FORCE,
    ForceRate,
    OpenWater,
    Propeller,
    PropellerLaw,
    Threshold,
    force_words,
    form_of,
    power_law_margins,
    usable_force,
)
from finlab.actuators.response import Form, Group, Plane
from finlab.actuators.thrust_model import Newtons, PowerLaw, ThrustModel, check_force
from finlab.actuators.thrust_power import ThrustPower, radial_table
from finlab.arrays import Array, Values
from finlab.axes import FILE_TURN_TOLERANCE, TURN, Direction3, Vector3, is_full_turn
from finlab.errors import LayoutError
from finlab.files.schema import Name

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

Angle = Annotated[float, Meta(ge=-TURN - 1e-9, le=TURN + 1e-9)]
"""End of an arc [rad]; a turn in degrees, converted, may exceed `TURN` by rounding."""
AngleDegrees = Annotated[float, Meta(ge=-360.0, le=360.0)]
"""The same in a file [deg]."""
Ends = tuple[float, float]
"""Least and greatest angle of an arc [rad]."""
MOST_ARCS = 5
"""Most arcs of one azimuth; the core has room for the zones between so many."""
# msgspec 0.22 misreads a tuple of fixed length within a union: these pairs have bounds of length.
Arc = Annotated[
    tuple[Angle | Annotated[tuple[Angle, ...], Meta(min_length=2, max_length=2)], ...],
    Meta(min_length=1, max_length=MOST_ARCS),
]
"""Least and greatest angle [rad], or several such pairs."""
ArcDegrees = Annotated[
    tuple[
        AngleDegrees | Annotated[tuple[AngleDegrees, ...], Meta(min_length=2, max_length=2)], ...
    ],
    Meta(min_length=1, max_length=MOST_ARCS),
]
"""The same in a file [deg]."""


class AzimuthLaw(PropellerLaw):
    """Law of n turning thrusters: at angle a [rad] the force T [N] is T (cos a, sin a) along the
    second and third own axis."""

    column = 1
    formula_kind = "FL_TURNING_PROPELLER"

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        force = np.zeros_like(command)
        thrust = self.thrust(command)
        force[..., 1] = thrust * np.cos(command[..., 0])
        force[..., 2] = thrust * np.sin(command[..., 0])
        return force

    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        force = self.force(command)
        jacobian = np.zeros((*command.shape, 3))
        jacobian[..., 0, 1] = -force[..., 2]
        jacobian[..., 0, 2] = force[..., 1]
        angle = command[..., 0]
        # In the dead band the force does not follow its command.
        is_outside = self.thrust(command) == command[..., 1]
        jacobian[..., 1, 1] = np.cos(angle) * is_outside
        jacobian[..., 1, 2] = np.sin(angle) * is_outside
        return force, jacobian


class AzimuthGroup(Group):
    """Responses to prices of m turning thrusters (Eq. 5)."""

    def __init__(self, azimuths: Sequence[Azimuth], effectiveness: Array) -> None:
        """Tabulates the responses.

        Args:
            azimuths: m turning thrusters.
            effectiveness: wrench (m, 3, 6) of 1 N along each own axis [1, m], body frame.
        """
        low = np.array([azimuth.lower[0] for azimuth in azimuths])
        high = np.array([azimuth.upper[0] for azimuth in azimuths])
        self._limits = np.array([usable_force(azimuth) for azimuth in azimuths])
        self._power = ThrustPower([azimuth.model for azimuth in azimuths])
        self._margins = power_law_margins(azimuths)
        center, half_angle = _arcs(low, high)
        self.responses = []
        for i, azimuth in enumerate(azimuths):
            matrix = effectiveness[i, 1:]
            self.responses.append(_plane(azimuth, matrix, float(center[i]), float(half_angle[i])))

    @property
    def conjugate_margins(self) -> list[Array | None]:
        return self._margins

    @property
    def forms(self) -> list[Form]:
        return [form_of("pod", limits, turning_costs=True) for limits in self._limits]

    def radial_conjugate_bound(
        self, price: Array, price_reverse: Array, force_limits: Array
    ) -> Array:
        least, most = force_limits.T
        ahead = self._power.conjugate(price, np.maximum(least, 0.0), np.maximum(most, 0.0))
        astern = self._power.conjugate(
            -price_reverse, np.minimum(least, 0.0), np.minimum(most, 0.0)
        )
        either = np.maximum(ahead, astern)
        return np.where(least >= 0.0, ahead, np.where(most < 0.0, astern, either))


def _plane(azimuth: Azimuth, matrix: Array, center: float, half_angle: float) -> Plane:
    """Response of one turning thruster; `matrix` (2, 6) is its wrench per newton [1, m] along its
    second and third own axis, `center` and `half_angle` are those of its arc [rad]."""
    least, most = usable_force(azimuth)
    if 0.0 < least < azimuth.dead_band:
        least = 0.0  # a command within the dead band gives no force, and takes no power
    table = radial_table(azimuth.model, 1, max(least, 0.0), max(most, 0.0))
    reverse = radial_table(azimuth.model, -1, max(-most, 0.0), -least) if least < 0.0 else None
    return Plane(
        matrix,
        table,
        center,
        half_angle,
        dead_band=azimuth.dead_band,
        reverse=reverse,
        high=most,
        barred=getattr(azimuth, "barred", ()),  # a kind of another package may have one arc
    )


def _pairs(arc: tuple[Any, ...]) -> tuple[Ends, ...]:
    """Pairs of ends of an arc, or of several."""
    return arc if isinstance(arc[0], tuple) else (arc,)


def _arcs(low: Array, high: Array) -> tuple[Array, Array]:
    """Centers and half angles (m,) of arcs from `low` to `high` (m,) [rad]; pi is the half of a
    full turn."""
    half_angle = np.where(is_full_turn(high - low), 0.5 * TURN, 0.5 * (high - low))
    return 0.5 * (low + high), half_angle


class AzimuthCommand(Command, frozen=True, rename={"angle": "angle_rad", "force": "force_n"}):
    """The command of a thruster that turns, by name."""

    angle: float
    """Angle of its force from `zero` towards turn_axis x zero [rad]."""
    force: float
    """Force along that direction, signed [N]."""
    input: float | None = None
    """Input for that force by its table, in the table's unit; None of one with a power law."""

    @property
    def words(self) -> str:
        return force_words(self.force, f" at {math.degrees(self.angle):.1f} deg", self.input)


@dataclass(frozen=True)
class Azimuth(Propeller):
    """A thruster that turns; its command is angle and force. Checked on construction.

    Args:
        name: unique within its layout.
        position: where the force acts, body frame [m].
        turn_axis: axis about which it turns, unit vector, body frame [1].
        zero: direction of the force at angle 0, unit vector, body frame [1]; it turns towards
            turn_axis x zero.
        force: least and most force [N]: the least below 0 where it also pushes against its
            direction, above 0 where it cannot stop.
        model: electrical power over the force [W]: `PowerLaw` or `PowerTable`.
        arc: least and greatest angle [rad]; a full turn means any angle. Or several such pairs, one
            above the other, for one that pushes ahead only: it may be at any angle of any of them,
            and in a tick it stays in its arc but where its rate takes it past the zone between.
        dead_band: forces smaller than this, other than 0, cannot be held [N].
        torque_per_newton: reaction torque about the direction of the force, per force, signed [m].
        turn_rate: largest change of the angle [rad/s]; None: nothing limits it.
        time_constant: time in which the force comes to 63 % of a new command [s].
        rate: largest change of the commanded force [N/s]; None: nothing limits it.
        uncertainty: standard deviation of its force [N]; None: nothing is known of it.
        diameter: diameter of the propeller, for its jet [m]; None: estimated from the force.
        open_water: thrust coefficient at rest, and the advance ratio of no thrust [1]; None:
            unknown.
        hangs: whether damage has left it a single force of any sign, that of both limits (a truth
            value, which no file has).

    Raises:
        LayoutError: a value is out of its bounds; the message names the argument.
    """

    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {
        "arc": ("arc_deg", ArcDegrees),
        "turn_rate": ("turn_rate_deg_s", TurnRateDegrees),
    }
    SAMPLE_ARC: ClassVar[tuple[float, float]] = (-math.pi, math.pi)
    """Arc of one as the app adds it [rad]."""
    type: ClassVar[str] = "azimuth"
    KIND: ClassVar[Kind] = Kind(
        law=AzimuthLaw,
        group=AzimuthGroup,
        command=AzimuthCommand,
        numbers=(
            CommandNumber(
                name="angle", unit="rad", limits="turn_range", rate="turn_rate", aims=True
            ),
            CommandNumber(name="force", unit="N", limits="force", rate="rate", lags=True),
        ),
        axes=("turn_axis", "zero"),
        pushes_along=("zero", ACROSS),
        pointed="zero",
        drawn_as="pod",
        faults=("weak", "stuck", "running"),
        arc="arc",
        models=FORMULAS,
    )

    name: Name
    position: Place
    turn_axis: Direction3
    zero: Direction3
    force: tuple[Newtons, Newtons]
    model: ThrustModel
    arc: Arc = (-math.pi, math.pi)
    dead_band: Threshold = 0.0
    torque_per_newton: Metres = 0.0
    turn_rate: TurnRate | None = None
    time_constant: Seconds = 0.1
    rate: ForceRate | None = None
    uncertainty: Uncertainty | None = None
    diameter: Diameter | None = None
    open_water: OpenWater | None = None
    hangs: bool = False

    def check_together(self) -> None:
        """See `Actuator`."""
        super().check_together()
        least, most = self.force
        hangs = self.hangs and least == most  # damage may leave a force of any sign
        if not hangs and not (least < most and most > 0.0):
            raise LayoutError(
                f"expected a most force above 0 and above the least, got {least:g} and {most:g}; "
                "turn `zero` round where it only pulls",
                "force",
            )
        if not hangs and self.dead_band > self.force[1]:
            raise LayoutError(
                f"leaves no force, got {self.dead_band:g} beside {self.force[1]:g} N", "dead_band"
            )
        self._check_arcs()
        check_force(self.model, self.force)

    def _check_arcs(self) -> None:
        """Checks the arcs against each other. Raises LayoutError."""
        is_pair = [isinstance(item, tuple) for item in self.arc]
        if any(is_pair) and not all(is_pair):
            raise LayoutError("expected two numbers, or several pairs of two, got both", "arc")
        if not any(is_pair) and len(self.arc) != 2:
            raise LayoutError(f"expected two numbers, got {len(self.arc)}", "arc")
        if len(self.arc) == 1:
            object.__setattr__(self, "arc", self.arc[0])
        ends = [angle for arc in _pairs(self.arc) for angle in arc]
        low, high = ends[0], ends[-1]
        is_rising = all(first <= second for first, second in itertools.pairwise(ends))
        if not is_rising or high - low > TURN + FILE_TURN_TOLERANCE:
            words = ", ".join(f"{math.degrees(end):g}" for end in ends)
            words = words if len(ends) > 2 else words.replace(", ", " and ")
            raise LayoutError(
                f"must rise, by at most one turn, got {words} deg; put the arcs in order, and join "
                "those that overlap",
                "arc",
            )
        if self.barred and self.force[0] < 0.0:
            raise LayoutError(
                f"several arcs are of one that pushes ahead only, got a least force of "
                f"{self.force[0]:g} N; expected 0 or more",
                "arc",
            )

    @property
    def arcs(self) -> tuple[Ends, ...]:
        """Arcs of its angle [rad], ascending; the first and the last are one where they meet, a
        turn apart."""
        pairs = _pairs(self.arc)
        joined: list[Ends] = []
        for low, high in pairs:
            if joined and low - joined[-1][1] <= FILE_TURN_TOLERANCE:
                joined[-1] = (joined[-1][0], high)
            else:
                joined.append((low, high))
        if len(joined) > 1 and is_full_turn(joined[-1][1] - joined[0][0]):
            first_high = joined[0][1] + TURN
            joined = [*joined[1:-1], (joined[-1][0], first_high)]
        return tuple(joined)

    @property
    def turn_range(self) -> Ends:
        """Least and greatest angle of all its arcs [rad]."""
        arcs = self.arcs
        return arcs[0][0], arcs[-1][1]

    @property
    def barred(self) -> tuple[Ends, ...]:
        """Zones between its arcs [rad], ascending."""
        zones = []
        for below, above in itertools.pairwise(self.arcs):
            zones.append((below[1], above[0]))
        return tuple(zones)

    @classmethod
    def sample(cls) -> Self:
        """See `Actuator`: a T200 of Blue Robotics at 16 V on a pod."""
        return cls(
            name=cls.type,
            position=(0.0, 0.0, 0.0),
            turn_axis=(0.0, 0.0, 1.0),
            zero=(1.0, 0.0, 0.0),
            force=(0.0, T200_FORCE),
            model=PowerLaw(T200.forward),
            arc=cls.SAMPLE_ARC,
            turn_rate=math.radians(120),
        )

    def neutral(self, now: Array | None = None) -> Array:
        """See `Actuator`: it keeps its angle."""
        row = super().neutral(now)
        if now is not None and np.isfinite(now[0]):
            row[0] = now[0]
        return row

    def damaged(self, faults: Faults) -> Self:
        force = self.force
        if faults.weak is not None:
            low, high = force
            force = weakened((max(low, faults.weak * low), high), faults.weak)
        angle = faults.stuck if faults.running is None else faults.running[0]
        arc = self.arc if angle is None else held_limits(angle, self.turn_range)
        left = replace(self, force=force, arc=arc)
        return left if faults.running is None else left.hung(faults.running[1])

    def angle_words(self, low: float, high: float) -> str:
        """See `Actuator`: all arcs."""
        if not self.barred:
            return super().angle_words(low, high)
        return " and ".join(axes.arc_words(*arc) for arc in self.arcs)

    @property
    def joints(self) -> Iterator[tuple[str, Vector3, tuple[float, float] | None]]:
        low, high = self.turn_range
        limits = None if is_full_turn(high - low) else (low, high)
        yield "_mount", self.turn_axis, limits
        yield "", self.zero, None


@dataclass(frozen=True)
class Tilt(Azimuth):
    """An azimuth thruster that turns within an arc. Checked on construction.

    Args:
        name: unique within its layout.
        position: where the force acts, body frame [m].
        turn_axis: axis about which it turns, unit vector, body frame [1].
        zero: direction of the force at angle 0, unit vector, body frame [1].
        arc: least and greatest angle [rad]; it has to be given.
        force: least and most force [N].
        model: electrical power over the force [W].
        dead_band: forces smaller than this, other than 0, cannot be held [N].
        torque_per_newton: reaction torque about the direction of the force, per force, signed [m].
        turn_rate: largest change of the angle [rad/s].
        time_constant: time in which the force comes to 63 % of a new command [s].
        rate: largest change of the commanded force [N/s].
        uncertainty: standard deviation of its force [N].
        diameter: diameter of the propeller [m].
        open_water: thrust coefficient at rest, and the advance ratio of no thrust [1].
        hangs: whether damage has left it a single force, as of an `Azimuth` (a truth value).

    Raises:
        LayoutError: a value is out of its bounds, or the arc is a full turn; the message names the
            argument.
    """

    type: ClassVar[str] = "tilt"
    SAMPLE_ARC = (-math.pi / 3, math.pi / 3)

    def check_together(self) -> None:
        """See `Actuator`."""
        super().check_together()
        low, high = self.turn_range
        if is_full_turn(high - low):
            raise LayoutError("is missing: the arc of a tilt is less than a full turn", "arc")
