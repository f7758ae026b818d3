"""A propeller with a rudder in its slipstream, as one actuator: it steers at rest, too.

Command: (deflection [rad], thrust [N], 0). Own frame: shaft of the rudder, zero (the chord at
deflection 0, and the direction of the thrust), and shaft x zero.

Behind a disc of area A that gives the thrust T, the water is faster than the flow V that meets the
disc from ahead: V_inf^2 = V^2 + 2 T / (rho A), by momentum theory (Brix, 1993;
Bertram, 2012, chapter 6). Of what the slipstream adds to the dynamic pressure the share k meets
the rudder, on the mean over its area S: 1/2 rho V_R^2 = 1/2 rho V^2 + k T / A. With the
coefficients of lift and drag of `rudder.py` at the deflection d, the force is

    F = (T, 0) + 1/2 rho V_R^2 S (-CD(d), CL(d)).

With sigma = k S / A and p = rho V^2 A / (2 k), the thrust whose slipstream would be as fast as the
flow, that is F = (T + p) g(d) - (p, 0), where g(d) = (1 - sigma CD(d), sigma CL(d)). So at each
speed the forces are those of a pod whose largest force depends on its direction, beside a drag. At
rest p = 0. Where the thrust is negative the propeller draws water from behind, and no slipstream
meets the rudder: F = (T, 0).

The flow counts along zero alone: how drift turns the slipstream is left out, as is its swirl.
"""

from __future__ import annotations  # help() then prints `Newtons`, not the bounds of one

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import numpy as np
from msgspec import Meta

from finlab.actuators.actuator import (
    ACROSS,
    Command,
    CommandNumber,
    Diameter,
    Faults,
    Kind,
    Place,
    Seconds,
    TurnRate,
    TurnRateDegrees,
    Uncertainty,
    held_limits,
    weakened,
)
from finlab.actuators.hermite_grid import grid_numbers
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.propeller import (
    FORMULAS,
    T200,
    T200_DIAMETER,
    T200_FORCE,
    T200_FORCE_ASTERN,
    ForceRate,
    Propeller,
    force_words,
    scaled_model,
)
from finlab.actuators.response import POINTS, Form, Group, Plane, RadialTable
from finlab.actuators.rudder import (
    PEAK,
    Area,
    AspectRatio,
    Coefficient,
    Coefficients,
    Deflection,
    DeflectionDegrees,
    Density,
    Rudder,
    RudderLaw,
    Slope,
    StallAngle,
    StallDegrees,
)
from finlab.actuators.thrust_model import Newtons, ThrustModel, check_force
from finlab.actuators.thrust_power import ThrustPower, radial_table
from finlab.arrays import AnyArray, Array, Values
from finlab.axes import MIN_LENGTH, TURN, Direction3, Vector3, arc_words, wrapped
from finlab.errors import LayoutError
from finlab.files.schema import Name

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

CURVE_ANGLES = 1025
"""Deflections of the rudder between the ends of its arc, from which angles of the force are turned
into deflections."""
LAW_ANGLES = 2049
"""Deflections from -90 to 90 deg of the grid from which the core evaluates the law."""
BEYOND_ENDS = 2e-4
"""Angle [rad] by which the core's curve goes on beyond the ends of the arc: what lies beyond is
then told from an end itself, in single precision too."""
OFFSET = -1.0
"""Drag coefficient by which the core takes the offset (-p, 0) of a lost one off."""
SEARCHED = 65
"""Deflections in each of the searches for the one that is worth most at a price."""

Share = Annotated[float, Meta(ge=1e-3, le=1.0)]
"""A share of the slipstream's dynamic pressure [1]."""


def _direction_of(foil: Coefficients, sigma: Array | float) -> Array:
    """g = (1 - sigma CD, sigma CL) (..., n, 2) by the coefficients (..., n) of the rudders."""
    return np.stack([1.0 - sigma * foil.drag, sigma * foil.lift], axis=-1)


