"""The answer of a fin to a price: for each price the command that is worth most, by the fin's own
law.

The fin's amplitude and frequency maximize `v T(A, f) - P(A, f)` within its limits. That is found on
a grid of commands and made exact by finer and finer grids around the best place: it needs no
derivatives and holds for any law, convex or not. A fin whose force differs from one direction to
the next has a gauge: the share of the force that the same cost gives in each direction.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from threading import Lock
from typing import Any

import numpy as np

from finlab.actuators.fin.fin_laws import make_law
from finlab.actuators.fin.fin_model import FinModelSpec, Limits
from finlab.actuators.law import FinLaw, PlanarLaw
from finlab.actuators.response import POINTS, Form, Group, Plane, RadialTable, price_grid
from finlab.arrays import NEARLY, NOTHING, ROUNDING, ROUNDS, Array
from finlab.axes import TURN, is_full_turn, wrapped
from finlab.errors import DataError

GRID = 17, 33
"""Amplitudes and frequencies of the first grid; half as many where directions are compared."""
PEAK = 5e-4
"""Share of the largest force that is given up where the price of the last newton has no end."""


@dataclass(frozen=True, eq=False)
class FinTable:
    """How a fin answers a price, and by which commands."""

    table: RadialTable
    """Force over price in its strongest direction."""
    middle: float
    """Middle of the arc of force directions [rad]."""
    half: float
    """Half of it [rad]; pi for a full circle."""
    gauge: Array | None
    """Share (POINTS,) of the table's force in each direction, from 0 on; None where they are the
    same."""
    beat: Array
    """Amplitude [rad] and frequency [Hz] (POINTS + 1, 2) that give the force `largest (j /
    POINTS)^2`."""
    box: "_Box"
    """The law within the limits."""
    form: Form
    """How a force becomes a command."""
    deflection: Array
    """Direction of the force minus zero direction (POINTS,) [rad] around the circle; (1,) where it
    is the same."""

    @cached_property
    def rises(self) -> bool:
        """Whether the force is largest at the largest amplitude and frequency."""
        corner = self.box.command(self.box.upper[None, :2])
        return float(self.box.force(corner)[0]) >= self.box.largest() * (1.0 - NEARLY)

    @property
    def largest(self) -> float:
        """The largest force in any direction [N]."""
        return self.table.largest * (1.0 if self.gauge is None else float(self.gauge.max()))


class FinGroup(Group):
    """The fins of a robot as answers to prices: planes of forces, each compiled from its law."""

    def __init__(self, fins: Sequence[Any], effectiveness: Array) -> None:
        """Compiles fins with wrenches (m, 3, 6) per newton along each own axis, each model once in
        a process. Raises DataError: a table cannot be read, or a fin gives no thrust."""
        tables = [fin_table(fin) for fin in fins]
        self._tables = tables
        self._effectiveness = effectiveness
        self.responses = [
            Plane(matrix[1:], each.table, each.middle, each.half, each.gauge)
            for each, matrix in zip(tables, effectiveness, strict=True)
        ]
        self._largest = np.array([each.table.largest for each in tables])

    @property
    def forms(self) -> list[Form]:
        return [table.form for table in self._tables]

    def radial_worth(self, price: Array, back: Array, ends: Array | None) -> Array:
        """See `Group`: from the commands of the table on both sides of each price, by the law; of
        fins that were measured nothing. Where a price is below 0, or the force falls again towards
        its limits, from a grid of commands."""
        result = np.full(price.shape, np.nan)
        for i, table in enumerate(self._tables):
            if table.box.law.measured:
                continue
            own = price[:, i]
            place = (
                np.interp(own, price_grid(table.table.top), table.table.force) / self._largest[i]
            )
            cell = np.minimum((np.sqrt(place) * POINTS).astype(np.intp), POINTS - 1)
            starts = np.stack([table.beat[np.clip(cell + k, 0, POINTS)] for k in (-1, 0, 1, 2)])
            command = table.box.best(own, starts)
            worth = own * table.box.force(command) - table.box.power(command)
            if not table.rises or (own < 0.0).any():
                command = table.box.best(own)
                other = own * table.box.force(command) - table.box.power(command)
                worth = np.maximum(worth, other)
            result[:, i] = worth
        return result

    def worth(self, price: Array) -> Array:
        """See `Group`: a bound, of fins that were measured alone."""
        result = np.full((len(price), len(self._tables)), np.nan)
        for table in {id(table): table for table in self._tables}.values():
            if table.box.law.measured:
                places = [i for i, own in enumerate(self._tables) if own is table]
                own = np.einsum("maw,nw->nma", self._effectiveness[places], price)
                result[:, places] = _table_bound(table.box)(own.reshape(-1, 3)).reshape(
                    len(price), -1
                )
        return result


_LOCK = Lock()


def fin_table(fin: Any) -> FinTable:
    """One fin, compiled or kept from the last time; arguments and errors as for `FinGroup`."""
    with _LOCK:  # of two threads each would compile one, and equal fins would not be known as alike
        result = _compiled(fin.model, fin.limits, fin.stamp)
    if result is None:
        raise DataError(
            f"{fin.name}: gives no thrust within its limits, amplitudes "
            f"{fin.limits.amplitude[0]:.4g} to "
            f"{fin.limits.amplitude[1]:.4g} rad and frequencies {fin.limits.frequency[0]:.4g} to "
            f"{fin.limits.frequency[1]:.4g} Hz; widen the limits or leave the fin out"
        )
    return result


@lru_cache(maxsize=512)
def _compiled(
    model: FinModelSpec, limits: Limits, stamp: tuple[int, int] | None
) -> FinTable | None:
    """The table of a fin, None where it gives no thrust; one whose file has changed is read
    again."""
    law = make_law(model)
    box = _Box(law, np.array(limits.lower), np.array(limits.upper))
    strongest = box.largest()
    if strongest <= 0.0:
        return None
    top = box.top_price(strongest)
    command = box.best(price_grid(top))
    force = np.maximum.accumulate(box.force(command))
    table = RadialTable.of_forces(top, force, float(box.power(command[:1])[0]))
    size = force[-1] * np.linspace(0.0, 1.0, POINTS + 1) ** 2
    beat = np.stack([np.interp(size, force, command[:, k]) for k in range(2)], axis=-1)
    middle, half, gauge, deflection = _directions(law, box)
    form = _form(law, box, beat, gauge, deflection)
    return FinTable(table, middle, half, gauge, beat, box, form, deflection)


def _form(law: FinLaw, box: "_Box", beat: Array, gauge: Array | None, deflection: Array) -> Form:
    uneven, uneven_at = law.unevenness
    is_even = gauge is None
    return Form(
        "fin",
        law=law.grid_numbers(box.lower, box.upper),
        beat=beat,
        deflection=None if is_even else deflection,
        lean=float(deflection[0]) if is_even else float(law.offset),
        uneven=uneven,
        uneven_at=uneven_at,
    )


class _Box:
    """One fin's law within the limits of amplitude and frequency, in its strongest direction."""

    def __init__(self, law: FinLaw, lower: Array, upper: Array) -> None:
        self.law = law
        self.lower = lower
        self.upper = upper
        self.turn = float(np.clip(0.0, lower[2], upper[2]))
        if not law.uniform:
            turns, across = self.all_round
            within = (turns >= lower[2] - NOTHING) & (turns <= upper[2] + NOTHING)
            size = np.where(within, np.hypot(*across.T), -1.0)
            self.turn = float(turns[size.argmax()]) if within.any() else self.turn

    @cached_property
    def all_round(self) -> tuple[Array, Array]:
        """Zero directions (POINTS + 1,) [rad] and the largest forces (POINTS + 1, 2) [N] there, by
        a coarse grid."""
        low = self.lower[2]
        high = self.upper[2]
        if isinstance(self.law, PlanarLaw):  # a formula holds beyond the limits, too
            low, high = 0.5 * (low + high) - np.pi, 0.5 * (low + high) + np.pi
        turns = np.linspace(low, high, POINTS + 1)
        return turns, self.strongest(turns)

    def strongest(self, turns: Array) -> Array:
        """The largest forces across the shaft (K, 2) [N] at zero directions (K,), by a coarse
        grid."""
        command = np.tile(self.grid((GRID[0] // 2 + 1, GRID[1] // 2 + 1)), (len(turns), 1, 1))
        command[..., 2] = turns[:, None]
        across = self.law.force(command.reshape(-1, 3)).reshape(command.shape)[..., 1:]
        best = np.hypot(across[..., 0], across[..., 1]).argmax(axis=1)
        return np.asarray(across[np.arange(len(turns)), best])

    def command(self, beat: Array) -> Array:
        """Commands (..., 3) of amplitude and frequency (..., 2)."""
        return np.concatenate([beat, np.full((*beat.shape[:-1], 1), self.turn)], axis=-1)

    def force(self, command: Array) -> Array:
        """Sizes (...) [N] of the force in the fin's plane."""
        return np.asarray(np.linalg.norm(self.law.force(command)[..., 1:], axis=-1))

    def power(self, command: Array) -> Array:
        """Powers (...) [W]."""
        return np.asarray(self.law.power(command))

    def largest(self) -> float:
        """The largest force [N] within the limits."""
        return float(self.force(self.best(np.array([1e12])))[0])

    def grid(self, shape: tuple[int, int] = GRID) -> Array:
        """Commands (G, 3) on a grid of amplitudes and frequencies."""
        axes = [
            np.linspace(a, b, n) for a, b, n in zip(self.lower, self.upper, shape, strict=False)
        ]
        beat = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        return self.command(beat)

    def best(self, price: Array, starts: Array | None = None) -> Array:
        """Commands (K, 3) that are worth most at prices (K,) [W/N]: from the best of starts (S, K,
        2), or of a grid, by Newton's method within the limits."""
        row = np.arange(len(price))
        if starts is None:
            grid = self.grid()
            worth = price[:, None] * self.force(grid) - self.power(grid)
            beat = grid[worth.argmax(axis=1), :2]
        else:
            command = self.command(starts)
            worth = (price * self.force(command) - self.power(command)).T
            beat = starts[worth.argmax(axis=1), row]
        low = self.lower[:2]
        high = self.upper[:2]
        span = high - low
        longest = 2.0 * span / (np.array(GRID) - 1.0)
        value = worth.max(axis=1)
        for _ in range(ROUNDS):
            slope, curve = self._worth_derivatives(price, beat, NEARLY * span + 1e-15)
            step = np.clip(_uphill_steps(beat, slope, curve), -longest, longest)
            trial = np.clip(np.concatenate([step, 0.2 * step]) + beat, low, high)
            command = self.command(trial)
            result = price * self.force(command) - self.power(command)
            best = result.argmax(axis=0)
            better = result[best, row] > value
            if not better.any():
                break
            beat = np.where(better[:, None], trial[best, row], beat)
            value = np.where(better, result[best, row], value)
        return self.command(beat)

    def _worth_derivatives(self, price: Array, beat: Array, probe: Array) -> tuple[Array, Array]:
        """Gradient (K, 2) and Hessian (K, 2, 2) of what commands are worth, by amplitude and
        frequency."""
        at = np.where(beat + probe > self.upper[:2], beat - probe, beat)
        slope, *near = self._slope(
            price, np.stack([beat, at, at + probe * [1, 0], at + probe * [0, 1]])
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            curve = np.stack([near[1] - near[0], near[2] - near[0]], axis=-1) / probe
        return slope, 0.5 * (curve + curve.swapaxes(-1, -2))

    def _slope(self, price: Array, beat: Array) -> Array:
        command = self.command(beat)
        force, jacobian = self.law.force_and_jacobian(command)
        size = np.maximum(np.linalg.norm(force[..., 1:], axis=-1), 1e-300)
        along = (
            np.einsum("...ci,...i->...c", jacobian[..., :2, 1:], force[..., 1:]) / size[..., None]
        )
        return np.asarray(price[:, None] * along - self.law.power_gradient(command)[..., :2])

    def top_price(self, strongest: float) -> float:
        """The price [W/N] at which the fin gives its largest force, or nearly so where that has no
        end."""
        corner = self.upper[None, :2]
        zero = np.zeros(1)
        if float(self.force(self.command(corner))[0]) >= strongest * (1.0 - ROUNDING):
            moves = self.upper[:2] > self.lower[:2]
            saving = self._slope(zero, corner)
            marginal_force = (self._slope(zero + 1.0, corner) - saving)[0][moves]
            if (marginal_force > 1e-3 * strongest).all():
                price = -saving[0][moves] / marginal_force
                top = float(price.max()) if len(price) else NOTHING
                if float(self.force(self.best(np.array([top])))[0]) >= (1.0 - PEAK) * strongest:
                    return top
        low = NOTHING
        high = 1.0 / NOTHING
        for _ in range(5):
            prices = np.geomspace(low, high, 33)
            enough = self.force(self.best(prices)) >= (1.0 - PEAK) * strongest
            first = int(enough.argmax()) if enough.any() else len(prices) - 1
            low = float(prices[max(first - 1, 0)])
            high = float(prices[first])
        return high


@lru_cache(maxsize=32)
def _table_bound(box: _Box) -> Callable[[Array], Array]:
    """What forces of a fin that was measured are worth at most; see `TableBound`."""
    from finlab.actuators.fin.bernstein_bound import TableBound
    from finlab.actuators.fin.table_law import TableLaw

    assert isinstance(box.law, TableLaw)
    return TableBound(box.law, box.lower, box.upper)


def _uphill_steps(beat: Array, slope: Array, curve: Array) -> Array:
    """Steps (4, K, 2) uphill from amplitudes and frequencies (K, 2): Newton's, and those along the
    amplitude, the frequency, and both with a constant product."""
    a = curve[:, 0, 0]
    b = curve[:, 0, 1]
    c = curve[:, 1, 1]
    det = a * c - b * b
    ways = [np.broadcast_to(way, beat.shape) for way in ([1.0, 0.0], [0.0, 1.0])] + [
        beat * [1.0, -1.0]
    ]
    steps = []
    with np.errstate(all="ignore"):
        newton = np.stack(
            [b * slope[:, 1] - c * slope[:, 0], b * slope[:, 0] - a * slope[:, 1]], axis=-1
        )
        steps.append(np.where(((a < 0.0) & (det > 0.0))[:, None], newton / det[:, None], 0.0))
        for way in ways:
            up = np.einsum("ki,ki->k", way, slope)
            bend = np.einsum("ki,kij,kj->k", way, curve, way)
            steps.append(way * (up / np.where(bend < 0.0, -bend, np.abs(up) + 1e-300))[:, None])
    return np.asarray(np.nan_to_num(np.stack(steps), posinf=0.0, neginf=0.0))


def _directions(law: FinLaw, box: _Box) -> tuple[float, float, Array | None, Array]:
    """Middle and half of the arc of force directions [rad], gauge (POINTS,) or None, and
    deflection."""
    lower = box.lower
    upper = box.upper
    full = bool(is_full_turn(upper[2] - lower[2]))
    middle = 0.5 * float(lower[2] + upper[2])
    half = np.pi if full else 0.5 * float(upper[2] - lower[2])
    if law.uniform:
        force = law.force(np.append(upper[:2], box.turn))
        lean = float(wrapped(np.arctan2(force[2], force[1]) - box.turn))
        return middle + lean, half, None, np.array([lean])
    turns, across = box.all_round
    direction = np.arctan2(across[:, 1], across[:, 0])
    direction = turns + np.unwrap(wrapped(direction - turns))
    if not full:
        ends = np.interp([lower[2], upper[2]], turns, direction)
        middle = 0.5 * float(ends.sum())
        half = 0.5 * float(np.diff(ends)[0])
    angle = np.arange(POINTS) * (TURN / POINTS)
    place = (angle - direction[0]) % TURN
    width = float(direction[-1] - direction[0])
    # Beyond what its law knows a fin is taken to be as at the nearer end.
    place = np.where(place > 0.5 * (width + TURN), 0.0, np.minimum(place, width))
    turn = np.interp(place, direction - direction[0], turns)
    across = box.strongest(turn)
    reference = float(np.linalg.norm(box.strongest(np.array([box.turn]))))
    gauge = np.hypot(across[:, 0], across[:, 1]) / reference
    return middle, half, gauge, wrapped(np.arctan2(across[:, 1], across[:, 0]) - turn)
