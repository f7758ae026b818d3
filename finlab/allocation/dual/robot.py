"""A robot as the core sees it: scaled effectiveness in the range that its actuators span, and tables."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.form import Form
from finlab.actuators.response import POINTS, Line, Plane, RadialTable, Response, power_of, price_grid
from finlab.arrays import AnyArray, Array
from finlab.axes import TURN
from finlab.core.calls import MAGIC, Core
from finlab.core.fields import numbers_of, struct, tables_begin
from finlab.core.library import VERSION
from finlab.precision import CLOSE, NEARLY, NOTHING


class DualRobot:
    """One robot, prepared of the responses of its n actuators: forces along one or two directions of each."""

    def __init__(
        self,
        responses: list[Response],
        forms: list[Form],
        limits: Sequence[AnyArray],
        effectiveness: Array,
        yardstick: Array,
        beside: Array | None = None,
        doubt: Array | None = None,
        counts: Array | None = None,
    ) -> None:
        """Takes what the actuators offer, how forces become commands, least and largest commands, largest
        changes in a tick and free angles (n, 3), the wrench (n, 3, 6) per newton along their own axes, the
        yardstick (6,) of errors, the wrench (6,) on top of that of the forces [N, N m], what a squared
        force of each foil costs beside its power (n,) [W/N^2], and 1 of axes (6,) that count, else 0."""
        self.responses, self._forms, self._limits = responses, forms, limits
        self.yardstick, self.beside = yardstick, np.zeros(6) if beside is None else beside
        self._counts = np.ones(6) if counts is None else counts
        self._doubt = np.zeros(len(responses)) if doubt is None else doubt
        self.ends = np.array([each.ends for each in responses])
        """Least and largest forces (n, 2) [N], of planes below 0 in reverse."""
        self.lines = np.array([isinstance(each, Line) for each in responses])
        """Which have one direction (n,)."""
        speeds = [
            each.speed if isinstance(each, Line) and each.drag is not None else 0.0 for each in responses
        ]
        self.speed = np.array(speeds)
        """Power per newton of drag (n,) [m/s] of what drags; 0 of all else."""
        sizes = np.abs(self.ends).max(axis=1)
        drag = np.array([self._drag(i, size) for i, size in enumerate(sizes)])
        second = np.where(self.lines, drag, sizes)
        self._sizes = np.stack([sizes, second], axis=1)
        self.most = self._sizes + 1e-12
        """Largest force (n, 2) [N] along each direction."""
        gain = self.most[:, :1] / np.array([[_usual_price(each)] for each in responses])
        self._gain = gain * (self.most / self.most[:, :1]) ** [0.0, 2.0]
        tables = _Tables(tables_begin(len(responses)))
        self._places = [tables.of(*each) for each in zip(responses, forms, strict=True)]
        self._tables = tables.numbers
        self.effectiveness = np.array([each.rows for each in responses])
        """Wrench (n, 2, 6) per newton along each direction."""
        self.axes = np.array([np.eye(3) if form.axes is None else form.axes for form in forms])
        """Axes (n, 3, 3) of the laws' forces in the actuators' own ones."""
        self._own = self.axes @ effectiveness / yardstick
        scaled = (self.effectiveness * self._sizes[..., None]).reshape(-1, 6)
        size = np.sqrt((scaled**2).sum(axis=0))
        self.scale = np.where(size > NOTHING * max(size.max(), 1e-300), size, 1.0)
        """Size (6,) of what the robot can push along each axis [N, N m]; 1 where it cannot."""
        self.basis = self.span(np.ones(len(responses), bool), np.ones(6, bool))
        """Directions (6, r) of scaled wrenches that the actuators span, orthonormal."""
        self.block = self._block()
        """The numbers that the core reads; see finlab/core/fl_fields.h."""
        self.core = Core(self.block, len(responses))
        """The robot in the core."""

    def span(self, works: NDArray[np.bool_], counts: NDArray[np.bool_]) -> Array:
        """Returns directions (6, r) of scaled wrenches, orthonormal, that the actuators which work (n,) drive
        in the axes that count (6,)."""
        scaled = self.effectiveness * self._sizes[..., None] / self.scale
        columns = np.where(works[:, None, None] & counts, scaled, 0.0).reshape(-1, 6).T
        left, values, _ = np.linalg.svd(columns, full_matrices=False)
        return np.asarray(left[:, values > NOTHING * max(values[0], 1e-300)])

    @cached_property
    def largest_power(self) -> float:
        """Power [W] of all actuators at the dearer ends of their sets."""
        pairs = zip(self.responses, self.ends, strict=True)
        return float(sum(power_of(each, ends).max() for each, ends in pairs))

    def _drag(self, i: int, force: float) -> float:
        """Drag [N], beyond that at rest, of a foil's lift; 0 of all else."""
        if self.speed[i] == 0.0:
            return 0.0
        cost, rest = power_of(self.responses[i], np.array(force)), self.responses[i].table.rest
        return float((cost - rest) / self.speed[i])

    def _block(self) -> Array:
        """The robot as the core reads it: head, actuators, then the tables."""
        rank = self.basis.shape[1]
        head = np.zeros((), struct("fl_head"))
        head["magic"] = MAGIC
        head["version"] = VERSION
        head["n"] = len(self.responses)
        head["range"] = rank
        head["scale"] = self.scale
        head["yard"] = self.yardstick
        head["counts"] = self._counts
        head["beside"] = self.beside
        head["basis"][:, :rank] = self.basis

        actuators = np.zeros(len(self.responses), struct("fl_actuator"))
        actuators["low"] = self.ends[:, 0]
        actuators["high"] = self.ends[:, 1]
        actuators["speed"] = self.speed
        actuators["gain"] = self._gain
        actuators["most"] = self.most
        actuators["matrix"][..., :rank] = (self.effectiveness / self.scale) @ self.basis
        actuators["own"] = self._own
        actuators["doubt"] = self._doubt
        lower, upper, step, turns = self._limits
        actuators["lower"] = lower
        actuators["upper"] = upper
        actuators["step"] = np.minimum(step, 1e30)  # C reads no infinity
        actuators["turns"] = np.any(turns, axis=1)
        described = zip(actuators, self.responses, self._forms, self._places, strict=True)
        for actuator, response, form, places in described:
            _describe(actuator, response, form, places)

        head["length"] = tables_begin(len(actuators)) + len(self._tables)
        return np.concatenate([numbers_of(head), numbers_of(actuators), self._tables])


