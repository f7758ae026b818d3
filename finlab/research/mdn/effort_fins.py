"""The fins of one robot, side by side: the forces that they can give, and the least effort of each.

For sizes of force between the smallest and the largest one, the pair of amplitude and frequency
with the least effort is found on a grid of commands, in the fin's strongest direction. The arc of
directions, and by how much a fin is weaker in the others, are those of the compiled fins of the
default method. What the zero direction adds to the effort is left out here: it does not depend on
the size.

A planar force is a complex number: its horizontal part, and 1j times its vertical part, in newton.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.fin_response import fin_table
from finlab.actuators.response import POINTS
from finlab.arrays import AnyArray, Array
from finlab.axes import TURN
from finlab.layout import Fin, Layout
from finlab.physics.objective import effort_of_shares, effort_scale

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

LEVELS = 49
"""Sizes of force in a table."""
AMPLITUDES = 193
"""Amplitudes at which a law is evaluated."""
FREQUENCIES = 49
"""Frequencies at which it is."""
FORCE_TOLERANCE = 1e-5
"""By how much, as a share, a force may fall short of a size and still count as giving it."""
STIFFNESS_MIN = 0.3
"""Least elasticity of the marginal effort that is followed; below it, and where effort is concave,
a steeper quadratic is touched, which never overshoots."""
STIFFNESS_MAX = 10.0
"""Elasticities above this one count as this one."""
MARGINAL_EFFORT_MIN = 1e-3
"""Least marginal effort, as a share of the mean one."""
LEAST = 1e-12
"""What sizes are kept above before something is divided by them."""
LEVELS_PER_ANGLE = 2.0 / np.pi * (LEVELS - 1) * (1.0 - 1e-12)
"""From the angle of a force in a table to its level, of which none is past the last."""

AMPLITUDE, FREQUENCY, EFFORT, MOBILITY, STIFFNESS = range(5)
"""Columns of a table: amplitude [rad], frequency [Hz], effort, logarithm of the mobility T /
(dc/dT), elasticity of dc/dT."""


class Projected(NamedTuple):
    """What R rows of n fins can do nearest to given forces."""

    unit: AnyArray
    """Unit vector along the force (R, n), complex."""
    size: Array
    """Size of the force (R, n) [N]."""
    wanted: Array
    """The size (R, n) [N] that is given in that direction where limits of size do not hold."""
    gauge: Array
    """Share of the table's force in that direction (R, n), or (n,) ones where all fins are even."""

    @property
    def force(self) -> AnyArray:
        """The forces (R, n) [N], complex."""
        return np.asarray(self.unit * self.size)

    @property
    def direction(self) -> Array:
        """Their directions (R, n) [rad]."""
        return np.asarray(np.arctan2(self.unit.imag, self.unit.real))


