"""A robot as the core reads it: scaled effectiveness in the range that its actuators span, and
tables, in one block of numbers.

`Compiled` makes it; who changes it reads docs/develop/block.md first.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.response import (
    POINTS,
    Form,
    Line,
    Plane,
    RadialTable,
    Response,
    power_of,
    price_grid,
)
from finlab.arrays import CLOSE, NEARLY, NOTHING, AnyArray, Array
from finlab.axes import TURN
from finlab.core.calls import Core
from finlab.core.fields import constant, numbers_of, struct, tables_begin
from finlab.core.library import VERSION

_FIELDS_OF_FORM = (
    "command_sign",
    "lean_angle",
    "unevenness",
    "unevenness_angle",
    "pressure_area",
    "zero_lift_angle",
    "zero_lift_drag",
)
"""Numbers of a `Form` that the core reads as they are, by the same names in `fl_actuator`."""
_NO_FORCE = 1e-12
"""Added to largest forces [N], so that nothing is divided by 0."""
_LEAST_POSITIVE = 1e-300
"""Stands for 0 where a number is divided by."""
_INFINITE_CHANGE = 1e30
"""Stands for an infinite change of a command in a tick: C reads no infinity."""


class CommandLimits(NamedTuple):
    """What limits the commands of n actuators, in the units of the commands."""

    lower: AnyArray
    """Least commands (n, 3)."""
    upper: AnyArray
    """Largest commands (n, 3)."""
    max_change: AnyArray
    """Largest changes (n, 3) in a tick; infinite where nothing limits them."""
    turns: AnyArray
    """Which are angles (n, 3) without limits."""


class DualRobot:
    """One robot, prepared of the responses of its n actuators: forces along one or two directions
    of each."""

    def __init__(
        self,
        responses: list[Response],
        forms: list[Form],
        limits: CommandLimits,
        effectiveness: Array,
        wrench_scale: Array,
        wrench_offset: Array | None = None,
        uncertainty_cost: Array | None = None,
        counts: Array | None = None,
    ) -> None:
        """Prepares a robot for the core.

        Args:
            responses: what each actuator offers for prices.
            forms: how the forces of each become commands.
            limits: of the commands.
            effectiveness: wrench (n, 3, 6) per newton along the actuators' own axes [1, m].
            wrench_scale: (6,) [N, N m], by which errors are normalized.
            wrench_offset: wrench (6,) [N, N m] at forces of 0, such as the drag of foils; None for
                none.
            uncertainty_cost: what a squared force of each foil costs beside its power (n,)
                [W/N^2]; None for nothing.
            counts: 1 of axes (6,) that the robot commands, else 0; None where it commands all.
        """
        n = len(responses)
        self.responses = responses
        self._forms = forms
        self._limits = limits
        self._wrench_scale = wrench_scale
        self._wrench_offset = np.zeros(6) if wrench_offset is None else wrench_offset
        self._counts = np.ones(6) if counts is None else counts
        no_cost = np.zeros(n)
        self._uncertainty_cost = no_cost if uncertainty_cost is None else uncertainty_cost
        self.ends = np.array([response.ends for response in responses])
        """Least and largest forces (n, 2) [N], of planes below 0 in reverse."""
        self.is_line = np.array([isinstance(response, Line) for response in responses])
        """Which have one direction (n,)."""
        self.is_pod = np.array([form.kind == "pod" for form in forms])
        """Which push at an angle of their own (n,)."""
        self.flow_speed = np.array([_flow_speed(response) for response in responses])
        """Power per newton of drag (n,) [m/s] of what drags; 0 of all else."""
        self._largest_force = self._largest_forces()
        self.row_force_max = self._largest_force + _NO_FORCE
        """Largest force (n, 2) [N] along each direction, never 0."""
        self._secant = self._usual_secants()
        tables = _Tables(tables_begin(n))
        self._offsets = [tables.of(*pair) for pair in zip(responses, forms, strict=True)]
        self._tables = tables.numbers
        self.effectiveness = np.array([response.rows for response in responses])
        """Wrench (n, 2, 6) per newton along each direction."""
        self.axes = np.array([_axes_of(form) for form in forms])
        """Axes (n, 3, 3) of the laws' forces in the actuators' own ones."""
        self._effectiveness_normalized = self.axes @ effectiveness / wrench_scale
        self.axis_scale = self._largest_wrench()
        """Size (6,) of what the robot can push along each axis [N, N m]; 1 where it cannot. Scaled
        wrenches are wrenches over it."""
        self.basis = self.span(np.ones(n, bool), np.ones(6, bool))
        """Directions (6, r) of scaled wrenches that the actuators span, orthonormal."""
        self.block = self._block()
        """The numbers that the core reads; see finlab/core/fl_fields.h."""
        self.core = Core(self.block, n)
        """The robot in the core."""

    def _largest_forces(self) -> Array:
        """Largest forces (n, 2) [N] along both directions; the second one of a foil is its drag."""
        largest = np.abs(self.ends).max(axis=1)
        drag = np.array([self._drag(i, force) for i, force in enumerate(largest)])
        second = np.where(self.is_line, drag, largest)
        return np.stack([largest, second], axis=1)

    def _usual_secants(self) -> Array:
        """Forces over prices (n, 2) [N^2/W] at the largest force, by half of it; of drag, which
        grows with the square of lift, by the square of its share."""
        usual_price = np.array([[_usual_price(response)] for response in self.responses])
        secant = self.row_force_max[:, :1] / usual_price
        share = self.row_force_max / self.row_force_max[:, :1]
        exponent = [0.0, 2.0]
        return np.asarray(secant * share**exponent)

    def _largest_wrench(self) -> Array:
        """Size (6,) of what the robot can push along each axis [N, N m]; 1 where it cannot."""
        columns = (self.effectiveness * self._largest_force[..., None]).reshape(-1, 6)
        size = np.sqrt((columns**2).sum(axis=0))
        largest = max(size.max(), _LEAST_POSITIVE)
        return np.where(size > NOTHING * largest, size, 1.0)

    def span(self, works: NDArray[np.bool_], counts: NDArray[np.bool_]) -> Array:
        """Finds what some actuators span in some axes.

        Args:
            works: which actuators (n,) work.
            counts: which axes (6,) count.

        Returns:
            Directions (6, r) of scaled wrenches that these actuators drive, orthonormal.
        """
        scaled = self.effectiveness * self._largest_force[..., None] / self.axis_scale
        is_driven = works[:, None, None] & counts
        columns = np.where(is_driven, scaled, 0.0).reshape(-1, 6).T
        left, singular_values, _ = np.linalg.svd(columns, full_matrices=False)
        least = NOTHING * max(singular_values[0], _LEAST_POSITIVE)
        return np.asarray(left[:, singular_values > least])

    @cached_property
    def largest_power(self) -> float:
        """Power [W] of all actuators at the dearer ends of their sets."""
        pairs = zip(self.responses, self.ends, strict=True)
        return float(sum(power_of(each, ends).max() for each, ends in pairs))

    def _drag(self, i: int, force: float) -> float:
        """Drag [N], beyond that at rest, of a foil's lift; 0 of all else."""
        if self.flow_speed[i] == 0.0:
            return 0.0
        response = self.responses[i]
        power = power_of(response, np.array(force))
        power_at_rest = response.table.power_at_least
        return float((power - power_at_rest) / self.flow_speed[i])

    def _block(self) -> Array:
        """The robot as the core reads it: head, actuators, then the tables."""
        rank = self.basis.shape[1]
        head = np.zeros((), struct("fl_head"))
        head["magic"] = constant("FL_MAGIC")
        head["version"] = VERSION
        head["n"] = len(self.responses)
        head["rank"] = rank
        head["axis_scale"] = self.axis_scale
        head["wrench_scale"] = self._wrench_scale
        head["is_commanded"] = self._counts
        head["wrench_offset"] = self._wrench_offset
        head["basis"][:, :rank] = self.basis

        actuators = np.zeros(len(self.responses), struct("fl_actuator"))
        actuators["force_min"] = self.ends[:, 0]
        actuators["force_max"] = self.ends[:, 1]
        actuators["flow_speed"] = self.flow_speed
        actuators["secant"] = self._secant
        actuators["row_force_max"] = self.row_force_max
        actuators["effectiveness_reduced"][..., :rank] = (
            self.effectiveness / self.axis_scale
        ) @ self.basis
        actuators["effectiveness_normalized"] = self._effectiveness_normalized
        actuators["uncertainty_cost"] = self._uncertainty_cost
        limits = self._limits
        actuators["command_min"] = limits.lower
        actuators["command_max"] = limits.upper
        actuators["max_change"] = np.minimum(limits.max_change, _INFINITE_CHANGE)
        actuators["is_free_angle"] = np.any(limits.turns, axis=1)
        described = zip(actuators, self.responses, self._forms, self._offsets, strict=True)
        for actuator, response, form, offsets in described:
            _describe(actuator, response, form, offsets)

        head["length"] = tables_begin(len(actuators)) + len(self._tables)
        return np.concatenate([numbers_of(head), numbers_of(actuators), self._tables])


