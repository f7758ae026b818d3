"""Rudders: lift and drag of a foil in the water that flows past it, with stall.

Command: (deflection [rad], 0, 0). Own frame: shaft, zero (the chord at deflection 0, pointing
forward), and shaft x zero. U is the speed of the foil's place through the water across the shaft,
and the angle a goes from the direction of travel to the chord. Lift is 1/2 rho U^2 S CL(a) across
the travel, drag 1/2 rho U^2 S CD(a) against it. Below stall CL = slope a and CD = CD0 + k CL^2.
Beyond it they are those of a flat plate, CL = 2 |sin a| sin a cos a and CD = CD0 + 2 sin^2 a, with
a logistic blend between (Beard and McLain, 2012, section 4.2). A foil that goes astern is taken to
be as good as ahead. At rest there is no force.
"""

from __future__ import annotations  # help() then prints `Deflection`, not the bounds of one

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import numpy as np
from msgspec import Meta

from finlab.actuators.actuator import (
    ACROSS,
    Actuator,
    Command,
    CommandNumber,
    Faults,
    Kind,
    Place,
    Seconds,
    TurnRate,
    TurnRateDegrees,
    Uncertainty,
)
from finlab.actuators.hermite_grid import grid_numbers
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.response import CELLS, POINTS, Form, Group, Line, RadialTable, Response
from finlab.actuators.thrust_model import lower_hull
from finlab.actuators.thrust_power import ConvexCurve, radial_table
from finlab.arrays import NOTHING, Array, Values
from finlab.axes import FORWARD, MIN_LENGTH, Direction3, Vector3, arc_words, perpendicular
from finlab.errors import LayoutError
from finlab.files.schema import Name

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

SHARPNESS = 50.0
"""How fast the flow separates around the angle of stall [1/rad]."""
PEAK = 0.995
"""Share of the largest lift up to which a rudder is used: towards the peak the marginal cost of a
newton has no bound."""
LEAST_DRAG = 1e-3
"""Drag coefficient per squared lift coefficient that counts at least, so that the response to each
price is unique."""
CURVE_END = 0.3 * math.pi
"""Angle up to which the curve of lift is searched for its peak [rad]; a plate's lies below."""
GRID_CELLS = 2048
"""Cells of the grid of a foil's coefficients over half a turn: with as many it is off by less than
commands may be."""
REFINED = 16
"""Intervals of deflection in each of the finer searches for the conjugate."""
NO_CURVATURE = 1e-300
"""Least curvature of a parabola, so that a flat one divides by no zero."""
EFFICIENCY = 0.9
"""Induced drag of an elliptic wing over that of such a foil (Whicker and Fehlner, 1958)."""

Deflection = Annotated[float, Meta(ge=-math.pi / 2, le=math.pi / 2)]
"""An angle of the chord [rad]."""
DeflectionDegrees = Annotated[float, Meta(ge=-90.0, le=90.0)]
"""The same in a file [deg]."""
StallAngle = Annotated[float, Meta(ge=0.08, le=1.23)]
"""Angle between chord and flow at which the flow separates [rad]."""
StallDegrees = Annotated[float, Meta(ge=5.0, le=70.0)]
"""The same in a file [deg]."""
Area = Annotated[float, Meta(ge=1e-6, le=1000.0)]
"""Area of a foil [m^2]."""
AspectRatio = Annotated[float, Meta(ge=0.05, le=100.0)]
"""Squared span over area [1]."""
Slope = Annotated[float, Meta(ge=0.05, le=10.0)]
"""Derivative of the lift coefficient by the angle [1/rad]."""
Coefficient = Annotated[float, Meta(ge=0.0, le=10.0)]
"""A drag coefficient [1]."""
Density = Annotated[float, Meta(ge=500.0, le=2000.0)]
"""Density of water [kg/m^3]."""


class Coefficients(NamedTuple):
    """Lift and drag coefficients of n foils, and their derivatives by the angle."""

    lift: Array
    """CL (..., n) [1]."""
    drag: Array
    """CD (..., n) [1]."""
    lift_slope: Array
    """dCL/da (..., n) [1/rad]."""
    drag_slope: Array
    """dCD/da (..., n) [1/rad]."""


