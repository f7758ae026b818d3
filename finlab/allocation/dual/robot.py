"""A robot as the core sees it: scaled effectiveness in the range that its actuators span, and their tables."""

from copy import copy
from functools import cached_property

import numpy as np

from finlab.actuators.response import POINTS, Line, Plane, RadialTable, Response, power_of, price_grid
from finlab.arrays import Array
from finlab.axes import TURN
from finlab.core.calls import MAGIC, Core
from finlab.core.library import VERSION
from finlab.precision import CLOSE, NEARLY, NOTHING


class DualRobot:
    """One robot, prepared of the responses of its n actuators: forces along one or two directions of each."""

    def __init__(self, responses: list[Response], yardstick: Array | None = None) -> None:
        """Takes what the actuators offer, and the yardstick (6,) of errors [N, N m]."""
        self.responses = responses
        self.yardstick = np.ones(6) if yardstick is None else yardstick
        self.ends = np.array([each.ends for each in responses])
        """Least and largest forces (n, 2) [N], of planes below 0 in reverse."""
        self.lines = np.array([isinstance(each, Line) for each in responses])
        """Which have one direction (n,)."""
        speeds = [each.speed if isinstance(each, Line) and each.drag is not None else 0.0 for each in responses]
        self.speed = np.array(speeds)
        """Power per newton of drag (n,) [m/s] of what drags; 0 of all else."""
        sizes, self._gain = np.abs(self.ends).max(axis=1), np.zeros((len(responses), 2))
        drag = np.array([self._drag(i, size) for i, size in enumerate(sizes)])
        second = np.where(self.lines, drag, sizes)
        self._sizes = np.stack([sizes, second], axis=1)
        self.most = self._sizes + 1e-12
        """Largest force (n, 2) [N] along each direction."""
        self._gain = self.most[:, :1] / np.array([[_usual_price(each)] for each in responses])
        self._gain = self._gain * (self.most / self.most[:, :1]) ** [0.0, 2.0]
        self._tables, self._places = _tables_of(responses, _HEAD + _EACH * len(responses))
        self._span(np.array([each.rows for each in responses]))

    def _span(self, effectiveness: Array) -> None:
        self.effectiveness = effectiveness
        """Wrench (n, 2, 6) per newton along each direction."""
        scaled = (effectiveness * self._sizes[..., None]).reshape(-1, 6)
        size = np.sqrt((scaled**2).sum(axis=0))
        self.scale = np.where(size > NOTHING * max(size.max(), 1e-300), size, 1.0)
        """Size (6,) of what the robot can push along each axis [N, N m]; 1 where it cannot."""
        left, values, _ = np.linalg.svd((scaled / self.scale).T, full_matrices=False)
        self.basis = left[:, values > NOTHING * max(values[0], 1e-300)]
        """Directions (6, r) of scaled wrenches that the actuators span, orthonormal."""
        self.core = Core(self._block(), len(self.responses))
        """The robot in the core."""

    def tilted(self, effectiveness: Array) -> "DualRobot":
        """The same actuators with another effectiveness (n, 2, 6)."""
        other = copy(self)
        other.__dict__.pop("largest_power", None)
        other._span(effectiveness)
        return other

    @cached_property
    def largest_power(self) -> float:
        """Power [W] of all actuators at the dearer ends of their sets."""
        return float(sum(power_of(each, ends).max() for each, ends in zip(self.responses, self.ends, strict=True)))

    def wrench(self, force: Array) -> Array:
        """Wrenches (..., 6) [N, N m] of forces (..., n, 2) [N]."""
        return np.asarray(np.einsum("...nk,nkw->...w", force, self.effectiveness))

    def price(self, inner: Array) -> Array:
        """Prices (6,) [W/N, W/(N m)] of the wrench from those in the basis (6,) [W]."""
        return np.asarray(self.basis @ inner[: self.basis.shape[1]] / self.scale)

    def _drag(self, i: int, force: float) -> float:
        line = self.responses[i]
        return (float(power_of(line, np.array(force))) - line.table.rest) / self.speed[i] if self.speed[i] > 0.0 else 0.0

    def _block(self) -> Array:
        """The numbers of finlab/core/core.h."""
        rank, basis = self.basis.shape[1], np.zeros((6, 6))
        basis[:, :rank] = self.basis
        matrix = np.zeros((len(self.responses), 2, 6))
        matrix[..., :rank] = (self.effectiveness / self.scale) @ self.basis
        length = _HEAD + _EACH * len(self.responses) + len(self._tables)
        head = np.array([MAGIC, VERSION, length, len(self.responses), rank])
        parts = [head, self.scale, self.yardstick, np.zeros(6), basis.ravel()]
        for i, each in enumerate(self.responses):
            ahead, back, gauge = self._places[i]
            low, high = self.ends[i]
            plane = isinstance(each, Plane)
            least = 0.0 if isinstance(each, Plane) and _needs_no_reverse(each) else low
            arc = (each.middle, each.half) if isinstance(each, Plane) else (0.0, 0.0)
            rows = 2.0 if plane or self.speed[i] > 0.0 else 1.0
            own = [rows, ahead, back, *each.table.origin[1:], gauge, low, high, least, *arc, each.band, self.speed[i]]
            parts += [np.array(own), self._gain[i], self.most[i], matrix[i].ravel()]
        return np.concatenate([*parts, self._tables])


_HEAD, _EACH = 59, 29


def _tables_of(responses: list[Response], start: int) -> tuple[Array, list[tuple[int, int, int]]]:
    """Tables of a block that begin at a place, and each actuator's places: ahead, in reverse, gauge."""
    numbers: list[Array] = []
    known: dict[int, int] = {}
    end = start

    def placed(own: RadialTable | Array | None) -> int:
        nonlocal end
        if own is None:
            return 0
        if isinstance(own, RadialTable):
            own = own.origin[0]
        if id(own) not in known:
            new = own.numbers if isinstance(own, RadialTable) else gauge_numbers(own)
            known[id(own)], end = end, end + len(new)
            numbers.append(new)
        return known[id(own)]

    places = [
        (placed(each.table), placed(each.reverse), placed(None if isinstance(each, Line) else each.gauge))
        for each in responses
    ]
    return np.concatenate(numbers), places


def gauge_numbers(gauge: Array) -> Array:
    """A gauge (G,) as the core takes it: in each of POINTS directions the support function, its derivative and
    the gauge; the parabola through the best three directions stands for the gauge between them."""
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
    return np.concatenate([[POINTS], np.stack([sigma, slope, own], axis=-1).ravel()])


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
