"""Rudders: lift and drag of a foil in the water that flows past it, with stall.

Command: (deflection [rad], 0, 0). Own frame: shaft, zero (the chord at deflection 0, pointing
forward), and shaft x zero. U is the speed of the foil's place through the water across the shaft,
and the angle a goes from the direction of travel to the chord. Lift is 1/2 rho U^2 S CL(a) across
the travel, drag 1/2 rho U^2 S CD(a) against it. Below stall CL = slope a and CD = CD0 + k CL^2.
Beyond it they are those of a flat plate, CL = 2 |sin a| sin a cos a and CD = CD0 + 2 sin^2 a, with
a logistic blend between (Beard and McLain, 2012, section
4.2). A foil that goes astern is taken to be as good as ahead. At rest there is no force.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
from msgspec import Meta

from finlab.actuators import actuator
from finlab.actuators.hermite_grid import grid_numbers
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.response import CELLS, POINTS, Form, Group, Line, RadialTable, Response
from finlab.actuators.thrust_model import lower_hull
from finlab.actuators.thrust_power import Curve, radial_table
from finlab.arrays import NOTHING, Array, Values
from finlab.axes import AHEAD, SHORT, Direction3, Vector, across, arc_words
from finlab.errors import LayoutError
from finlab.files.schema import Name

SHARPNESS = 50.0
"""How fast the flow separates around the angle of stall [1/rad]."""
PEAK = 0.995
"""Share of the largest lift that is asked of a rudder: towards the peak a newton has no price."""
LEAST_DRAG = 1e-3
"""Drag coefficient per squared lift coefficient that counts at least, so that each price has one
answer."""

_EFFICIENCY = 0.9
"""Induced drag of an elliptic wing over that of such a foil (Whicker and Fehlner, 1958)."""
Deflection = Annotated[float, Meta(ge=-math.pi / 2, le=math.pi / 2)]
DeflectionDegrees = Annotated[float, Meta(ge=-90.0, le=90.0)]
StallDegrees = Annotated[float, Meta(ge=5.0, le=70.0)]
Slope = Annotated[float, Meta(ge=0.05, le=10.0)]
Coefficient = Annotated[float, Meta(ge=0.0, le=10.0)]


class Coefficients(NamedTuple):
    """Lift and drag coefficients, and their derivatives by the angle [1/rad]."""

    lift: Array
    drag: Array
    lift_slope: Array
    drag_slope: Array


class Met(NamedTuple):
    """The water that meets foils (..., n)."""

    speed: Array
    """Speed across the shaft [m/s]."""
    pressure: Array
    """Dynamic pressure times area [N]."""
    course: Array
    """Direction of travel from zero towards shaft x zero [rad]."""

    def force(self, lift: Array, drag: Array) -> Array:
        """Returns forces (..., n, 3) [N] in own frames of coefficients (..., n)."""
        cos = np.cos(self.course)
        sin = np.sin(self.course)
        force = np.zeros((*lift.shape, 3))
        force[..., 1] = -self.pressure * (drag * cos + lift * sin)
        force[..., 2] = self.pressure * (lift * cos - drag * sin)
        return force


class RudderLaw(ActuatorLaw):
    """The law of n rudders, whose command is the deflection [rad]; their force is that of the
    flow."""

    feels_flow = True

    def __init__(self, rudders: Sequence["Rudder"]) -> None:
        """Takes n rudders."""
        self.slope = np.array([rudder.slope for rudder in rudders])
        self.drag = np.array([rudder.drag for rudder in rudders])
        self.induced = np.array([rudder.induced for rudder in rudders])
        self.stall = np.array([rudder.stall for rudder in rudders])
        self.half_density_area = np.array(
            [0.5 * rudder.density * rudder.area for rudder in rudders]
        )

    def met(self, inflow: Array) -> Met:
        """Returns the water that meets the foils, of velocities (..., n, 3) [m/s] in own frames."""
        square = inflow[..., 1] ** 2 + inflow[..., 2] ** 2
        course = np.arctan2(inflow[..., 2], inflow[..., 1])
        return Met(np.sqrt(square), self.half_density_area * square, course)

    def coefficients(self, angle: Array) -> Coefficients:
        """Returns lift and drag of foils with stall (Beard and McLain, 2012, section 4.2).

        Args:
            angle: from the direction of travel to the chord (..., n) [rad].

        Returns:
            Coefficients (..., n), with their derivatives [1/rad].
        """
        a = np.mod(angle + 0.5 * np.pi, np.pi) - 0.5 * np.pi
        sin = np.sin(a)
        cos = np.cos(a)

        # The logistic blend sigma: 0 below stall, 1 beyond it, either way.
        up = 0.5 * (1.0 + np.tanh(0.5 * SHARPNESS * (a - self.stall)))
        down = 0.5 * (1.0 - np.tanh(0.5 * SHARPNESS * (a + self.stall)))
        sigma = up + down - up * down
        sigma_slope = SHARPNESS * (1.0 - up) * (1.0 - down) * (up - down)

        # Below stall: CL = slope a, CD = CD0 + k CL^2. Beyond it: those of a flat plate.
        lift = self.slope * a
        induced_drag = self.induced * lift * lift
        plate_lift = 2.0 * np.abs(sin) * sin * cos
        plate_drag = 2.0 * sin * sin
        plate_lift_slope = 4.0 * np.abs(sin) * cos * cos - 2.0 * np.abs(sin) * sin * sin
        lift_slope = (
            self.slope + sigma * (plate_lift_slope - self.slope) + sigma_slope * (plate_lift - lift)
        )
        drag_slope = (
            2.0 * self.induced * self.slope * lift * (1.0 - sigma)
            + sigma * 4.0 * sin * cos
            + sigma_slope * (plate_drag - induced_drag)
        )
        return Coefficients(
            lift=lift + sigma * (plate_lift - lift),
            drag=self.drag + induced_drag + sigma * (plate_drag - induced_drag),
            lift_slope=lift_slope,
            drag_slope=drag_slope,
        )

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        return self.force_and_jacobian(command, inflow)[0]

    def force_and_jacobian(
        self, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        met = self.met(np.zeros(command.shape) if inflow is None else inflow)
        result = self.coefficients(command[..., 0] - met.course)
        force = met.force(result.lift, result.drag)
        jacobian = np.zeros((*force.shape, 3))
        jacobian[..., 0, :] = met.force(result.lift_slope, result.drag_slope)
        return force, jacobian

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`: what the drag takes, drag times speed."""
        if inflow is None:
            return 0.0 * command[..., 0]
        met = self.met(inflow)
        return met.pressure * met.speed * self.coefficients(command[..., 0] - met.course).drag

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        met = self.met(np.zeros(command.shape) if inflow is None else inflow)
        slope = (
            met.pressure * met.speed * self.coefficients(command[..., 0] - met.course).drag_slope
        )
        return slope[..., None] * [1.0, 0.0, 0.0]