def _describe(actuator: Any, response: Response, form: Form, places: "TablePlaces") -> None:
    """Writes what one actuator offers, and how its forces become commands, into its fields."""
    _, share, worth = response.table.origin
    actuator["share"] = share
    actuator["worth"] = worth
    actuator["band"] = response.band
    # A foil has two rows: lift, and the drag of that lift.
    actuator["rows"] = 1.0 if actuator["speed"] == 0.0 else 2.0
    actuator["least"] = actuator["low"]
    if isinstance(response, Plane):
        actuator["rows"] = 2.0
        actuator["middle"] = response.middle
        actuator["half"] = response.half
        if _needs_no_reverse(response):
            actuator["least"] = 0.0

    actuator["form"] = _KINDS.index(form.kind)
    for field, place in places._asdict().items():
        actuator[field] = place
    for field, number in zip(_CONVERSION, form.numbers, strict=True):
        actuator[field] = number


class TablePlaces(NamedTuple):
    """Where the tables of one actuator lie in the block, by the fields that name them; 0 for none."""

    ahead: int
    back: int
    gauge: int
    law: int
    beat: int


_KINDS = "thruster", "pod", "fin", "foil"


_CONVERSION = ("sign", "lean", "uneven", "uneven_at", "pressure", "turned", "rest")
"""Fields of an actuator that turn a force into a command, in the order of `Form.numbers`."""