@dataclass(frozen=True, eq=False)
class EffortFins:
    """n fins; each may be kept within a part of its arc."""

    smallest: Array
    """Force at rest (n,) [N], in the strongest direction."""
    largest: Array
    """Largest force (n,) [N] there."""
    table: Array
    """What sizes between them cost (n, LEVELS, 5), see the columns above."""
    gauge: Array | None
    """Share (n, POINTS) of the same command's force in each direction; None where all fins are
    even."""
    lean: Array
    """Direction of the force minus zero direction (n, POINTS) [rad], by the first."""
    middle: Array
    """Middle of the arc (n,) of force directions that are allowed [rad]."""
    half: Array
    """Half of that arc (n,) [rad]; pi for a full circle."""

    @classmethod
    def of(cls, layout: Layout) -> "Self":
        """The fins of a layout. Raises DataError: a fin's force table cannot be read, or gives no
        thrust within the limits."""
        compiled = [fin_table(fin).directions for fin in layout.fins]
        costs = [_costs(fin, fin.stamp) for fin in layout.fins]
        even = all(each.gauge is None for each in compiled)
        gauges = [np.ones(POINTS) if each.gauge is None else each.gauge for each in compiled]
        return cls(
            smallest=np.array([size[0] for size, _ in costs]),
            largest=np.array([size[-1] for size, _ in costs]),
            table=np.stack([table for _, table in costs]),
            gauge=None if even else np.array(gauges),
            lean=np.array([np.broadcast_to(each.deflection, POINTS) for each in compiled]),
            middle=np.array([each.sector_center for each in compiled]),
            half=np.array([each.sector_half_angle for each in compiled]),
        )

    @cached_property
    def maximum(self) -> Array:
        """Largest force of each fin in any direction (n,) [N]."""
        return self.largest if self.gauge is None else self.largest * self.gauge.max(axis=1)

    @cached_property
    def turns_fully(self) -> bool:
        """Whether every fin may point anywhere."""
        return bool((self.half >= np.pi).all())

    @cached_property
    def _steps(self) -> Array:
        """Rows of all tables, and how much is added to them up to the next ones (n * LEVELS, 2,
        5)."""
        rows = self.table.reshape(-1, self.table.shape[-1])
        return np.stack([rows, np.diff(rows, axis=0, append=rows[-1:])], axis=1)

    @cached_property
    def _response_steps(self) -> Array:
        """The same of mobility and stiffness alone, (n * LEVELS, 4): both, then their steps."""
        columns = self._steps[:, :, [MOBILITY, STIFFNESS]]
        return np.ascontiguousarray(columns.reshape(len(columns), -1))

    @cached_property
    def _ones(self) -> Array:
        """The gauge of even fins (n,)."""
        return np.ones(len(self.half))

    @cached_property
    def _span(self) -> Array:
        """From the smallest to the largest force (n,) [N], never quite zero."""
        return np.asarray(self.largest - self.smallest + LEAST)

    @cached_property
    def is_straight(self) -> bool:
        """Whether no fin's force leans off its zero direction."""
        return not self.lean.any()

    @cached_property
    def _first_rows(self) -> NDArray[np.intp]:
        """Where each fin's rows begin (n,)."""
        return np.arange(len(self.largest)) * LEVELS

    @cached_property
    def _circles(self) -> NDArray[np.intp]:
        """Where the values around each fin's circle begin (n,) in an array (n, POINTS)."""
        return np.arange(len(self.lean)) * POINTS

    def deflection(self, direction: Array) -> Array:
        """By how much (..., n) [rad] forces in directions (..., n) [rad] lean off the zero
        directions."""
        if self.is_straight:
            return np.zeros(direction.shape)
        cell = np.rint(direction * (POINTS / TURN)).astype(np.intp) % POINTS
        return np.asarray(self.lean.ravel().take(cell + self._circles))

    def gauges(self, direction: Array) -> Array:
        """Shares (..., n) of the table's force in directions (..., n) [rad]."""
        if self.gauge is None:
            return np.ones(len(self.half))
        cell = np.rint(direction * (POINTS / TURN)).astype(np.intp) % POINTS
        return np.asarray(self.gauge.ravel().take(cell + self._circles))

    def lookup(self, size: Array) -> Array:
        """Rows (R, n, 5) of the tables for forces of sizes (R, n) [N] in the strongest
        directions."""
        level, position = self._levels(size)
        steps = self._steps.take(level, axis=0)
        rows: Array = steps[..., 1, :] * position[..., None]
        rows += steps[..., 0, :]
        return rows

    def response(self, size: Array) -> tuple[Array, Array]:
        """Logarithms of the mobility, and stiffnesses, each (R, n), for forces of sizes (R, n) [N]
        in the strongest directions: two columns of `lookup`."""
        level, position = self._levels(size)
        steps = self._response_steps.take(level, axis=0)
        log_mobility = steps[..., 2] * position
        log_mobility += steps[..., 0]
        stiffness = steps[..., 3] * position
        stiffness += steps[..., 1]
        return log_mobility, stiffness

    def _levels(self, size: Array) -> tuple[NDArray[np.intp], Array]:
        """Rows of all tables (R, n) at or below sizes (R, n) [N], and how far towards the next."""
        # Levels are even in the angle psi with share = sin^4 psi; in place, since it is a hot loop.
        position = size - self.smallest
        position /= self._span
        np.minimum(np.maximum(position, 0.0, out=position), 1.0, out=position)
        np.sqrt(np.sqrt(position, out=position), out=position)
        np.arcsin(position, out=position)
        position *= LEVELS_PER_ANGLE
        level = position.astype(np.intp)
        position -= level
        level += self._first_rows
        return level, position

    def project(self, force: AnyArray) -> Projected:
        """What the fins can do nearest to forces (R, n), complex."""
        wanted = np.abs(force) + LEAST
        unit = force / wanted
        if not self.turns_fully:
            offset = np.angle(unit * np.exp(-1j * self.middle))
            in_arc = np.clip(offset, -self.half, self.half)
            excess = np.abs(offset - in_arc)
            wanted = np.where(excess < 0.5 * np.pi, wanted * np.cos(excess), 0.0)
            unit = np.exp(1j * (self.middle + in_arc))
        if self.gauge is None:
            size = np.minimum(np.maximum(wanted, self.smallest), self.largest)
            return Projected(unit, size, wanted, self._ones)
        gauge = self.gauges(np.angle(unit))
        size = np.minimum(np.maximum(wanted, self.smallest * gauge), self.largest * gauge)
        return Projected(unit, size, wanted, gauge)


