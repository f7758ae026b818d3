"""The block of a robot: all that the core in C reads of it, as one array of numbers.

`Compiled` makes it; who changes it reads docs/develop/block.md first.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.response import POINTS, Form, Plane, RadialTable, Response, price_grid
from finlab.arrays import CLOSE, NEARLY, AnyArray, Array
from finlab.axes import TURN
from finlab.core import VERSION
from finlab.core.fields import constant, numbers_of, struct, tables_begin

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
_LEAST_POSITIVE = 1e-300
"""Stands for 0 where a number is divided by."""
_INFINITE_CHANGE = 1e30
"""Stands for an infinite change of a command in a tick: C reads no infinity."""


class BlockContents(NamedTuple):
    """What a block says of a robot of n actuators, each with forces along one or two directions;
    the basis has r directions."""

    responses: list[Response]
    """What each actuator offers for prices."""
    forms: list[Form]
    """How the forces of each become commands."""
    command_min: AnyArray
    """Least commands (n, 3), in the units of the commands."""
    command_max: AnyArray
    """Largest commands (n, 3)."""
    max_change: AnyArray
    """Largest changes (n, 3) of commands in a tick; infinite where nothing limits them."""
    is_free_angle: NDArray[np.bool_]
    """Which actuators (n,) have an angle without limits in their command."""
    force_range: Array
    """Least and largest forces (n, 2) [N], of planes below 0 in reverse."""
    row_force_max: Array
    """Largest force (n, 2) [N] along each direction, never 0."""
    flow_speed: Array
    """Power per newton of drag (n,) [m/s] of what drags; 0 of all else."""
    uncertainty_cost: Array
    """What a squared force costs beside its power (n,) [W/N^2]."""
    effectiveness: Array
    """Wrench (n, 2, 6) per newton along each direction [1, m]."""
    effectiveness_of_laws: Array
    """Wrench (n, 3, 6) per newton along the axes of the laws' forces [1, m]."""
    wrench_scale: Array
    """(6,) [N, N m], by which errors are normalized."""
    wrench_offset: Array
    """Wrench (6,) [N, N m] at forces of 0, such as the drag of foils."""
    is_commanded: Array
    """1 of axes (6,) that the robot commands, else 0."""
    axis_scale: Array
    """What wrenches (6,) are divided by before they are projected onto the basis [N, N m]."""
    basis: Array
    """Directions (6, r) of scaled wrenches that the actuators span, orthonormal."""


def block_of(contents: BlockContents) -> Array:
    """Returns the block of a robot: head, actuators, then the tables; see
    finlab/core/fl_fields.h."""
    n = len(contents.responses)
    rank = contents.basis.shape[1]
    head = np.zeros((), struct("fl_head"))
    head["magic"] = constant("FL_MAGIC")
    head["version"] = VERSION
    head["n"] = n
    head["rank"] = rank
    head["axis_scale"] = contents.axis_scale
    head["wrench_scale"] = contents.wrench_scale
    head["is_commanded"] = contents.is_commanded
    head["wrench_offset"] = contents.wrench_offset
    head["basis"][:, :rank] = contents.basis

    actuators = np.zeros(n, struct("fl_actuator"))
    actuators["force_min"] = contents.force_range[:, 0]
    actuators["force_max"] = contents.force_range[:, 1]
    actuators["flow_speed"] = contents.flow_speed
    actuators["secant"] = _usual_secants(contents.responses, contents.row_force_max)
    actuators["row_force_max"] = contents.row_force_max
    actuators["effectiveness_reduced"][..., :rank] = (
        contents.effectiveness / contents.axis_scale
    ) @ contents.basis
    actuators["effectiveness_normalized"] = contents.effectiveness_of_laws / contents.wrench_scale
    actuators["uncertainty_cost"] = contents.uncertainty_cost
    actuators["command_min"] = contents.command_min
    actuators["command_max"] = contents.command_max
    actuators["max_change"] = np.minimum(contents.max_change, _INFINITE_CHANGE)
    actuators["is_free_angle"] = contents.is_free_angle

    tables = _Tables(tables_begin(n))
    described = zip(actuators, contents.responses, contents.forms, strict=True)
    for actuator, response, form in described:
        _describe(actuator, response, form, tables.of(response, form))
    numbers = tables.numbers

    head["length"] = tables_begin(n) + len(numbers)
    return np.concatenate([numbers_of(head), numbers_of(actuators), numbers])


def _usual_secants(responses: list[Response], row_force_max: Array) -> Array:
    """Forces over prices (n, 2) [N^2/W] at the largest force, by half of it; of drag, which grows
    with the square of lift, by the square of its share."""
    usual_price = np.array([[_usual_price(response)] for response in responses])
    secant = row_force_max[:, :1] / usual_price
    share = row_force_max / row_force_max[:, :1]
    exponent = [0.0, 2.0]
    return np.asarray(secant * share**exponent)


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
        actuator["barred_count"] = len(response.barred)
        for k, zone in enumerate(response.barred):
            actuator["barred"][k] = zone
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
        gauge = None  # a rudder in a slipstream has its curve in place of a table of directions
        if isinstance(response, Plane) and form.deflection is not None:
            gauge = response.gauge
        law = form.law
        command_table = form.command_table
        return TableOffsets(
            force_table=self.radial(response.table),
            force_table_reverse=self.radial(response.reverse),
            gauge_table=self.offset(
                gauge, lambda: gauge_numbers(cast(Array, gauge), cast(Array, form.deflection))
            ),
            law_grid=self.offset(law, lambda: cast(Array, law)),
            command_table=self.offset(
                command_table,
                lambda: np.concatenate(
                    [[form.command_table_count], cast(Array, command_table).ravel()]
                ),
            ),
        )

    @property
    def numbers(self) -> Array:
        """All of them, in order."""
        return np.concatenate(self._numbers)


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
        price = float(np.sqrt(2.0) * np.interp(middle, table.force, price_grid(table.price_max)))
        prices.append(min(max(price, CLOSE * table.price_max), table.price_max))
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
    price = price_grid(back.price_max)
    force_ahead = np.interp(price, price_grid(ahead.price_max), ahead.force)
    return bool((force_ahead >= back.force * (1.0 - NEARLY)).all())