def _describe(actuator: Any, response: Response, form: Form, offsets: "TableOffsets") -> None:
    """Writes what one actuator offers, and how its forces become commands, into its fields."""
    _, force_scale, power_scale = response.table.origin
    actuator["force_scale"] = force_scale
    actuator["power_scale"] = power_scale
    actuator["dead_band"] = response.dead_band
    # A foil has two rows: lift, and the drag of that lift.
    actuator["rows"] = 1.0 if actuator["flow_speed"] == 0.0 else 2.0
    actuator["force_min_needed"] = actuator["force_min"]
    if isinstance(response, Plane):
        actuator["rows"] = 2.0
        actuator["sector_center"] = response.sector_center
        actuator["sector_half_angle"] = response.sector_half_angle
        if _needs_no_reverse(response):
            actuator["force_min_needed"] = 0.0

    actuator["command_kind"] = constant(f"FL_{form.kind.upper()}")
    for field, offset in offsets._asdict().items():
        actuator[field] = offset
    for field in _FIELDS_OF_FORM:
        actuator[field] = getattr(form, field)


class TableOffsets(NamedTuple):
    """Offsets of one actuator's tables in the block, by the fields of `fl_actuator` that hold them;
    0 for none."""

    force_table: int
    """Of force over price."""
    force_table_reverse: int
    """Of the same in reverse."""
    gauge_table: int
    """Of how the force differs between directions."""
    law_grid: int
    """Of the grid of the law."""
    command_table: int
    """Of a fin's amplitudes and frequencies, or a foil's lifts and angles."""


