"""The response of a fin to a price (Eq. 5): for each price the command with the largest profit, by
the fin's own law.

`LawBox` finds that command. A fin whose force depends on its direction has a gauge: the share of
the force that the same cost gives in each direction.
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
from finlab.actuators.fin.law_box import LawBox
from finlab.actuators.law import FinLaw
from finlab.actuators.response import POINTS, Form, Group, Plane, RadialTable, price_grid
from finlab.arrays import Array
from finlab.axes import TURN, is_full_turn, wrapped
from finlab.errors import DataError


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


@lru_cache(maxsize=32)
def _table_bound(box: LawBox) -> Callable[[Array], Array]:
    """Upper bound of the profit of a fin that was measured; see `TableBound`."""
    from finlab.actuators.fin.bernstein_bound import TableBound
    from finlab.actuators.fin.table_law import TableLaw

    assert isinstance(box.law, TableLaw)
    return TableBound(box.law, box.lower, box.upper)


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
