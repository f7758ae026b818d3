"""The response of a fin to a price (Eq. 5): for each price the command with the largest profit, by
the fin's own law.

Amplitude A and frequency f maximize the profit `v T(A, f) - P(A, f)` within the limits. That is
searched on a grid of commands, and from its best point on by Newton's method on differences of the
law's gradients; it holds for any law, convex or not. A fin whose force depends on its direction has
a gauge: the share of the force that the same cost gives in each direction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from threading import Lock
from typing import Any, NamedTuple

import numpy as np

from finlab.actuators.fin.fin_laws import make_law
from finlab.actuators.fin.fin_model import FinModelSpec, Limits
from finlab.actuators.law import FinLaw, PlanarLaw
from finlab.actuators.response import POINTS, Form, Group, Plane, RadialTable, price_grid
from finlab.arrays import NEARLY, NOTHING, ROUNDING, ROUNDS, Array
from finlab.axes import TURN, is_full_turn, wrapped
from finlab.errors import DataError

GRID = (17, 33)
"""Amplitudes and frequencies of the first grid; half as many where directions are compared."""
PEAK = 5e-4
"""Share of the largest force that is given up where the price of the last newton has no bound."""
ANY_PRICE = 1e12
"""A price at which power does not count [W/N]."""
SHORTER_STEP = 0.2
"""Part of each step that is tried beside the whole of it."""
LEAST_PROBE = 1e-15
"""Least distance of the points of a difference, where a limit has no width [rad, Hz]."""
STEEP = 1e-3
"""Derivative of the force at the corner, over the largest force, above which it does not fall off
there [1/rad, 1/Hz]."""
PRICES_TRIED = 33
"""Prices in each search for the least one at which the force is the largest."""
SEARCHES = 5
"""Searches for that price, each between two neighbours of the last."""
NO_SIZE = 1e-300
"""Least size by which is divided."""


class Directions(NamedTuple):
    """The directions in which a fin can push."""

    sector_center: float
    """Centre of the arc of force directions [rad]."""
    sector_half_angle: float
    """Half angle of that arc; pi for a full circle [rad]."""
    gauge: Array | None
    """Share (POINTS,) of the table's force in each direction around the circle, from 0 on [1]; None
    where they are the same."""
    deflection: Array
    """Direction of the force minus the zero direction (POINTS,) around the circle [rad]; (1,) where
    it is the same."""


@dataclass(frozen=True, eq=False)
class FinTable:
    """The response of a fin to a price, and the commands that give it.

    Args:
        table: force over price in its strongest direction.
        directions: arc, gauge and deflection of its force.
        beat: amplitudes [rad] and frequencies [Hz] (POINTS + 1, 2) that give the forces `largest (j
            / POINTS)^2`.
        best: commands (CELLS + 1, 3) with the largest profit at the prices of the table [rad, Hz,
            rad].
        box: the law within the limits.
        form: how a force becomes a command.
    """

    table: RadialTable
    directions: Directions
    beat: Array
    best: Array
    box: LawBox
    form: Form

    @cached_property
    def conjugate_margin(self) -> Array | None:
        """By how much the conjugate of the law may be above that of the table, as the core takes
        it; None of a fin that was measured, whose forces have other directions too."""
        if self.box.law.measured:
            return None
        from finlab.actuators.fin.conjugate_margin import conjugate_margin

        return conjugate_margin(self.box, self.table, self.best)

    @property
    def largest(self) -> float:
        """The largest force in any direction [N]."""
        gauge = self.directions.gauge
        return self.table.largest * (1.0 if gauge is None else float(gauge.max()))


class FinGroup(Group):
    """Responses to prices of m fins (Eq. 5): planes of forces, each tabulated from its law."""

    def __init__(self, fins: Sequence[Any], effectiveness: Array) -> None:
        """Tabulates the responses, each model once in a process.

        Args:
            fins: m fins.
            effectiveness: wrench (m, 3, 6) of 1 N along each own axis [1, m], body frame.

        Raises:
            DataError: a table cannot be read, or a fin gives no thrust.
        """
        tables = [fin_table(fin) for fin in fins]
        self._tables = tables
        self._effectiveness = effectiveness
        self.responses = []
        for table, matrix in zip(tables, effectiveness, strict=True):
            arc = table.directions
            self.responses.append(
                Plane(matrix[1:], table.table, arc.sector_center, arc.sector_half_angle, arc.gauge)
            )

    @property
    def forms(self) -> list[Form]:
        return [table.form for table in self._tables]

    @property
    def conjugate_margins(self) -> list[Array | None]:
        """See `Group`: of fins by a formula; made once for a model and limits, at the first
        question."""
        return [table.conjugate_margin for table in self._tables]

    def conjugate_bound(self, price: Array) -> Array:
        """See `Group`: an upper bound, of fins that were measured alone."""
        result = np.full((len(price), len(self._tables)), np.nan)
        for table in {id(table): table for table in self._tables}.values():
            if not table.box.law.measured:
                continue
            indices = [i for i, other in enumerate(self._tables) if other is table]
            own_price = np.einsum("maw,nw->nma", self._effectiveness[indices], price)
            bound = _table_bound(table.box)(own_price.reshape(-1, 3))
            result[:, indices] = bound.reshape(len(price), -1)
        return result


_LOCK = Lock()


def fin_table(fin: Any) -> FinTable:
    """Returns one fin, tabulated, from a cache where its model and limits were met before. Raises
    DataError: its table cannot be read, or it gives no thrust."""
    with _LOCK:  # two threads would each make one, and equal fins would not share their table
        result = _tabulated(fin.model, fin.limits, fin.stamp)
    if result is None:
        low_a, high_a = fin.limits.amplitude
        low_f, high_f = fin.limits.frequency
        raise DataError(
            f"{fin.name}: gives no thrust within its limits, amplitudes {low_a:.4g} to "
            f"{high_a:.4g} rad and frequencies {low_f:.4g} to {high_f:.4g} Hz; widen the limits or "
            "leave the fin out"
        )
    return result


@lru_cache(maxsize=512)
def _tabulated(
    model: FinModelSpec, limits: Limits, stamp: tuple[int, int] | None
) -> FinTable | None:
    """The table of a fin, None where it gives no thrust; `stamp` is that of its file, so that one
    that has changed is read again."""
    law = make_law(model)
    box = LawBox(law, np.array(limits.lower), np.array(limits.upper))
    largest = box.largest()
    if largest <= 0.0:
        return None
    top = box.top_price(largest)
    command = box.best(price_grid(top))
    force = np.maximum.accumulate(box.force(command))
    table = RadialTable.of_forces(top, force, float(box.power(command[:1])[0]))
    size = force[-1] * np.linspace(0.0, 1.0, POINTS + 1) ** 2
    amplitude = np.interp(size, force, command[:, 0])
    frequency = np.interp(size, force, command[:, 1])
    beat = np.stack([amplitude, frequency], axis=-1)
    directions = _directions(law, box)
    return FinTable(table, directions, beat, command, box, _form(law, box, beat, directions))


def _form(law: FinLaw, box: LawBox, beat: Array, directions: Directions) -> Form:
    """How forces of a fin become commands; `beat` (POINTS + 1, 2) as in `FinTable`."""
    e, phi_e = law.unevenness
    is_even = directions.gauge is None
    return Form(
        "fin",
        law=law.grid_numbers(box.lower, box.upper),
        command_table=beat,
        command_table_count=len(beat) - 1,
        deflection=None if is_even else directions.deflection,
        lean_angle=float(directions.deflection[0]) if is_even else float(law.offset),
        unevenness=e,
        unevenness_angle=phi_e,
    )


class Optimum(NamedTuple):
    """The commands with the largest profit at K prices."""

    command: Array
    """(K, 3) [rad, Hz, rad]."""
    profit: Array
    """Price times force, less the power (K,) [W]."""


class LawBox:
    """One fin's law within the limits of amplitude and frequency, in its strongest direction."""

    def __init__(self, law: FinLaw, lower: Array, upper: Array) -> None:
        """Takes the law and limits of the command (3,) [rad, Hz, rad]."""
        self.law = law
        self.lower = lower
        self.upper = upper
        self.zero_direction = float(np.clip(0.0, lower[2], upper[2]))
        """Zero direction at which its force is largest [rad]."""
        if not law.uniform:
            directions, force = self.all_round
            is_within = (directions >= lower[2] - NOTHING) & (directions <= upper[2] + NOTHING)
            if is_within.any():
                size = np.where(is_within, np.hypot(*force.T), -1.0)
                self.zero_direction = float(directions[size.argmax()])

    @cached_property
    def all_round(self) -> tuple[Array, Array]:
        """Zero directions (POINTS + 1,) [rad] and the largest forces across the shaft there
        (POINTS + 1, 2) [N], by a coarse grid."""
        low = self.lower[2]
        high = self.upper[2]
        if isinstance(self.law, PlanarLaw):  # a formula holds beyond the limits, too
            center = 0.5 * (low + high)
            low = center - np.pi
            high = center + np.pi
        directions = np.linspace(low, high, POINTS + 1)
        return directions, self.strongest(directions)

    def strongest(self, zero_direction: Array) -> Array:
        """Returns the largest forces across the shaft (K, 2) [N] at zero directions (K,) [rad], by
        a coarse grid."""
        grid = self.grid((GRID[0] // 2 + 1, GRID[1] // 2 + 1))
        command = np.tile(grid, (len(zero_direction), 1, 1))
        command[..., 2] = zero_direction[:, None]
        force = self.law.force(command.reshape(-1, 3)).reshape(command.shape)[..., 1:]
        best = np.hypot(force[..., 0], force[..., 1]).argmax(axis=1)
        return np.asarray(force[np.arange(len(zero_direction)), best])

    def command(self, beat: Array) -> Array:
        """Returns commands (..., 3) of amplitude and frequency (..., 2)."""
        direction = np.full((*beat.shape[:-1], 1), self.zero_direction)
        return np.concatenate([beat, direction], axis=-1)

    def force(self, command: Array) -> Array:
        """Returns the size of the force across the shaft (...) [N] of commands (..., 3)."""
        return np.asarray(np.linalg.norm(self.law.force(command)[..., 1:], axis=-1))

    def power(self, command: Array) -> Array:
        """Returns the power (...) [W] of commands (..., 3)."""
        return np.asarray(self.law.power(command))

    def profit(self, price: Array, command: Array) -> Array:
        """Returns price times force less power (...) [W], at prices (...) [W/N] of commands (...,
        3)."""
        return price * self.force(command) - self.power(command)

    def largest(self) -> float:
        """Returns the largest force within the limits [N]."""
        return float(self.force(self.best(np.array([ANY_PRICE])))[0])

    def grid(self, shape: tuple[int, int] = GRID) -> Array:
        """Returns commands (G, 3) on a grid of `shape` amplitudes and frequencies."""
        amplitude = np.linspace(self.lower[0], self.upper[0], shape[0])
        frequency = np.linspace(self.lower[1], self.upper[1], shape[1])
        beat = np.stack(np.meshgrid(amplitude, frequency, indexing="ij"), axis=-1)
        return self.command(beat.reshape(-1, 2))

    def best(self, price: Array) -> Array:
        """Returns the commands (K, 3) with the largest profit at prices (K,) [W/N]; see
        `optimum`."""
        return self.optimum(price).command

    def optimum(self, price: Array, starts: Array | None = None) -> Optimum:
        """Returns the commands with the largest profit, by Newton's method within the limits.

        Args:
            price: prices (K,) [W/N].
            starts: amplitudes and frequencies (S, K, 2) near the optimum, from the best of which
                each begins, and which end with a step that gains no more than rounding; a grid for
                all when None.
        """
        row = np.arange(len(price))
        least_gain = 0.0 if starts is None else ROUNDING
        if starts is None:
            grid = self.grid()
            profit = self.profit(price[:, None], grid)
            beat = grid[profit.argmax(axis=1), :2]
        else:
            profit = self.profit(price, self.command(starts)).T
            beat = starts[profit.argmax(axis=1), row]
        low = self.lower[:2]
        high = self.upper[:2]
        span = high - low
        longest = 2.0 * span / (np.array(GRID) - 1.0)
        best_profit = profit.max(axis=1)
        for _ in range(ROUNDS):
            gradient, hessian = self._profit_derivatives(price, beat, NEARLY * span + LEAST_PROBE)
            step = np.clip(_uphill_steps(beat, gradient, hessian), -longest, longest)
            trial = np.clip(np.concatenate([step, SHORTER_STEP * step]) + beat, low, high)
            trial_profit = self.profit(price, self.command(trial))
            best_trial = trial_profit.argmax(axis=0)
            gain = trial_profit[best_trial, row] - best_profit
            is_better = gain > 0.0
            beat = np.where(is_better[:, None], trial[best_trial, row], beat)
            best_profit = np.where(is_better, trial_profit[best_trial, row], best_profit)
            if not (gain > least_gain * np.abs(best_profit)).any():
                break
        return Optimum(self.command(beat), best_profit)

    def _profit_derivatives(self, price: Array, beat: Array, probe: Array) -> tuple[Array, Array]:
        """Gradient (K, 2) and Hessian (K, 2, 2) of the profit at prices (K,), by amplitude and
        frequency (K, 2); the Hessian by differences over steps `probe` (2,)."""
        base = np.where(beat + probe > self.upper[:2], beat - probe, beat)
        points = np.stack([beat, base, base + probe * [1, 0], base + probe * [0, 1]])
        gradient, at_base, by_amplitude, by_frequency = self._profit_gradient(price, points)
        with np.errstate(invalid="ignore", divide="ignore"):
            differences = np.stack([by_amplitude - at_base, by_frequency - at_base], axis=-1)
            hessian = differences / probe
        return gradient, 0.5 * (hessian + hessian.swapaxes(-1, -2))

    def _profit_gradient(self, price: Array, beat: Array) -> Array:
        """Gradient (..., K, 2) of the profit at prices (K,), by amplitude and frequency (..., K,
        2)."""
        command = self.command(beat)
        force, jacobian = self.law.force_and_jacobian(command)
        planar = force[..., 1:]
        size = np.maximum(np.linalg.norm(planar, axis=-1), NO_SIZE)
        # d|F| = F . dF / |F|
        by_beat = np.einsum("...ci,...i->...c", jacobian[..., :2, 1:], planar) / size[..., None]
        return np.asarray(price[:, None] * by_beat - self.law.power_gradient(command)[..., :2])

    def top_price(self, largest: float) -> float:
        """Returns the price [W/N] at which the fin gives its largest force [N], or all but `PEAK`
        of it where that price has no bound."""
        at_corner = self._top_price_at_corner(largest)
        if at_corner is not None:
            return at_corner
        low = NOTHING
        high = 1.0 / NOTHING
        for _ in range(SEARCHES):
            prices = np.geomspace(low, high, PRICES_TRIED)
            is_enough = self.force(self.best(prices)) >= (1.0 - PEAK) * largest
            first = int(is_enough.argmax()) if is_enough.any() else len(prices) - 1
            low = float(prices[max(first - 1, 0)])
            high = float(prices[first])
        return high

    def _top_price_at_corner(self, largest: float) -> float | None:
        """The marginal cost [W/N] at the largest amplitude and frequency, where the force is
        largest and still rises; None elsewhere."""
        corner = self.upper[None, :2]
        if float(self.force(self.command(corner))[0]) < largest * (1.0 - ROUNDING):
            return None
        moves = self.upper[:2] > self.lower[:2]
        price = np.zeros(1)
        at_no_price = self._profit_gradient(price, corner)
        marginal_force = (self._profit_gradient(price + 1.0, corner) - at_no_price)[0][moves]
        if not (marginal_force > STEEP * largest).all():
            return None
        marginal_costs = -at_no_price[0][moves] / marginal_force
        top = float(marginal_costs.max()) if len(marginal_costs) else NOTHING
        is_enough = float(self.force(self.best(np.array([top])))[0]) >= (1.0 - PEAK) * largest
        return top if is_enough else None


@lru_cache(maxsize=32)
def _table_bound(box: LawBox) -> Callable[[Array], Array]:
    """Upper bound of the profit of a fin that was measured; see `TableBound`."""
    from finlab.actuators.fin.bernstein_bound import TableBound
    from finlab.actuators.fin.table_law import TableLaw

    assert isinstance(box.law, TableLaw)
    return TableBound(box.law, box.lower, box.upper)


def _uphill_steps(beat: Array, gradient: Array, hessian: Array) -> Array:
    """Steps (4, K, 2) uphill from amplitudes and frequencies (K, 2): Newton's, and those along the
    amplitude, the frequency, and both with a constant product. A step is 0 where the profit is not
    concave."""
    a = hessian[:, 0, 0]
    b = hessian[:, 0, 1]
    c = hessian[:, 1, 1]
    determinant = a * c - b * b
    along_amplitude = np.broadcast_to([1.0, 0.0], beat.shape)
    along_frequency = np.broadcast_to([0.0, 1.0], beat.shape)
    along_product = beat * [1.0, -1.0]
    steps = []
    with np.errstate(all="ignore"):
        # -H^-1 g, with the inverse of a 2 x 2 matrix
        newton = np.stack(
            [b * gradient[:, 1] - c * gradient[:, 0], b * gradient[:, 0] - a * gradient[:, 1]],
            axis=-1,
        )
        is_concave = (a < 0.0) & (determinant > 0.0)
        steps.append(np.where(is_concave[:, None], newton / determinant[:, None], 0.0))
        for direction in (along_amplitude, along_frequency, along_product):
            slope = np.einsum("ki,ki->k", direction, gradient)
            curvature = np.einsum("ki,kij,kj->k", direction, hessian, direction)
            # Where the profit is not concave along it, by 1: the step is clipped.
            length = slope / np.where(curvature < 0.0, -curvature, np.abs(slope) + NO_SIZE)
            steps.append(direction * length[:, None])
    return np.asarray(np.nan_to_num(np.stack(steps), posinf=0.0, neginf=0.0))


def _directions(law: FinLaw, box: LawBox) -> Directions:
    """The directions in which a fin can push, within its limits."""
    low = float(box.lower[2])
    high = float(box.upper[2])
    is_full = bool(is_full_turn(high - low))
    center = 0.5 * (low + high)
    half_angle = np.pi if is_full else 0.5 * (high - low)
    if law.uniform:
        force = law.force(np.append(box.upper[:2], box.zero_direction))
        lean = float(wrapped(np.arctan2(force[2], force[1]) - box.zero_direction))
        return Directions(center + lean, half_angle, None, np.array([lean]))

    zero_direction, force = box.all_round
    force_direction = np.arctan2(force[:, 1], force[:, 0])
    force_direction = zero_direction + np.unwrap(wrapped(force_direction - zero_direction))
    if not is_full:
        ends = np.interp([low, high], zero_direction, force_direction)
        center = 0.5 * float(ends.sum())
        half_angle = 0.5 * float(np.diff(ends)[0])

    # The zero direction for a force in each of POINTS directions around the circle. Beyond what its
    # law knows a fin is taken to be as at the nearer end.
    angle = np.arange(POINTS) * (TURN / POINTS)
    from_first = (angle - force_direction[0]) % TURN
    width = float(force_direction[-1] - force_direction[0])
    is_nearer_to_first = from_first > 0.5 * (width + TURN)
    from_first = np.where(is_nearer_to_first, 0.0, np.minimum(from_first, width))
    command_direction = np.interp(from_first, force_direction - force_direction[0], zero_direction)

    strongest = box.strongest(command_direction)
    reference = float(np.linalg.norm(box.strongest(np.array([box.zero_direction]))))
    gauge = np.hypot(strongest[:, 0], strongest[:, 1]) / reference
    deflection = wrapped(np.arctan2(strongest[:, 1], strongest[:, 0]) - command_direction)
    return Directions(center, half_angle, gauge, deflection)