class _Tables:
    """Tables at the end of a block; what several actuators share stands there once."""

    def __init__(self, begin: int) -> None:
        """Takes the offset of the first table in the block."""
        self._numbers: list[Array] = []
        self._known: dict[int, int] = {}
        self._end = begin

    def offset(self, key: object, make: Callable[[], Array]) -> int:
        """Returns the offset of the table of a thing, which is made where it is new; 0 for None."""
        if key is None:
            return 0
        if id(key) not in self._known:
            table = make()
            self._numbers.append(table)
            self._known[id(key)] = self._end
            self._end += len(table)
        return self._known[id(key)]

    def radial(self, table: RadialTable | None) -> int:
        """Returns the offset of a table of force over price; 0 for None."""
        if table is None:
            return 0
        original = table.origin[0]
        return self.offset(original, lambda: original.numbers)

    def of(self, response: Response, form: Form) -> TableOffsets:
        """Returns the offsets of an actuator's tables."""
        gauge = response.gauge if isinstance(response, Plane) else None
        law = form.law
        beat = form.beat
        return TableOffsets(
            force_table=self.radial(response.table),
            force_table_reverse=self.radial(response.reverse),
            gauge_table=self.offset(
                gauge, lambda: gauge_numbers(cast(Array, gauge), cast(Array, form.deflection))
            ),
            law_grid=self.offset(law, lambda: cast(Array, law)),
            command_table=self.offset(beat, lambda: _counted(cast(Array, beat), form.kind)),
        )

    @property
    def numbers(self) -> Array:
        """All of them, in order."""
        return np.concatenate(self._numbers)