class RudderGroup(Group):
    """What the rudders of a robot offer for prices in one flow: a lift, and the drag that comes
    with it."""

    feels_flow = True

    def __init__(self, rudders: Sequence["Rudder"], effectiveness: Array) -> None:
        """Prepares rudders at rest.

        Args:
            rudders: m of them.
            effectiveness: wrench (m, 3, 6) per newton along each own axis [1, m].
        """
        count = len(rudders)
        self._law = RudderLaw(rudders)
        self._effectiveness = effectiveness[:, 1:]
        self._limits = np.array([rudder.deflection for rudder in rudders])
        self._grids = self._coefficient_grids(count)
        self._curves: list[tuple[Array, Array, Array]] = []
        self._tables: list[RadialTable] = []
        angle = np.linspace(0.0, 0.3 * np.pi, CELLS)
        result = self._law.coefficients(np.repeat(angle[:, None], count, axis=1))
        for lift, drag in zip(result.lift.T, result.drag.T, strict=True):
            self._add_curve(angle, lift, drag)
        self._meet(np.zeros((count, 3)))

    def _coefficient_grids(self, count: int) -> list[Array]:
        """Lift and drag of each of `count` foils over all angles, as grids for the core."""
        around = np.linspace(-0.5 * np.pi, 0.5 * np.pi, CELLS, endpoint=False)
        result = self._law.coefficients(np.repeat(around[:, None], count, axis=1))
        no_axis = np.zeros(1)
        grids = []
        for lift, drag in zip(result.lift.T, result.drag.T, strict=True):
            values = np.stack([lift, drag], axis=-1)[None, None]
            grids.append(grid_numbers((no_axis, no_axis, around), values, period=np.pi))
        return grids

    def _add_curve(self, angle: Array, lift: Array, drag: Array) -> None:
        """Adds the rising part of the curve of one foil's coefficients over angles (CELLS,) from 0
        on, and the table of lift over price that follows from it."""
        falls = np.append(np.diff(lift) <= 0.0, True)
        largest = lift[np.argmax(falls)]
        last = int(np.argmax(lift >= PEAK * largest)) + 1
        self._curves.append((lift[:last], angle[:last], drag[:last]))
        induced_drag = np.maximum(drag[:last] - drag[0], LEAST_DRAG * lift[:last] ** 2)
        curve = Curve(*lower_hull(lift[:last], drag[0] + induced_drag))
        self._tables.append(radial_table(curve, 1, 0.0, float(lift[last - 1])))

    def at(self, inflow: Array | None) -> "RudderGroup":
        other = copy(self)
        other._meet(np.zeros((len(self._limits), 3)) if inflow is None else inflow)
        return other

    def _meet(self, inflow: Array) -> None:
        self._met = self._law.met(inflow)
        course = self._met.course
        # Lift and drag are the same ahead and astern.
        self._turned = np.mod(course + 0.5 * np.pi, np.pi) - 0.5 * np.pi
        across = np.stack([-np.sin(course), np.cos(course)], axis=-1)
        along = np.stack([np.cos(course), np.sin(course)], axis=-1)
        self._across = np.einsum("mk,mkw->mw", across, self._effectiveness)
        self._against = -np.einsum("mk,mkw->mw", along, self._effectiveness)
        self.responses = self._responses()

    def _responses(self) -> list[Response]:
        """What each offers."""
        responses: list[Response] = []
        ends = zip(*self._lift(self._limits).T.tolist(), strict=True)
        for i, (low, high) in enumerate(ends):
            pressure = float(self._met.pressure[i])
            speed = float(self._met.speed[i])
            if pressure < NOTHING:
                table = RadialTable.of_forces(1.0, np.zeros(CELLS + 1), 0.0)
                responses.append(Line(self._across[i], table, table, low=low, high=high))
                continue
            table = self._tables[i].scaled(pressure, pressure * speed)
            drag = self._against[i]
            responses.append(
                Line(self._across[i], table, table, low=low, high=high, drag=drag, speed=speed)
            )
        return responses

    def worth(self, price: Array) -> Array:
        """See `Group`: by the law at many deflections, more around the best of them, a parabola."""
        gain = price @ self._across.T
        drag_cost = self._met.speed - price @ self._against.T
        low = self._limits[:, 0] + 0.0 * gain
        high = self._limits[:, 1] + 0.0 * gain
        for count in (POINTS, 16, 16):
            step = (high - low) / count
            angle = low + step * np.arange(count + 1)[:, None, None]
            result = self._law.coefficients(angle - self._met.course)
            conjugate = gain * result.lift - drag_cost * (result.drag - self._law.drag)
            best = np.clip(conjugate.argmax(axis=0)[None], 1, count - 1)
            middle = np.take_along_axis(angle, best, axis=0)[0]
            low = middle - step
            high = middle + step

        # The parabola through the best of the last angles and its neighbours.
        before = np.take_along_axis(conjugate, best - 1, axis=0)[0]
        at = np.take_along_axis(conjugate, best, axis=0)[0]
        after = np.take_along_axis(conjugate, best + 1, axis=0)[0]
        slope = 0.5 * (after - before)
        curvature = np.minimum(before - 2.0 * at + after, -1e-300)
        x = np.clip(-slope / curvature, -1.0, 1.0)
        peak = at + x * (slope + 0.5 * x * curvature)
        largest = np.maximum(conjugate.max(axis=0), peak)
        return np.asarray(self._met.pressure * (largest - self._met.speed * self._law.drag))

    @property
    def beside(self) -> Array:
        return np.asarray((self._met.pressure * self._law.drag)[:, None] * self._against)

    def beside_of(self, force: Array) -> Array:
        size = np.abs(force[..., 0]) / np.maximum(self._met.pressure, NOTHING)
        drag = [
            np.interp(size[:, i], lifts, drags) for i, (lifts, _, drags) in enumerate(self._curves)
        ]
        return np.asarray((np.stack(drag, axis=-1) * self._met.pressure) @ self._against)

    def _lift(self, deflection: Array) -> Array:
        """Least and largest lifts (m, 2) [N] between deflections (m, 2) [rad], each at its least
        drag."""
        angle = deflection - self._turned[:, None]
        end = np.array([angles[-1] for _, angles, _ in self._curves])
        parted = np.clip(0.0, angle[:, 0], angle[:, 1])
        usual = np.clip(angle, -end[:, None], end[:, None])
        near = np.where((np.abs(parted) > end)[:, None], parted[:, None], usual)
        most = np.array([lifts[-1] for lifts, _, _ in self._curves])[:, None]
        lift = np.clip(self._law.coefficients(near.T).lift.T, -most, most)
        return np.asarray(lift * self._met.pressure[:, None])

    @property
    def forms(self) -> list[Form]:
        forms = []
        for i, (lifts, angles, _) in enumerate(self._curves):
            course = self._met.course[i]
            cos = np.cos(course)
            sin = np.sin(course)
            lift_axis = [0.0, -sin, cos]
            drag_axis = [0.0, -cos, -sin]
            form = Form(
                "foil",
                axes=np.array([lift_axis, drag_axis, [0.0, 0.0, 0.0]]),
                law=self._grids[i],
                beat=np.stack([lifts, angles], axis=-1),
                lean=course,
                pressure=max(self._met.pressure[i], NOTHING),
                zero_lift_angle=self._turned[i],
                zero_lift_drag=self._law.drag[i],
            )
            forms.append(form)
        return forms


