"""By how much the conjugate of a fin's law may be above that of its table (Eq. 4), so that both
together bound it from above at any price.

The table is exact at its own prices alone. Between prices at which the largest profit of the law is
known, its conjugate is below their chord, as it is convex; and that of the table is above its
tangents. At the prices in between the best command is found near the commands of the neighbours,
and that no other one takes less power for its force is asked of a grid of commands: c*(v) bounds
the profit of all commands u if and only if P(u) is nowhere below the table's power of T(u). See
"Bounds by formulas" of docs/theory/method.md.
"""

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.law_box import LawBox, Optimum
from finlab.actuators.response import CELLS, RadialTable
from finlab.arrays import NOTHING, ROUNDING, ROUNDS, Array

STEPS = 32
"""Prices in each interval of the table at which the law is asked. The chords between them are above
the conjugate by up to 1e-6 of the power, mostly by 1e-8."""
CELLS_BEYOND = 64
"""Intervals beyond the price of the table's largest force: of `price_max / v`, from 1 to 0."""
GRID_ASKED = (33, 65)
"""Amplitudes and frequencies of the grid on which no command may take less power than the table
says of its force."""
EDGE_ASKED = 513
"""Commands along each edge of the limits of which the same is asked, where forces that saturate are
mostly given best: such a force has a narrow ridge, which a grid misses."""
SMALLEST_ASKED = 1e-4
"""Smallest of these amplitudes and frequencies beside the least, over the largest."""
EVERY_ASKED = 32
"""Of how many of the table's prices one is asked of all these commands."""
LEAST_SHARE = 1e-3
"""Share of the largest conjugate whose rounding is the least that counts."""
LEAST_GAIN = 1e-11
"""Share of a power by which another command is better."""


def conjugate_margin(box: LawBox, table: RadialTable, commands: Array) -> Array:
    """Returns by how much the conjugate of a law may be above that of its table, as the core takes
    it.

    Args:
        box: the law within its limits.
        table: its table.
        commands: (CELLS + 1, 3) [rad, Hz, rad], the best ones at the prices of the table.

    Returns:
        `price_max` [W/N], N, M, by how much the law may give less than the table's least force
        [N], the largest difference at prices between `price_max (j / N)^4` and the next (N,) [W],
        and beyond them the difference over the price, at `price_max / (1 - j / M)` (M + 1,) [N].
    """
    law = _SampledLaw(box, table, commands)
    within, beyond = law.margins()
    head = [table.price_max, len(within), len(beyond) - 1, law.least_force_error]
    return np.concatenate([head, within, beyond])