class _Tables:
    """Tables at the end of a block, each once."""

    def __init__(self, start: int) -> None:
        self._numbers: list[Array] = []
        self._known: dict[int, int] = {}
        self._end = start

    def place(self, key: object, make: Callable[[], Array]) -> int:
        """The place of the table of a thing, 0 for None."""
        if key is None:
            return 0
        if id(key) not in self._known:
            self._numbers.append(make())
            self._known[id(key)] = self._end
            self._end += len(self._numbers[-1])
        return self._known[id(key)]

    def radial(self, table: RadialTable | None) -> int:
        """The place of a table of force over price."""
        return 0 if table is None else self.place(table.origin[0], lambda: table.origin[0].numbers)

    def of(self, response: Response, form: Form) -> TablePlaces:
        """Places of an actuator's tables."""
        gauge = response.gauge if isinstance(response, Plane) else None
        law = form.law
        beat = form.beat
        return TablePlaces(
            ahead=self.radial(response.table),
            back=self.radial(response.reverse),
            gauge=self.place(gauge, lambda: gauge_numbers(cast(Array, gauge), cast(Array, form.deflection))),
            law=self.place(law, lambda: cast(Array, law)),
            beat=self.place(beat, lambda: _counted(cast(Array, beat), form.kind)),
        )

    @property
    def numbers(self) -> Array:
        """All of them, in order."""
        return np.concatenate(self._numbers)


def _counted(rows: Array, kind: str) -> Array:
    """A curve, or a beat: how many points, or cells, then these."""
    return np.concatenate([[len(rows) - (kind == "fin")], rows.ravel()])


def gauge_numbers(gauge: Array, deflection: Array) -> Array:
    """A gauge (G,) as the core takes it: in each of POINTS directions the support function, its derivative,
    the gauge and the deflection (POINTS,); the parabola through the best three directions stands for the
    gauge between them."""
    count, angle = len(gauge), np.arange(POINTS) * TURN / POINTS
    step, psi = TURN / count, np.arange(count) * TURN / count
    worth = gauge * np.cos(angle[:, None] - psi)
    best, row = worth.argmax(axis=1), np.arange(POINTS)
    before, at, after = (worth[row, (best + k) % count] for k in (-1, 0, 1))
    bend = before - 2.0 * at + after
    offset = np.clip(np.where(bend < 0.0, 0.5 * (before - after) / np.minimum(bend, -1e-300), 0.0), -0.5, 0.5)
    sigma = at + offset * (0.5 * (after - before) + 0.5 * offset * bend)
    g0, g1, g2 = (gauge[(best + k) % count] for k in (-1, 0, 1))
    rho = g1 + offset * (0.5 * (g2 - g0) + 0.5 * offset * (g0 - 2.0 * g1 + g2))
    slope = -rho * np.sin(angle - psi[best] - offset * step)
    own = np.interp(angle, np.append(psi, TURN), np.append(gauge, gauge[0]))
    return np.concatenate([[POINTS], np.stack([sigma, slope, own, deflection], axis=-1).ravel()])


def _usual_price(response: Response) -> float:
    """Price [W/N] of an actuator's largest force where power grows as its power of 1.5 from half of it on: at
    the peak of a soft fin the price itself says nothing of the forces below."""
    prices = []
    for table in filter(None, (response.table, response.reverse)):
        middle = 0.5 * (table.force[0] + table.force[-1])
        price = float(np.sqrt(2.0) * np.interp(middle, table.force, price_grid(table.top)))
        prices.append(min(max(price, CLOSE * table.top), table.top))
    return max(prices)


def _needs_no_reverse(plane: Plane) -> bool:
    """Whether a plane that turns all round gives forward what it gives in reverse, at no more power."""
    ahead, back = plane.table, plane.reverse
    if back is None or plane.half < np.pi or back.largest > ahead.largest or back.rest < ahead.rest:
        return False
    price = price_grid(back.top)
    own = np.interp(price, price_grid(ahead.top), ahead.force)
    return bool((own >= back.force * (1.0 - NEARLY)).all())