class RudderCommand(actuator.Command, frozen=True, rename={"deflection": "deflection_rad"}):
    """The command of a rudder, by name."""

    deflection: float
    """Angle of its chord from `zero` towards shaft x zero [rad]."""

    @property
    def words(self) -> str:
        return f"{math.degrees(self.deflection):.1f} deg"


@dataclass(frozen=True)
class Rudder(actuator.Actuator):
    """A foil on a shaft; its command is the deflection. Checked on construction.

    Its force is that of the flow: with the speed U across the shaft and the angle a between chord
    and flow, lift 1/2 density U^2 area CL(a) across the flow and drag 1/2 density U^2 area CD(a)
    along it. At rest it gives nothing.
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
        "rate": ("rate_deg_s", actuator.TurnRateDegrees),
    }
    LAW = RudderLaw
    GROUP = RudderGroup
    NUMBERS = (("deflection", "rad"),)
    COMMAND = RudderCommand
    LIMITS = ("deflection",)
    RATES = ("rate",)
    AXES = ("shaft", "zero")
    PUSHES = (2,)
    ARC = "deflection"
    BY_FLOW = True
    FAULTS = ("torn",)
    LOOKS = "foil"
    OTHER = "Leading edge"
    BOXES = (
        actuator.Box("Deflection [°]", "deflection", "Least and greatest.", 1.0, True, pair=True),
        actuator.Box("Rate [°/s]", "rate", "How fast it turns; 0: at once.", 5.0, True, True),
        actuator.Box("Lag [s]", "time_constant", "Time to 63 % of a new deflection.", 0.05),
    )
    LAW_BOXES = (
        actuator.Box("Area [m²]", "area", "Of the foil.", 0.001),
        actuator.Box("Aspect ratio", "aspect_ratio", "2 span²/area for a foil on a hull."),
        actuator.Box("Lift slope [1/rad]", "lift_slope", "0: by the aspect ratio.", free=True),
        actuator.Box("Drag", "drag", "Drag coefficient without lift; 0.0065 is NACA 0015.", 0.001),
        actuator.Box("Stall [°]", "stall", "Angle to the flow at which it separates.", 1.0, True),
    )
    type: ClassVar[str] = "rudder"

    name: Name
    """Unique within its layout."""
    position: actuator.Place
    """Where the force acts, the centre of pressure, body frame [m]."""
    shaft: Direction3
    """Unit vector of the shaft, body frame."""
    zero: Direction3
    """Unit vector across it: from the trailing to the leading edge at deflection 0; it turns
    towards shaft x zero."""
    area: Annotated[float, Meta(ge=1e-6, le=1000.0)]
    """Area of the foil [m^2]."""
    deflection: tuple[Deflection, Deflection]
    """Least and greatest deflection [rad]."""
    aspect_ratio: Annotated[float, Meta(ge=0.05, le=100.0)]
    """Effective aspect ratio, 2 span^2 / area for a foil on a hull."""
    lift_slope: Slope | None = None
    """Lift coefficient per angle [1/rad]; from the aspect ratio after Whicker and Fehlner when
    None."""
    drag: Coefficient = 0.0065
    """Drag coefficient without lift; the default is that of a NACA 0015 section."""
    stall: Annotated[float, Meta(ge=0.08, le=1.23)] = 0.47
    """Angle between chord and flow at which the flow separates [rad]; lift then falls to that of a
    plate."""
    density: Annotated[float, Meta(ge=500.0, le=2000.0)] = 1000.0
    """Density of the water [kg/m^3]."""
    time_constant: actuator.Seconds = 0.1
    """Time in which the deflection comes to 63 % of a new one [s]."""
    rate: actuator.TurnRate | None = None
    """How fast the deflection changes at most [rad/s]; None where nothing limits it."""
    uncertainty: actuator.Uncertainty | None = None
    """How far its force may be from that; None where nothing is known of it."""

    def check_together(self) -> None:
        """See `Actuator`."""
        super().check_together()
        if not self.deflection[0] < self.deflection[1]:
            low, high = map(math.degrees, self.deflection)
            raise LayoutError(
                f"expected a least below the greatest angle, got {low:g} and {high:g} deg",
                "deflection",
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
        return 1.0 / (math.pi * _EFFICIENCY * self.aspect_ratio)

    @classmethod
    def sample(cls) -> Self:
        """See `Actuator`: a tail fin of REMUS 100."""
        up = (0.0, 0.0, 1.0)
        ends = (-math.pi / 6, math.pi / 6)
        return cls("rudder", (0.0, 0.0, 0.0), up, (1.0, 0.0, 0.0), 0.00665, ends, 2.21)

    def largest(self, speed: float) -> float:
        angle = min(self.stall, max(map(abs, self.deflection)))
        return 0.5 * self.density * self.area * speed**2 * self.slope * angle

    def damaged(self, faults: actuator.Faults) -> Self:
        return self if faults.torn is None else self.scaled(faults.torn)

    def scaled(self, share: float) -> Self:
        return replace(self, area=share * self.area)

    @property
    def limits_words(self) -> str:
        return f"{arc_words(*self.deflection)}, {self.area:g} m^2"

    @property
    def joints(self) -> Iterator[tuple[str, Vector, tuple[float, float] | None]]:
        yield "", self.shaft, self.deflection

    def settled(self, frame: Array) -> Array:
        """See `Actuator`: the leading edge lies ahead, as near as the shaft allows."""
        if math.hypot(*frame[0, 1:]) > SHORT:
            frame[1] = across(frame[0], AHEAD)
        return frame