class _SampledLaw:
    """A fin's law at the prices of its table, between them and beyond, beside the table."""

    def __init__(self, box: LawBox, table: RadialTable, commands: Array) -> None:
        """Takes the arguments of `conjugate_margin`."""
        self._box = box
        self._table = table
        share = np.linspace(0.0, 1.0, STEPS * CELLS + 1)
        self._price = table.price_max * share**4
        """Prices v_k (STEPS * CELLS + 1,) [W/N]."""
        self._asked = self._commands_asked()
        """Commands (G, 3) of a grid within the limits, and along each of their edges."""
        beat = self._better_beats(commands[:, :2])
        self._conjugate, self._loss = self._largest_profits(beat)
        """Conjugates c*(v_k) [W] of the law, and what they may lack in each interval [W]."""
        self._inverse_price = np.linspace(1.0, 0.0, CELLS_BEYOND + 1)
        """price_max / v (M + 1,) at prices beyond the table."""
        self._profit_over_price = self._largest_beyond()
        """c*(v) / v (M + 1,) [N] there, which is convex in 1 / v."""
        least = min(float(box.force(commands).min()) for commands in self._asked)
        self.least_force_error = max(float(table.force[0]) - least, 0.0)
        """By how much the law may give less than the table's least force [N]."""

    def margins(self) -> tuple[Array, Array]:
        """Returns the differences within the table (N,) [W], and those over the price beyond it
        (M + 1,) [N]."""
        # Between two prices the law's conjugate is below its chord, and the table's at most a
        # quarter of width times rise of the force below its own: as a convex function with such
        # slopes at both ends.
        force, conjugate = self._table.force_and_conjugate(self._price)
        difference = self._conjugate - conjugate
        sag = 0.25 * np.diff(self._price) * np.diff(force)
        size = np.abs(self._conjugate)
        rounding = ROUNDING * (size[1:] + LEAST_SHARE * size.max())
        each = np.maximum(difference[:-1], difference[1:]) + sag + rounding
        within = each.reshape(CELLS, STEPS).max(axis=1) + self._loss

        # Beyond the table c*(v) / v is convex in 1 / v, and that of the table linear.
        top = self._table.largest
        power = self._table.price_max * top - conjugate[-1]
        of_table = top - self._inverse_price * power / self._table.price_max
        beyond = self._profit_over_price - of_table + ROUNDING * top
        return within, beyond

    def _largest_profits(self, beat: Array) -> tuple[Array, Array]:
        """The largest profits at all prices.

        Args:
            beat: amplitudes and frequencies (CELLS + 1, 2), the best ones at the table's prices.

        Returns:
            Profits (STEPS * CELLS + 1,) [W], and what is lost of them at most in each interval of
            the table (CELLS,) [W].
        """
        box = self._box
        half = STEPS // 2
        middle_price = self._price[half::STEPS]
        middle_beat = 0.5 * (beat[:-1] + beat[1:])
        middle = box.optimum(middle_price, np.stack([middle_beat, beat[:-1], beat[1:]]))

        # The known commands are half an interval apart. Between them the best one lies on the
        # line between its neighbours, or beside a kink is one of them.
        known_price = self._price[::half]
        known = np.empty((2 * CELLS + 1, 2))
        known[::2] = beat
        known[1::2] = middle.command[:, :2]
        line = [np.interp(self._price, known_price, numbers) for numbers in known.T]
        profit = box.profit(self._price, box.command(np.stack(line, axis=-1)))
        force = box.force(box.command(known)).repeat(half)
        power = box.power(box.command(known)).repeat(half)
        # The command known before a price, and the one known after it.
        for first in (0, half):
            own_force = force[first : first + len(self._price)]
            own_power = power[first : first + len(self._price)]
            count = len(own_force)
            of_neighbour = self._price[:count] * own_force - own_power
            profit[:count] = np.maximum(profit[:count], of_neighbour)

        # What the line loses over a whole interval, of which it loses less over a half.
        on_line = box.profit(middle_price, box.command(middle_beat))
        loss = np.maximum(middle.profit - on_line, 0.0)
        scale = middle_price * box.force(middle.command) - middle.profit
        curved = np.flatnonzero(loss > NOTHING * scale)
        if len(curved):
            inner = (curved[:, None] * STEPS + np.arange(1, STEPS)).ravel()
            cell = curved.repeat(STEPS - 1)
            starts = np.stack([known[2 * cell + k] for k in range(3)])
            profit[inner] = np.maximum(
                profit[inner], box.optimum(self._price[inner], starts).profit
            )
            loss[curved] = 0.0
        return profit, loss

    def _commands_asked(self) -> list[Array]:
        """See `_asked`."""
        box = self._box
        low = box.lower[:2]
        high = box.upper[:2]
        amplitude, frequency = (_spread(low[k], high[k], GRID_ASKED[k]) for k in range(2))
        along_amplitude, along_frequency = (_spread(low[k], high[k], EDGE_ASKED) for k in range(2))
        grids = []
        for amplitudes, frequencies in (
            (amplitude, frequency),
            (low[:1], along_frequency),
            (high[:1], along_frequency),
            (along_amplitude, low[1:]),
            (along_amplitude, high[1:]),
        ):
            beat = np.stack(np.meshgrid(amplitudes, frequencies, indexing="ij"), axis=-1)
            grids.append(box.command(beat.reshape(-1, 2)))
        return grids

    def _best_of_asked(self, price: Array) -> Optimum:
        """The best commands at prices (K,) [W/N] that are near the grid or an edge."""
        box = self._box
        starts = []
        for commands in self._asked:
            profit = box.profit(price[:, None], commands)
            starts.append(commands[profit.argmax(axis=1), :2])
        # Each is followed uphill: on a ridge the highest one is not always where the best lies.
        count = len(starts)
        optimum = box.optimum(np.tile(price, count), np.concatenate(starts)[None])
        profit = optimum.profit.reshape(count, -1)
        best = profit.argmax(axis=0)
        row = np.arange(len(price))
        command = optimum.command.reshape(count, -1, 3)[best, row]
        return Optimum(command, profit[best, row])

    def _better_beats(self, beat: Array) -> Array:
        """The best amplitudes and frequencies (CELLS + 1, 2) at the table's prices, of which
        others may be known."""
        box = self._box
        price = self._table.price
        best = Optimum(box.command(beat), box.profit(price, box.command(beat)))
        some = np.arange(0, CELLS + 1, EVERY_ASKED)
        of_asked = self._best_of_asked(price[some])
        lacking = self._is_better(of_asked.profit, best.profit[some], of_asked.command)
        if lacking.any():
            # At all prices between the last one and the next, from the better command.
            near = np.arange(-EVERY_ASKED + 1, EVERY_ASKED)
            rows = some[lacking][:, None] + near
            starts = of_asked.command[lacking, None, :2].repeat(len(near), axis=1)
            is_within = (rows >= 0) & (rows <= CELLS)
            best = self._improved(best, rows[is_within], starts[is_within])
        for _ in range(ROUNDS):
            # A command that is best at one price may be better at others than theirs.
            force = box.force(best.command)
            power = box.power(best.command)
            profit = price[:, None] * force - power
            other = profit.argmax(axis=1)
            most = profit[np.arange(CELLS + 1), other]
            rows = np.flatnonzero(self._is_better(most, best.profit, best.command[other]))
            if not len(rows):
                break
            best = self._improved(best, rows, best.command[other[rows], :2])
        return best.command[:, :2]

    def _is_better(self, profit: Array, known: Array, command: Array) -> NDArray[np.bool_]:
        """Whether profits (K,) [W] of commands (K, 3) are larger than those that are known."""
        least_gain = LEAST_GAIN * (self._box.power(command) + np.abs(known))
        return np.asarray(profit > known + least_gain)

    def _improved(self, best: Optimum, rows: NDArray[np.intp], starts: Array) -> Optimum:
        """The best commands at the table's prices, some `rows` (R,) of which, each any number of
        times, are looked for from `starts` (R, 2)."""
        optimum = self._box.optimum(self._table.price[rows], starts[None])
        command = best.command.copy()
        profit = best.profit.copy()
        for row in np.argsort(optimum.profit):  # of each row the best one last
            if optimum.profit[row] > profit[rows[row]]:
                command[rows[row]] = optimum.command[row]
                profit[rows[row]] = optimum.profit[row]
        return Optimum(command, profit)

    def _largest_beyond(self) -> Array:
        """The largest profits over the price (M + 1,) [N] at the prices beyond the table."""
        box = self._box
        price = self._table.price_max / self._inverse_price[:-1]
        best = self._best_of_asked(price)
        force = box.force(best.command)
        power = box.power(best.command)
        # A command that is best at one of these prices may be better at others than theirs.
        of_all = force - power / price[:, None]
        start = best.command[of_all.argmax(axis=1), :2]
        profit = box.optimum(price, start[None]).profit
        largest = max(box.largest(), float(force.max()))
        return np.append(profit / price, largest)


def _spread(low: float, high: float, count: int) -> Array:
    """Numbers (up to `count`,) from `low` to `high`: half of them evenly, half dense near 0."""
    if low == high:
        return np.array([low])
    half = count // 2
    smallest = max(low, SMALLEST_ASKED * high)
    return np.unique(
        np.concatenate([np.linspace(low, high, half), np.geomspace(smallest, high, half), [low]])
    )
