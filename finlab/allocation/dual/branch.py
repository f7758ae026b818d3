"""Sets with gaps: wide arcs, fins that cannot rest, dead bands. The dual is that of their convex hulls.

Where its answer puts an actuator into a gap, the gap is cut: an arc into two halves, a dead band into rest
and the force beyond it. Each part is solved again, all open parts of all targets at once, and what its dual
value proves to be no cheaper than the best answer so far is left out (branch and bound).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.answers import Sets
from finlab.allocation.dual.newton import Prices, solve
from finlab.allocation.dual.robot import DualRobot
from finlab.arrays import Array
from finlab.layout.angles import wrapped

ROUNDS = 9
"""Times that sets are cut: arcs are then narrow enough for what is left of their gap not to count."""
MOST_PARTS = 96
"""Open parts of one target that are followed, the cheapest first."""
SAME = 1e-4
"""Share of the power by which a part must be able to be cheaper to be followed."""
OUTSIDE = 1e-4
"""Angle [rad] by which a force may lie outside its arc."""
SMALL = 1e-3
"""Least force, as a share of the largest, up to which a fin that cannot rest counts as one that can."""
NARROW = 0.2
"""Half of an arc [rad] up to which the chord stands for the arc of the least forces."""


class Branched(NamedTuple):
    """Least power within sets that have gaps, for N targets."""

    force: Array
    """Forces (k, N) [N]."""
    found: NDArray[np.bool_]
    """Which targets are met by forces in the sets (N,)."""


@dataclass(frozen=True, eq=False)
class _Parts:
    """Open parts: whose they are, their sets, and prices to begin with."""

    row: NDArray[np.intp]
    sets: Sets
    prices: Array


def gaps(robot: DualRobot, force: Array, sets: Sets) -> Array:
    """How far (n, N) forces (k, N) are in a gap of their sets, as a share; 0 where they are not."""
    lines, planes = robot.answers.lines, robot.answers.planes
    found = np.zeros((lines + planes, force.shape[1]))
    if lines:
        size, band = np.abs(force[:lines]), robot.band[:lines]
        inside = (size < band * (1.0 - 1e-9)) & (size > 1e-9 * robot.most[:lines])
        found[:lines] = np.where(inside & (sets.low[:lines] < sets.high[:lines]), 1.0, 0.0)
    if planes:
        x, y = force[lines : lines + planes], force[lines + planes :]
        size, low = np.hypot(x, y), sets.low[lines:]
        off = np.abs(wrapped(np.arctan2(y, x) - sets.middle)) - sets.half
        aside = (off > OUTSIDE) & (size > 1e-6 * robot.most[lines:])
        hole = (low > SMALL * robot.most[lines:]) & (size < 0.98 * low)
        wide = sets.half > NARROW
        found[lines:] = np.where(aside & wide, off, 0.0) + np.where(
            hole & wide, 1.0 - size / (low + 1e-300), 0.0
        )
    return found


def has_gaps(robot: DualRobot, sets: Sets) -> bool:
    """Whether any actuator has a set with a gap that counts."""
    lines = robot.answers.lines
    wide = (sets.half > 0.5 * np.pi) & (sets.half < np.pi)
    holes = sets.low[lines:] > SMALL * robot.most[lines:]
    return bool(wide.any() or holes.any() or robot.band.any())


def least_power(robot: DualRobot, target: Array, sets: Sets, root: Prices) -> Branched:
    """Forces in the sets for targets (r, N) some of whose answers `root` are in gaps."""
    count = target.shape[1]
    best, force, found = np.full(count, np.inf), root.force.copy(), np.zeros(count, bool)
    parts = _Parts(np.arange(count), _columns(sets, count), root.prices)
    answer = root
    for round_ in range(ROUNDS):
        amount = gaps(robot, answer.force, parts.sets)
        whole = answer.solved & ~(amount > 0.0).any(axis=0)
        for i in np.flatnonzero(whole):
            if answer.value[i] < best[parts.row[i]]:
                row = parts.row[i]
                best[row], force[:, row], found[row] = answer.value[i], answer.force[:, i], True
        open_ = answer.solved & ~whole & (answer.value < best[parts.row] * (1.0 - SAME))
        if round_ == ROUNDS - 1 or not open_.any():
            break
        kept = _cheapest(np.flatnonzero(open_), parts.row, answer.value)
        parts = _cut(robot, parts, kept, amount[:, kept], answer)
        answer = solve(robot, target[:, parts.row], parts.sets, parts.prices)
    return Branched(force, found)


def _columns(sets: Sets, count: int) -> Sets:
    return Sets(*(np.broadcast_to(values, (len(values), count)) for values in sets.parts))


def _cheapest(places: NDArray[np.intp], row: NDArray[np.intp], value: Array) -> NDArray[np.intp]:
    """Of parts at some places, the cheapest of each target."""
    places = places[np.lexsort((value[places], row[places]))]
    rows = row[places]
    first = np.concatenate([[0], np.flatnonzero(np.diff(rows)) + 1])
    rank = np.arange(len(rows)) - np.repeat(first, np.diff(np.append(first, len(rows))))
    return places[rank < MOST_PARTS // 2]


def _cut(robot: DualRobot, parts: _Parts, kept: NDArray[np.intp], amount: Array, answer: Prices) -> _Parts:
    """Both parts of each open part, whose worst gap is cut."""
    lines, m = robot.answers.lines, len(kept)
    worst = amount.argmax(axis=0)
    twice = np.tile(kept, 2)
    sets = Sets(*(values[:, twice] for values in parts.sets.parts))
    side = np.repeat([-1.0, 1.0], m)
    column, worst = np.arange(2 * m), np.tile(worst, 2)
    planar = worst >= lines
    at, plane = column[planar], worst[planar] - lines
    force = answer.force[:, twice]
    angle = np.arctan2(force[worst[planar] + robot.answers.planes, at], force[worst[planar], at])
    full = sets.half[plane, at] >= np.pi
    middle = np.where(full, angle, sets.middle[plane, at])
    half = np.where(full, np.pi, sets.half[plane, at])
    sets.half[plane, at] = 0.5 * half
    # A full circle is cut so that the force lies in the middle of one half.
    turn = np.where(full, np.where(side[at] > 0.0, 0.0, np.pi), 0.5 * side[at] * half)
    sets.middle[plane, at] = wrapped(middle + turn)
    at, line = column[~planar], worst[~planar]
    beyond, positive = side[at] > 0.0, force[line, at] > 0.0
    edge = np.where(beyond, np.where(positive, 1.0, -1.0) * robot.band[line, 0], 0.0)
    cost = robot.band_cost[line, np.where(beyond, np.where(positive, 2, 0), 1)]
    from_below = beyond == positive  # the part lies above the edge
    for limit, costs, moved in (
        (sets.low, sets.low_cost, from_below),
        (sets.high, sets.high_cost, ~from_below),
    ):
        limit[line, at] = np.where(moved, edge, limit[line, at])
        costs[line, at] = np.where(moved, cost, costs[line, at])
    return _Parts(parts.row[twice], sets, answer.prices[:, twice])
