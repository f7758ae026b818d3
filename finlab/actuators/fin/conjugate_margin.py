"""By how much the conjugate of a fin's law may be above that of its table (Eq. 4), so that both
together bound it from above at any price.

The table is exact at its own prices alone. Between prices at which the largest profit of the law is
known, its conjugate is below their chord, as it is convex; and that of the table is above its
tangents. At the prices in between the best command is found near the commands of the neighbours,
and that no other one takes less power for its force is asked of a grid of commands: c*(v) bounds
the profit of all commands u if and only if P(u) is nowhere below the table's power of T(u). See
"Bounds by formulas" of docs/theory/method.md.
"""

from typing import TYPE_CHECKING

import numpy as np

from finlab.actuators.response import CELLS, RadialTable
from finlab.arrays import NOTHING, ROUNDING, ROUNDS, Array

if TYPE_CHECKING:
    from finlab.actuators.fin.fin_response import LawBox

STEPS = 32
"""Prices in each interval of the table at which the law is asked. The chords between them are above
the conjugate by up to 1e-6 of the power, mostly by 1e-8."""
CELLS_BEYOND = 64
"""Intervals beyond the price of the table's largest force: of `price_max / v`, from 1 to 0."""
COMMANDS_ASKED = (129, 129)
"""Amplitudes and frequencies of the grid on which no command may take less power than the table
says of its force."""


def conjugate_margin(box: "LawBox", table: RadialTable, commands: Array) -> Array:
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

    def __init__(self, box: "LawBox", table: RadialTable, commands: Array) -> None:
        """Takes the arguments of `conjugate_margin`."""
        self._box = box
        self._table = table
        share = np.linspace(0.0, 1.0, STEPS * CELLS + 1)
        self._price = table.price_max * share**4
        """Prices v_k (STEPS * CELLS + 1,) [W/N]."""
        self._conjugate, self._loss = self._largest_profits(commands[:, :2])
        self._inverse_price = np.linspace(1.0, 0.0, CELLS_BEYOND + 1)
        """price_max / v (M + 1,) at prices beyond the table."""
        finite = table.price_max / self._inverse_price[:-1]
        self._profit_over_price = np.append(box.optimum(finite).profit / finite, box.largest())
        """c*(v) / v (M + 1,) [N] there, which is convex in 1 / v."""
        self.least_force_error = self._raise_to_grid()
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
        rounding = ROUNDING * np.abs(self._conjugate[1:])
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

    def _raise_to_grid(self) -> float:
        """Raises the largest profits to those of a grid of commands, where these are larger;
        returns by how much the least force of the grid is below that of the table [N]."""
        box = self._box
        commands = box.grid(COMMANDS_ASKED)
        force = box.force(commands)
        power = box.power(commands)
        price = np.interp(force, self._table.force, self._table.price)
        profit = price * force - power
        for _ in range(ROUNDS):
            excess = profit - np.interp(price, self._price, self._conjugate)
            worst = int(excess.argmax())
            if excess[worst] <= ROUNDING * power[worst]:
                break
            start = commands[worst, :2][None, None]
            better = box.optimum(price[worst : worst + 1], start).command
            self._raise(float(box.force(better)[0]), float(box.power(better)[0]))
        else:
            self._loss = self._loss + max(float(excess.max()), 0.0)
        return max(float(self._table.force[0] - force.min()), 0.0)

    def _raise(self, force: float, power: float) -> None:
        """Raises the largest profits to those of a command with a force [N] and a power [W]."""
        self._conjugate = np.maximum(self._conjugate, self._price * force - power)
        over_price = force - self._inverse_price * power / self._table.price_max
        self._profit_over_price = np.maximum(self._profit_over_price, over_price)