class SteeredLaw(ActuatorLaw):
    """Law of n propellers with a rudder in the slipstream; see the module."""

    feels_flow = True

    def __init__(self, units: Sequence[PropellerRudder]) -> None:
        """Takes n of them."""
        self._foil = RudderLaw([unit.rudder for unit in units])
        self._power = ThrustPower([unit.model for unit in units])
        self.race_area = np.array([unit.race_area for unit in units])
        """sigma (n,) = k S / A [1]."""
        self._half_density_area = np.array([unit.half_density_area for unit in units])

    def slipstream_of_flow(self, inflow: Array | None) -> Array | float:
        """Returns p (..., n) [N], the thrust whose slipstream is as fast as the flow, by the
        velocities (..., n, 3) of the points through the water, own frames [m/s]; 0 at rest."""
        if inflow is None:
            return 0.0
        V = np.maximum(inflow[..., 1], 0.0)
        return np.asarray(self._half_density_area * V**2)

    def direction(self, deflection: Array) -> tuple[Array, Array]:
        """Returns g = (1 - sigma CD, sigma CL) of deflections (..., n) [rad], and its derivative
        by the deflection [1/rad], both (..., n, 2)."""
        foil: Coefficients = self._foil.coefficients(deflection)
        sigma = self.race_area
        g = _direction_of(foil, sigma)
        slope = np.stack([-sigma * foil.drag_slope, sigma * foil.lift_slope], axis=-1)
        return g, slope

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        return self.force_and_jacobian(command, inflow)[0]

    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        g, slope = self.direction(command[..., 0])
        T = command[..., 1]
        p = self.slipstream_of_flow(inflow)
        slipstream = np.asarray(T + p)
        is_ahead = slipstream >= 0.0
        straight = np.array([1.0, 0.0])
        g = np.where(is_ahead[..., None], g, straight)
        slope = np.where(is_ahead[..., None], slope, 0.0)

        # (T + p) g - (p, 0) = (T, 0) + (T + p) (g - (1, 0)), without the difference of two p.
        force = np.zeros((*slipstream.shape, 3))
        force[..., 1:] = slipstream[..., None] * (g - straight)
        force[..., 1] += T
        jacobian = np.zeros((*slipstream.shape, 3, 3))
        jacobian[..., 0, 1:] = slipstream[..., None] * slope
        jacobian[..., 1, 1:] = g
        return force, jacobian

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`: electrical power of the propeller; turning the rudder takes none."""
        return self._power.watts(command[..., 1])

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        gradient = np.zeros(command.shape)
        gradient[..., 1] = self._power.marginal(command[..., 1])
        return gradient


@dataclass(frozen=True)
class ShiftedPower:
    """Power of a propeller over the thrust of its slipstream, T + p.

    Args:
        model: power over the thrust T.
        shift: p [N].
    """

    model: ThrustModel
    shift: float

    def power_and_marginal_cost(self, force: AnyArray) -> tuple[AnyArray, AnyArray]:
        """See `PowerCurve`."""
        power = ThrustPower([self.model])
        thrust = np.asarray(force - self.shift)[..., None]
        return power.watts(thrust)[..., 0], power.marginal(thrust)[..., 0]

    def response(self, price: Array) -> Array:
        """See `PowerCurve`."""
        thrust = ThrustPower([self.model]).response(price[..., None])[..., 0]
        return np.asarray(thrust + self.shift)


class Arc(NamedTuple):
    """The directions in which one of them pushes ahead, within the limits of its rudder."""

    center: float
    """Middle of the angles of the force [rad]."""
    half_angle: float
    """Half of their range [rad]."""
    gauge: Array
    """|g| (POINTS,) in each direction around the circle, from 0 on [1]."""
    curve: Array
    """Angles of the force, rising, the deflections there, both [rad], and |g| [1] (CURVE_ANGLES,
    3)."""
    ends: Array
    """Angle of the force and deflection (2, 2) [rad] a little beyond both ends, for the core."""
    law: Array
    """g over all deflections, as a grid for the core."""


class SteeredGroup(Group):
    """Responses to prices of m propellers with a rudder in the slipstream (Eq. 5)."""

    feels_flow = True

    def __init__(self, units: Sequence[PropellerRudder], effectiveness: Array) -> None:
        """Tabulates the responses at rest.

        Args:
            units: m of them.
            effectiveness: wrench (m, 3, 6) of 1 N along each own axis [1, m], body frame.
        """
        self._units = units
        self._law = SteeredLaw(units)
        self._effectiveness = effectiveness[:, 1:]
        self._power = ThrustPower([unit.model for unit in units])
        self._arcs = [_arc_of(unit.rudder, unit.race_area) for unit in units]
        self._deflection = np.array([unit.deflection for unit in units])
        self._set_flow(np.zeros(len(units)))

    def at(self, inflow: Array | None) -> SteeredGroup:
        other = copy(self)
        p = self._law.slipstream_of_flow(inflow)
        other._set_flow(np.broadcast_to(p, len(self._units)))
        return other

    def _set_flow(self, p: Array) -> None:
        """Takes p (m,) [N], the thrust whose slipstream is as fast as the flow."""
        self._slipstream = p
        self.responses = []
        for unit, arc, own_p, matrix in zip(
            self._units, self._arcs, p.tolist(), self._effectiveness, strict=True
        ):
            self.responses.append(_plane(unit, arc, own_p, matrix))

    @property
    def wrench_offset_at_rest(self) -> Array:
        """See `Group`: -p along zero."""
        return np.asarray(-self._slipstream[:, None] * self._effectiveness[:, 0])

    def wrench_offset_of(self, force: Array) -> Array:
        """See `Group`: the same at any force."""
        return np.broadcast_to(self.wrench_offset_at_rest.sum(axis=0), (len(force), 6))

    def conjugate_bound(self, price: Array) -> Array:
        """See `Group`: by the law, at the deflection that is worth most.

        Ahead, v (T + p) - P(T) rises with v = s.g, so that the largest v counts.
        """
        s = np.einsum("mkw,nw->nmk", self._effectiveness, price)
        v = self._largest_price(s)
        p = self._slipstream
        least = np.array([unit.force[0] for unit in self._units])
        most = np.array([unit.force[1] for unit in self._units])
        ahead = v * p + self._power.conjugate(v, np.clip(-p, least, most), most)
        straight = s[..., 0]
        astern = straight * p + self._power.conjugate(straight, least, np.clip(-p, least, most))
        ahead = np.where(most + p >= 0.0, ahead, -np.inf)
        astern = np.where(least + p < 0.0, astern, -np.inf)
        return np.asarray(np.maximum(ahead, astern))

    def _largest_price(self, s: Array) -> Array:
        """The largest s.g (N, m) [W/N] over all deflections, at prices s (N, m, 2) along zero and
        across; by searches, each around the best deflection of the last, and by the parabola
        through the best of the last one."""
        low = self._deflection[:, 0] + 0.0 * s[..., 0]
        high = self._deflection[:, 1] + 0.0 * s[..., 0]
        for _ in range(3):
            step = (high - low) / (SEARCHED - 1)
            deflection = low + step * np.arange(SEARCHED)[:, None, None]
            g, _ = self._law.direction(deflection)
            paid = (g * s).sum(axis=-1)
            best = np.clip(paid.argmax(axis=0)[None], 1, SEARCHED - 2)
            middle = np.take_along_axis(deflection, best, axis=0)[0]
            low = middle - step
            high = middle + step

        before = np.take_along_axis(paid, best - 1, axis=0)[0]
        at_best = np.take_along_axis(paid, best, axis=0)[0]
        after = np.take_along_axis(paid, best + 1, axis=0)[0]
        slope = 0.5 * (after - before)
        curvature = before - 2.0 * at_best + after
        x = np.where(curvature < 0.0, -slope / np.where(curvature < 0.0, curvature, 1.0), 0.0)
        x = np.clip(x, -1.0, 1.0)
        peak = at_best + x * (slope + 0.5 * x * curvature)
        return np.asarray(np.maximum(paid.max(axis=0), peak))

    @property
    def forms(self) -> list[Form]:
        forms = []
        for arc, p in zip(self._arcs, self._slipstream.tolist(), strict=True):
            form = Form(
                "steered",
                law=arc.law,
                command_table=arc.ends,
                command_table_count=len(arc.ends),
                pressure_area=p,
                zero_lift_drag=OFFSET,
            )
            forms.append(form)
        return forms


def _plane(unit: PropellerRudder, arc: Arc, p: float, matrix: Array) -> Plane:
    """Response of one of them in a flow.

    Args:
        unit: propeller and rudder.
        arc: of its force at full deflection.
        p: thrust whose slipstream is as fast as the flow [N].
        matrix: wrench (2, 6) per newton along zero and across [1, m].
    """
    least, most = unit.force
    if p > 0.0 and least < 0.0 < most:
        least = 0.0  # a propeller that is astern against the flow is known of too little
    ahead = _table(unit.model, p, 1, max(least + p, 0.0), max(most + p, 0.0))
    reverse = None
    if least + p < 0.0:
        reverse = _table(unit.model, p, -1, max(-most - p, 0.0), -least - p)
    return Plane(
        matrix, ahead, arc.center, arc.half_angle, arc.gauge, reverse=reverse, high=most + p
    )


def _table(model: ThrustModel, p: float, sign: int, least: float, most: float) -> RadialTable:
    """Force over price of a slipstream's thrust between two sizes [N], ahead (1) or astern (-1)."""
    power = model if p == 0.0 else ShiftedPower(model, p)
    return radial_table(power, sign, least, most)


@lru_cache(maxsize=256)
def _arc_of(rudder: Rudder, race_area: float) -> Arc:
    """The directions in which a rudder in a slipstream pushes; `race_area` is sigma [1]."""
    law = RudderLaw([rudder])

    def direction(deflection: Array) -> Array:
        """g (K, 2) of deflections (K,) [rad]."""
        return _direction_of(law.coefficients(deflection[:, None]), race_area)[:, 0]

    # The core uses a rudder up to the peak of its lift; beyond it the same force takes more drag.
    peak = _angle_of_peak(law)
    low, high = rudder.deflection
    used_low = min(max(low, -peak), max(high, -peak))
    used_high = max(min(high, peak), min(low, peak))

    def rows(deflection: Array) -> Array:
        """Angle of the force, deflection, and |g| (K, 3) of deflections (K,)."""
        g = direction(deflection)
        return np.stack([np.arctan2(g[:, 1], g[:, 0]), deflection, np.hypot(*g.T)], axis=1)

    curve = rows(np.linspace(used_low, used_high, CURVE_ANGLES))
    first, last = curve[[0, -1], 0].tolist()
    around = wrapped(np.arange(POINTS) * (TURN / POINTS))
    gauge = np.interp(around, curve[:, 0], curve[:, 2])
    ends = rows(np.array([used_low - BEYOND_ENDS, used_high + BEYOND_ENDS]))[:, :2]

    knots = np.linspace(-0.5 * np.pi, 0.5 * np.pi, LAW_ANGLES)
    no_axis = np.zeros(1)
    grid = grid_numbers((no_axis, no_axis, knots), direction(knots)[None, None])
    return Arc(0.5 * (first + last), 0.5 * (last - first), gauge, curve, ends, grid)


def _angle_of_peak(law: RudderLaw) -> float:
    """The deflection [rad] at which a foil has `PEAK` of its largest lift before stall: beyond it
    drag grows so fast beside lift that |g| falls within less than a step of the gauge."""
    angle = np.linspace(0.0, 0.5 * np.pi, LAW_ANGLES)
    lift = law.coefficients(angle[:, None]).lift[:, 0]
    falls = np.append(np.diff(lift) <= 0.0, True)
    largest = lift[int(np.argmax(falls))]
    return float(angle[int(np.argmax(lift >= PEAK * largest))])


class SteeredCommand(
    Command, frozen=True, rename={"deflection": "deflection_rad", "force": "force_n"}
):
    """The command of a propeller with a rudder, by name."""

    deflection: float
    """Angle of the rudder's chord from `zero` towards shaft x zero [rad]."""
    force: float
    """Thrust of the propeller along `zero`, signed [N]."""
    input: float | None = None
    """Input for that thrust by its table, in the table's unit; None of one with a power law."""

    @property
    def words(self) -> str:
        angle = f", rudder {math.degrees(self.deflection):.1f} deg"
        return force_words(self.force, angle, self.input)


@dataclass(frozen=True)
class PropellerRudder(Propeller):
    """A propeller with a rudder in its slipstream; its command is the rudder's deflection and the
    thrust. Checked on construction.

    Args:
        name: unique within its layout.
        position: centre of pressure of the rudder, straight behind the propeller, body frame [m].
        shaft: axis of the rudder's shaft, unit vector, body frame [1].
        zero: direction of a positive thrust, and from the trailing to the leading edge of the
            rudder at deflection 0, unit vector across the shaft, body frame [1]; the rudder turns
            towards shaft x zero.
        force: least and most thrust [N]; in reverse nothing meets the rudder.
        model: electrical power over the thrust [W]: `PowerLaw` or `PowerTable`.
        diameter: diameter D of the propeller, whose disc is pi D^2 / 4 [m].
        area: area S of the rudder [m^2].
        aspect_ratio: effective aspect ratio of the rudder, 2 span^2 / area for one on a hull [1].
        deflection: least and greatest deflection [rad].
        slipstream: share k of the dynamic pressure that the slipstream adds, far behind the
            propeller, which meets the rudder, on the mean over its area [1]: 1 of one that lies
            in it whole.
        lift_slope: derivative of the lift coefficient by the angle [1/rad]; None: by the aspect
            ratio, after Whicker and Fehlner.
        drag: drag coefficient without lift [1].
        stall: angle between chord and flow at which the flow separates [rad].
        density: density of the water [kg/m^3].
        turn_rate: largest change of the deflection [rad/s]; None: nothing limits it.
        time_constant: time in which the thrust comes to 63 % of a new command [s].
        rate: largest change of the commanded thrust [N/s]; None: nothing limits it.
        uncertainty: standard deviation of its force [N]; None: nothing is known of it.
        rudder_name: name of the rudder where a layout file lists it as an actuator of its own;
            None: it has none.
        hangs: whether damage has left it a single thrust, that of both limits (a truth value, which
            no file has).

    Raises:
        LayoutError: a value is out of its bounds, or the rudder would push aside with more than the
            thrust; the message names the argument.
    """

    KEYS: ClassVar[Mapping[str, str]] = {
        "position": "position_m",
        "force": "force_n",
        "diameter": "diameter_m",
        "area": "area_m2",
        "lift_slope": "lift_slope_per_rad",
        "drag": "drag_coefficient",
        "density": "density_kg_m3",
        "time_constant": "time_constant_s",
        "rate": "rate_n_s",
    }
    DEGREES: ClassVar[Mapping[str, tuple[str, Any]]] = {
        "deflection": ("deflection_deg", tuple[DeflectionDegrees, DeflectionDegrees]),
        "stall": ("stall_deg", StallDegrees),
        "turn_rate": ("turn_rate_deg_s", TurnRateDegrees),
    }
    type: ClassVar[str] = "propeller_rudder"
    KIND: ClassVar[Kind] = Kind(
        law=SteeredLaw,
        group=SteeredGroup,
        command=SteeredCommand,
        numbers=(
            CommandNumber(name="deflection", unit="rad", limits="deflection", rate="turn_rate"),
            CommandNumber(name="force", unit="N", limits="force", rate="rate", lags=True),
        ),
        axes=("shaft", "zero"),
        pushes_along=("zero", ACROSS),
        pointed="zero",
        drawn_as="pod",
        faults=("weak", "stuck", "running"),
        arc="deflection",
        described=False,
        models=FORMULAS,
    )
    dead_band: ClassVar[float] = 0.0  # type: ignore[misc]
    open_water: ClassVar[None] = None  # type: ignore[misc]

    name: Name
    position: Place
    shaft: Direction3
    zero: Direction3
    force: tuple[Newtons, Newtons]
    model: ThrustModel
    diameter: Diameter
    area: Area
    aspect_ratio: AspectRatio
    deflection: tuple[Deflection, Deflection] = (-math.pi / 6, math.pi / 6)
    slipstream: Share = 1.0
    lift_slope: Slope | None = None
    drag: Coefficient = 0.0065
    stall: StallAngle = 0.47
    density: Density = 1000.0
    turn_rate: TurnRate | None = None
    time_constant: Seconds = 0.1
    rate: ForceRate | None = None
    uncertainty: Uncertainty | None = None
    rudder_name: Name | None = None
    hangs: bool = False

    def check_together(self) -> None:
        """See `Actuator`."""
        super().check_together()
        check_force(self.model, self.force)
        least, most = self.force
        is_hung = self.hangs and least == most
        if not is_hung and not least <= 0.0 < most:
            raise LayoutError(
                f"expected a least force of 0 or below and a most force above 0, got {least:g} and "
                f"{most:g}; turn `zero` round where it only pulls",
                "force",
            )
        low, high = self.deflection
        if low > high:
            raise LayoutError(
                f"expected a least below the greatest angle, got {math.degrees(low):g} and "
                f"{math.degrees(high):g} deg",
                "deflection",
            )
        aside = self.race_area * self.rudder.slope * self.stall
        if aside > 1.0:
            raise LayoutError(
                f"the rudder would push aside with {aside:.3g} times the thrust, more than the "
                f"slipstream's momentum allows, got {self.area:g} m^2 behind a propeller of "
                f"{self.diameter:g} m; say with `slipstream` what share of it lies there",
                "slipstream",
            )

    @property
    def rudder(self) -> Rudder:
        """Its rudder alone, as it is without a propeller; one that is held may turn a little."""
        low, high = self.deflection
        if low == high:
            low -= MIN_LENGTH
            high += MIN_LENGTH
        return Rudder(
            name=self.name,
            position=self.position,
            shaft=self.shaft,
            zero=self.zero,
            area=self.area,
            deflection=(max(low, -0.5 * math.pi), min(high, 0.5 * math.pi)),
            aspect_ratio=self.aspect_ratio,
            lift_slope=self.lift_slope,
            drag=self.drag,
            stall=self.stall,
            density=self.density,
        )

    @property
    def parts(self) -> tuple[str, ...]:
        """See `Actuator`: its rudder, where that has a name."""
        return () if self.rudder_name is None else (self.rudder_name,)

    @property
    def parts_words(self) -> str:
        """See `Actuator`."""
        return (
            f"{self.rudder_name} stands in the slipstream of {self.name}: both are one actuator, "
            f"{self.name}"
        )

    @property
    def parts_damage_words(self) -> str:
        """See `Actuator`: a rudder that turns no more is the actuator stuck at its angle."""
        return (
            f"where {self.rudder_name} no longer turns and the propeller still pushes, "
            f"{self.name} is stuck at the angle of the rudder (stuck {self.name}=0 amidships); "
            f"where both are lost, {self.name} is lost"
        )

    def copied(self, name: str) -> Self:
        return replace(self, name=name, rudder_name=None)

    @property
    def disc(self) -> float:
        """Area A of the propeller's disc [m^2]."""
        return 0.25 * math.pi * self.diameter**2

    @property
    def race_area(self) -> float:
        """sigma = k S / A [1]."""
        return self.slipstream * self.area / self.disc

    @property
    def half_density_area(self) -> float:
        """rho A / (2 k) [kg/m]: p is this times V^2."""
        return 0.5 * self.density * self.disc / self.slipstream

    @classmethod
    def sample(cls) -> Self:
        """See `Actuator`: a T200 of Blue Robotics at 16 V, before a rudder as high as its
        slipstream is wide."""
        return cls(
            name=cls.type,
            position=(0.0, 0.0, 0.0),
            shaft=(0.0, 0.0, 1.0),
            zero=(1.0, 0.0, 0.0),
            force=(T200_FORCE_ASTERN, T200_FORCE),
            model=T200,
            diameter=T200_DIAMETER,
            area=0.002,
            aspect_ratio=1.5,
        )

    def pushing(self, force: Array) -> Array:
        """See `Actuator`: the deflection whose force has that direction, as near as it turns."""
        arc = _arc_of(self.rudder, self.race_area)
        angle = math.atan2(force[1], force[0])
        if force[0] < 0.0:
            return np.array([0.0, force[0], 0.0])
        deflection = np.interp(angle, arc.curve[:, 0], arc.curve[:, 1])
        radius = np.interp(angle, arc.curve[:, 0], arc.curve[:, 2])
        return np.array([deflection, math.hypot(*force) / radius, 0.0])

    def neutral(self, now: Array | None = None) -> Array:
        """See `Actuator`: the rudder stays where it is."""
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
        left = replace(self, force=force, deflection=held_limits(angle, self.deflection))
        return left if faults.running is None else left.hung(faults.running[1])

    def scaled(self, share: float) -> Self:
        """See `Actuator`: a share of the thrust at the same power."""
        return replace(
            self,
            force=(share * self.force[0], share * self.force[1]),
            rate=None if self.rate is None else share * self.rate,
            model=scaled_model(self.model, share),
        )

    @property
    def limits_words(self) -> str:
        return f"{super().limits_words}, rudder {arc_words(*self.deflection)} of {self.area:g} m^2"

    @property
    def joints(self) -> Iterator[tuple[str, Vector3, tuple[float, float] | None]]:
        yield "_rudder", self.shaft, self.deflection
        yield "", self.zero, None