def _flow_speed(response: Response) -> float:
    """Power per newton of drag [m/s] of a foil; 0 of all else."""
    if isinstance(response, Line) and response.drag is not None:
        return response.flow_speed
    return 0.0


def _axes_of(form: Form) -> Array:
    """Axes (3, 3) of a law's forces in the actuator's own ones."""
    return np.eye(3) if form.axes is None else form.axes


def _counted(rows: Array, kind: str) -> Array:
    """A curve, or a beat: how many points, or cells, then these."""
    count = len(rows) - 1 if kind == "fin" else len(rows)
    return np.concatenate([[count], rows.ravel()])


def gauge_numbers(gauge: Array, deflection: Array) -> Array:
    """Returns a gauge as the core takes it.

    A force in direction psi is at most gauge(psi) times that of the table, so a price in direction
    theta is worth the support function h(theta) = max over psi of gauge(psi) cos(theta - psi). The
    parabola through the best three directions stands for the gauge between them.

    Args:
        gauge: radii (G,) in G even directions around the circle.
        deflection: angles (POINTS,) [rad] from the command's direction to the force's.

    Returns:
        POINTS, then in each of as many directions the support function, its derivative, the gauge
        and the deflection.
    """
    count = len(gauge)
    theta = np.arange(POINTS) * TURN / POINTS
    step = TURN / count
    psi = np.arange(count) * TURN / count
    reached = gauge * np.cos(theta[:, None] - psi)
    best = reached.argmax(axis=1)
    row = np.arange(POINTS)

    # The parabola h(x) = h_1 + x (h_2 - h_0) / 2 + x^2 (h_0 - 2 h_1 + h_2) / 2 around the best
    # direction.
    h0 = reached[row, (best - 1) % count]
    h1 = reached[row, best]
    h2 = reached[row, (best + 1) % count]
    curvature = h0 - 2.0 * h1 + h2
    peak = 0.5 * (h0 - h2) / np.minimum(curvature, -_LEAST_POSITIVE)
    x = np.clip(np.where(curvature < 0.0, peak, 0.0), -0.5, 0.5)
    support = h1 + x * (0.5 * (h2 - h0) + 0.5 * x * curvature)

    # The radius there by the same parabola, and h'(theta) = -rho sin(theta - psi).
    g0 = gauge[(best - 1) % count]
    g1 = gauge[best]
    g2 = gauge[(best + 1) % count]
    rho = g1 + x * (0.5 * (g2 - g0) + 0.5 * x * (g0 - 2.0 * g1 + g2))
    slope = -rho * np.sin(theta - psi[best] - x * step)
    radius = np.interp(theta, np.append(psi, TURN), np.append(gauge, gauge[0]))
    rows = np.stack([support, slope, radius, deflection], axis=-1)
    return np.concatenate([[POINTS], rows.ravel()])


def _usual_price(response: Response) -> float:
    """Price [W/N] of an actuator's largest force where power grows as its power of 1.5 from half of
    it on: at the peak of a soft fin the price itself says nothing of the forces below."""
    prices = []
    for table in filter(None, (response.table, response.reverse)):
        middle = 0.5 * (table.force[0] + table.force[-1])
        price = float(np.sqrt(2.0) * np.interp(middle, table.force, price_grid(table.top)))
        prices.append(min(max(price, CLOSE * table.top), table.top))
    return max(prices)


def _needs_no_reverse(plane: Plane) -> bool:
    """Whether a plane that turns all round gives forward what it gives in reverse, at no more
    power."""
    ahead = plane.table
    back = plane.reverse
    if back is None or plane.sector_half_angle < np.pi:
        return False
    if back.largest > ahead.largest or back.power_at_least < ahead.power_at_least:
        return False
    price = price_grid(back.top)
    force_ahead = np.interp(price, price_grid(ahead.top), ahead.force)
    return bool((force_ahead >= back.force * (1.0 - NEARLY)).all())