class FoilFlow(NamedTuple):
    """The flow that meets n foils."""

    speed: Array
    """U, speed across the shaft (..., n) [m/s]."""
    pressure: Array
    """Dynamic pressure times area, 1/2 rho U^2 S (..., n) [N]."""
    course: Array
    """Direction of travel from zero towards shaft x zero (..., n) [rad]."""

    def force(self, lift: Array, drag: Array) -> Array:
        """Returns the force of foils.

        Args:
            lift: lift coefficients, or their derivatives (..., n).
            drag: drag coefficients, or their derivatives (..., n).

        Returns:
            Forces (..., n, 3), own frames [N].
        """
        cos = np.cos(self.course)
        sin = np.sin(self.course)
        force = np.zeros((*lift.shape, 3))
        force[..., 1] = -self.pressure * (drag * cos + lift * sin)
        force[..., 2] = self.pressure * (lift * cos - drag * sin)
        return force


class RudderLaw(ActuatorLaw):
    """Law of n rudders, whose command is the deflection [rad]: lift and drag of foils in the
    flow."""

    feels_flow = True

    def __init__(self, rudders: Sequence[Rudder]) -> None:
        """Takes n rudders."""
        self.slope = np.array([rudder.slope for rudder in rudders])
        self.drag = np.array([rudder.drag for rudder in rudders])
        self.induced = np.array([rudder.induced for rudder in rudders])
        self.stall = np.array([rudder.stall for rudder in rudders])
        self.half_density_area = np.array(
            [0.5 * rudder.density * rudder.area for rudder in rudders]
        )

    def flow_at(self, inflow: Array | None, shape: tuple[int, ...]) -> FoilFlow:
        """Returns the flow that meets the foils.

        Args:
            inflow: velocities of their points through the water (..., n, 3), own frames [m/s]; None
                at rest.
            shape: shape (..., n, 3) of the velocities at rest.
        """
        velocity = np.zeros(shape) if inflow is None else inflow
        speed_squared = velocity[..., 1] ** 2 + velocity[..., 2] ** 2
        course = np.arctan2(velocity[..., 2], velocity[..., 1])
        pressure = self.half_density_area * speed_squared
        return FoilFlow(np.sqrt(speed_squared), pressure, course)

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
        flow = self.flow_at(inflow, command.shape)
        foil = self.coefficients(command[..., 0] - flow.course)
        force = flow.force(foil.lift, foil.drag)
        jacobian = np.zeros((*force.shape, 3))
        jacobian[..., 0, :] = flow.force(foil.lift_slope, foil.drag_slope)
        return force, jacobian

    def power(self, command: Values, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`: drag times speed."""
        if inflow is None:
            return 0.0 * command[..., 0]
        flow = self.flow_at(inflow, command.shape)
        return flow.pressure * flow.speed * self.coefficients(command[..., 0] - flow.course).drag

    def power_gradient(self, command: Array, inflow: Array | None = None) -> Array:
        flow = self.flow_at(inflow, command.shape)
        drag_slope = self.coefficients(command[..., 0] - flow.course).drag_slope
        by_deflection = flow.pressure * flow.speed * drag_slope
        return by_deflection[..., None] * [1.0, 0.0, 0.0]


class FoilCurve(NamedTuple):
    """The rising part of a foil's curve of lift, K angles from the one without lift on."""

    lift: Array
    """CL (K,) [1], rising from 0."""
    angle: Array
    """Angles from the direction of travel to the chord (K,) [rad]."""
    drag: Array
    """CD (K,) [1]."""


class RudderGroup(Group):
    """Responses to prices of m rudders in one flow (Eq. 5): a lift, and the drag that comes with
    it."""

    feels_flow = True

    def __init__(self, rudders: Sequence[Rudder], effectiveness: Array) -> None:
        """Tabulates rudders at rest.

        Args:
            rudders: m of them.
            effectiveness: wrench (m, 3, 6) of 1 N along each own axis [1, m], body frame.
        """
        count = len(rudders)
        self._law = RudderLaw(rudders)
        self._effectiveness = effectiveness[:, 1:]
        self._limits = np.array([rudder.deflection for rudder in rudders])
        self._grids = self._coefficient_grids(count)
        self._curves: list[FoilCurve] = []
        self._tables: list[RadialTable] = []
        angle = np.linspace(0.0, CURVE_END, CELLS)
        foil = self._law.coefficients(np.repeat(angle[:, None], count, axis=1))
        for lift, drag in zip(foil.lift.T, foil.drag.T, strict=True):
            curve = _rising_curve(angle, lift, drag)
            self._curves.append(curve)
            self._tables.append(_lift_table(curve))
        self._set_flow(None)

    def _coefficient_grids(self, count: int) -> list[Array]:
        """Lift and drag of each of `count` foils over all angles, as grids for the core."""
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, GRID_CELLS, endpoint=False)
        foil = self._law.coefficients(np.repeat(angle[:, None], count, axis=1))
        no_axis = np.zeros(1)
        grids = []
        grid_of_values: dict[bytes, Array] = {}
        for lift, drag in zip(foil.lift.T, foil.drag.T, strict=True):
            values = np.stack([lift, drag], axis=-1)[None, None]
            key = values.tobytes()
            if key not in grid_of_values:
                axes = (no_axis, no_axis, angle)
                grid_of_values[key] = grid_numbers(axes, values, period=np.pi)
            grids.append(grid_of_values[key])  # equal foils share one
        return grids

    def at(self, inflow: Array | None) -> RudderGroup:
        other = copy(self)
        other._set_flow(inflow)
        return other

    def _set_flow(self, inflow: Array | None) -> None:
        """Takes the flow, velocities (m, 3) [m/s], own frames, and what follows from it."""
        self._flow = self._law.flow_at(inflow, (len(self._limits), 3))
        course = self._flow.course
        # Lift and drag are the same ahead and astern.
        self._no_lift = np.mod(course + 0.5 * np.pi, np.pi) - 0.5 * np.pi
        lift_axis = np.stack([-np.sin(course), np.cos(course)], axis=-1)
        travel = np.stack([np.cos(course), np.sin(course)], axis=-1)
        self._lift_wrench = np.einsum("mk,mkw->mw", lift_axis, self._effectiveness)
        self._drag_wrench = -np.einsum("mk,mkw->mw", travel, self._effectiveness)
        self.responses = self._responses()

    def _responses(self) -> list[Response]:
        """Response of each rudder."""
        responses: list[Response] = []
        for i, (low, high) in enumerate(self._lift_limits().tolist()):
            pressure = float(self._flow.pressure[i])
            speed = float(self._flow.speed[i])
            effectiveness = self._lift_wrench[i]
            if pressure < NOTHING:
                table = RadialTable.of_forces(1.0, np.zeros(CELLS + 1), 0.0)
                responses.append(Line(effectiveness, table, table, low=low, high=high))
                continue
            table = self._tables[i].scaled(pressure, pressure * speed)
            responses.append(
                Line(
                    effectiveness,
                    table,
                    table,
                    low=low,
                    high=high,
                    drag=self._drag_wrench[i],
                    flow_speed=speed,
                )
            )
        return responses

    def conjugate_bound(self, price: Array) -> Array:
        """See `Group`: by the law at many deflections, at more around the best of them, and by the
        parabola through the best of these."""
        lift_price = price @ self._lift_wrench.T
        drag_cost = self._flow.speed - price @ self._drag_wrench.T
        low = self._limits[:, 0] + 0.0 * lift_price
        high = self._limits[:, 1] + 0.0 * lift_price
        for count in (POINTS, REFINED, REFINED):
            step = (high - low) / count
            angle = low + step * np.arange(count + 1)[:, None, None]
            foil = self._law.coefficients(angle - self._flow.course)
            conjugate = lift_price * foil.lift - drag_cost * (foil.drag - self._law.drag)
            best = np.clip(conjugate.argmax(axis=0)[None], 1, count - 1)
            middle = np.take_along_axis(angle, best, axis=0)[0]
            low = middle - step
            high = middle + step

        # The parabola through the best of the last angles and its neighbours.
        before = np.take_along_axis(conjugate, best - 1, axis=0)[0]
        at_best = np.take_along_axis(conjugate, best, axis=0)[0]
        after = np.take_along_axis(conjugate, best + 1, axis=0)[0]
        slope = 0.5 * (after - before)
        curvature = np.minimum(before - 2.0 * at_best + after, -NO_CURVATURE)
        x = np.clip(-slope / curvature, -1.0, 1.0)
        peak = at_best + x * (slope + 0.5 * x * curvature)
        largest = np.maximum(conjugate.max(axis=0), peak)
        return np.asarray(self._flow.pressure * (largest - self._flow.speed * self._law.drag))

    @property
    def wrench_offset_at_rest(self) -> Array:
        """See `Group`: the drag without lift."""
        return np.asarray((self._flow.pressure * self._law.drag)[:, None] * self._drag_wrench)

    def wrench_offset_of(self, force: Array) -> Array:
        """See `Group`: the drag at these lifts."""
        lift = np.abs(force[..., 0]) / np.maximum(self._flow.pressure, NOTHING)
        drag = []
        for i, curve in enumerate(self._curves):
            drag.append(np.interp(lift[:, i], curve.lift, curve.drag))
        return np.asarray((np.stack(drag, axis=-1) * self._flow.pressure) @ self._drag_wrench)

    def _lift_limits(self) -> Array:
        """Least and largest lifts (m, 2) [N] within the limits of the deflection, each at its least
        drag."""
        angle = self._limits - self._no_lift[:, None]
        curve_end = np.array([curve.angle[-1] for curve in self._curves])
        least_angle = np.clip(0.0, angle[:, 0], angle[:, 1])
        on_curve = np.clip(angle, -curve_end[:, None], curve_end[:, None])
        # Where the limits hold no angle of the rising curve, the foil is always stalled.
        is_stalled = np.abs(least_angle) > curve_end
        used = np.where(is_stalled[:, None], least_angle[:, None], on_curve)
        largest = np.array([curve.lift[-1] for curve in self._curves])[:, None]
        lift = np.clip(self._law.coefficients(used.T).lift.T, -largest, largest)
        return np.asarray(lift * self._flow.pressure[:, None])

    @property
    def forms(self) -> list[Form]:
        forms = []
        for i, curve in enumerate(self._curves):
            course = self._flow.course[i]
            cos = np.cos(course)
            sin = np.sin(course)
            lift_axis = [0.0, -sin, cos]
            drag_axis = [0.0, -cos, -sin]
            form = Form(
                "foil",
                axes=np.array([lift_axis, drag_axis, [0.0, 0.0, 0.0]]),
                law=self._grids[i],
                command_table=np.stack([curve.lift, curve.angle], axis=-1),
                command_table_count=len(curve.lift),
                lean_angle=course,
                pressure_area=max(self._flow.pressure[i], NOTHING),
                zero_lift_angle=self._no_lift[i],
                zero_lift_drag=self._law.drag[i],
            )
            forms.append(form)
        return forms


def _rising_curve(angle: Array, lift: Array, drag: Array) -> FoilCurve:
    """The rising part, up to `PEAK` of its first maximum, of one foil's coefficients over angles
    (CELLS,) from 0 on [rad]."""
    falls = np.append(np.diff(lift) <= 0.0, True)
    largest = lift[np.argmax(falls)]
    count = int(np.argmax(lift >= PEAK * largest)) + 1
    return FoilCurve(lift[:count], angle[:count], drag[:count])


def _lift_table(curve: FoilCurve) -> RadialTable:
    """Lift coefficient over its price, where the drag due to lift is the cost."""
    zero_lift_drag = curve.drag[0]
    induced_drag = np.maximum(curve.drag - zero_lift_drag, LEAST_DRAG * curve.lift**2)
    power = ConvexCurve(*lower_hull(curve.lift, zero_lift_drag + induced_drag))
    return radial_table(power, 1, 0.0, float(curve.lift[-1]))


class RudderCommand(Command, frozen=True, rename={"deflection": "deflection_rad"}):
    """The command of a rudder, by name."""

    deflection: float
    """Angle of its chord from `zero` towards shaft x zero [rad]."""

    @property
    def words(self) -> str:
        return f"{math.degrees(self.deflection):.1f} deg"


@dataclass(frozen=True)
class Rudder(Actuator):
    """A foil on a shaft; its command is the deflection. Checked on construction.

    Its force is that of the flow: with the speed U across the shaft and the angle a between chord
    and flow, lift 1/2 density U^2 area CL(a) across the flow and drag 1/2 density U^2 area CD(a)
    along it. At rest it gives nothing.

    Args:
        name: unique within its layout.
        position: where the force acts, the centre of pressure, body frame [m].
        shaft: axis of the shaft, unit vector, body frame [1].
        zero: from the trailing to the leading edge at deflection 0, unit vector across the shaft,
            body frame [1]; it turns towards shaft x zero.
        area: area of the foil [m^2].
        deflection: least and greatest deflection [rad].
        aspect_ratio: effective aspect ratio, 2 span^2 / area for a foil on a hull [1].
        lift_slope: derivative of the lift coefficient by the angle [1/rad]; None: by the aspect
            ratio, after Whicker and Fehlner.
        drag: drag coefficient without lift [1]; the default is that of a NACA 0015 section.
        stall: angle between chord and flow at which the flow separates [rad]; lift then falls to
            that of a plate.
        density: density of the water [kg/m^3].
        time_constant: time in which the deflection comes to 63 % of a new command [s].
        rate: largest change of the deflection [rad/s]; None: nothing limits it.
        uncertainty: standard deviation of its force [N]; None: nothing is known of it.
        alone: whether a reader of layout files leaves it an actuator of its own where it stands in
            the slipstream of a thruster, which it then does not feel (a truth value).

    Raises:
        LayoutError: a value is out of its bounds; the message names the argument.
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
    type: ClassVar[str] = "rudder"
    KIND: ClassVar[Kind] = Kind(
        law=RudderLaw,
        group=RudderGroup,
        command=RudderCommand,
        numbers=(CommandNumber(name="deflection", unit="rad", limits="deflection", rate="rate"),),
        axes=("shaft", "zero"),
        pushes_along=(ACROSS,),  # its lift; the drag comes with it
        pointed="shaft",
        drawn_as="foil",
        faults=("torn",),
        arc="deflection",
        driven_by_flow=True,
    )

    name: Name
    position: Place
    shaft: Direction3
    zero: Direction3
    area: Area
    deflection: tuple[Deflection, Deflection]
    aspect_ratio: AspectRatio
    lift_slope: Slope | None = None
    drag: Coefficient = 0.0065
    stall: StallAngle = 0.47
    density: Density = 1000.0
    time_constant: Seconds = 0.1
    rate: TurnRate | None = None
    uncertainty: Uncertainty | None = None
    alone: bool = False

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
        """Derivative of the lift coefficient by the angle [1/rad]: `lift_slope`, or 1.8 pi A /
        (sqrt(A^2 + 4) + 1.8) at the aspect ratio A (Whicker and Fehlner, 1958, without sweep)."""
        if self.lift_slope is not None:
            return self.lift_slope
        return 1.8 * math.pi * self.aspect_ratio / (math.hypot(self.aspect_ratio, 2.0) + 1.8)

    @property
    def induced(self) -> float:
        """Drag coefficient per squared lift coefficient, 1 / (pi e A) [1]."""
        return 1.0 / (math.pi * EFFICIENCY * self.aspect_ratio)

    @classmethod
    def sample(cls) -> Self:
        """See `Actuator`: a tail fin of REMUS 100."""
        return cls(
            name="rudder",
            position=(0.0, 0.0, 0.0),
            shaft=(0.0, 0.0, 1.0),
            zero=(1.0, 0.0, 0.0),
            area=0.00665,
            deflection=(-math.pi / 6, math.pi / 6),
            aspect_ratio=2.21,
        )

    def largest(self, speed: float) -> float:
        """See `Actuator`: its lift at stall, or at the largest deflection."""
        angle = min(self.stall, max(map(abs, self.deflection)))
        return 0.5 * self.density * self.area * speed**2 * self.slope * angle

    def damaged(self, faults: Faults) -> Self:
        return self if faults.torn is None else self.scaled(faults.torn)

    def scaled(self, share: float) -> Self:
        return replace(self, area=share * self.area)

    @property
    def limits_words(self) -> str:
        return f"{arc_words(*self.deflection)}, {self.area:g} m^2"

    @property
    def joints(self) -> Iterator[tuple[str, Vector3, tuple[float, float] | None]]:
        yield "", self.shaft, self.deflection

    def settled(self, frame: Array) -> Array:
        """See `Actuator`: the leading edge points ahead, as near as the shaft allows."""
        if math.hypot(*frame[0, 1:]) > MIN_LENGTH:
            frame[1] = perpendicular(frame[0], FORWARD)
        return frame