@lru_cache(maxsize=512)
def _costs(fin: Fin, stamp: tuple[int, int] | None) -> tuple[Array, Array]:
    """Sizes of force (LEVELS,) [N] and their table (LEVELS, 5); a force table whose file has
    changed is read again."""
    box = fin_table(fin).box
    scale = effort_scale(box.upper)
    ends = zip(box.lower, box.upper, (AMPLITUDES, FREQUENCIES), strict=False)
    amplitude, frequency = (np.linspace(low, high, count) for low, high, count in ends)
    grid = np.stack(np.meshgrid(amplitude, frequency, indexing="ij"), axis=-1)
    force = box.force(box.command(grid))
    # Dense near zero, where both commands grow like fourth roots, and near the top, which may be
    # flat.
    share = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, LEVELS)) ** 4
    size = force[0, 0] + (force.max() - force[0, 0]) * share
    # Between grid points the square root of the force is nearly a straight line.
    rising = np.sqrt(np.maximum.accumulate(force, axis=1))
    # Where it is flat, the first frequency counts.
    rising += np.arange(FREQUENCIES) * 1e-13 * np.maximum(rising[:, -1:], 1e-12)
    # Of each amplitude the frequency that gives each size (AMPLITUDES, LEVELS), and its effort.
    needed = np.array([np.interp(np.sqrt(size), row, frequency) for row in rising])
    effort = effort_of_shares(amplitude[:, None] / scale[0], needed / scale[1], 0.0)
    effort[np.sqrt(size) > rising[:, -1:] * (1.0 + FORCE_TOLERANCE) + 1e-15] = np.inf
    best = effort.argmin(axis=0)
    level = np.arange(LEVELS)
    slopes = _slopes(effort[best, level], size)
    columns = [amplitude[best], needed[best, level], effort[best, level], *slopes]
    return size, np.stack(columns, axis=-1)


def _slopes(effort: Array, size: Array) -> tuple[Array, Array]:
    """The columns that follow from the slope of the effort (LEVELS,) by size."""
    span = size[-1] - size[0]
    if span <= 1e-12:
        return np.log(np.maximum(size, 1e-300)), np.ones(LEVELS)
    level = np.arange(LEVELS)
    least = MARGINAL_EFFORT_MIN * max(float(np.ptp(effort)), 1e-12) / span
    marginal = np.maximum(np.gradient(effort, size + level * 1e-15 * size[-1]), least)
    height = np.log(np.maximum(size, 1e-9 * size[-1])) + level * 1e-9
    stiffness = np.gradient(np.log(marginal), height)
    stiffness = np.where(stiffness > STIFFNESS_MIN, np.minimum(stiffness, STIFFNESS_MAX), 1.0)
    return np.log(np.maximum(size, 1e-5 * size[-1]) / marginal), stiffness
