"""Sets with gaps: wide arcs, fins that cannot rest, dead bands. The dual is that of their convex hulls.

Where its answer puts an actuator into a gap, the gap is cut: an arc into two halves, a dead band into rest
and the force beyond it. First every gap is left on its nearer side, which mostly gives a good answer. Then
both sides are solved, all open parts of all targets at once, and what its dual value proves to be no cheaper
than the best answer so far is left out (branch and bound).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.newton import Deadline, Prices, dual_value, solve
from finlab.allocation.dual.robot import DualRobot
from finlab.allocation.dual.sets import Sets
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.precision import CLOSE, NEARLY, NOTHING, ROUNDS

MOST_PARTS = 48
"""Open parts of one target that are followed, the cheapest first."""
STEPS_AT_KINK = 5 * ROUNDS
"""Steps of Newton's method after which a target at a gap is left to its parts."""
HOLLOW = 1e-3
"""Share of a robot's largest force from which on a least force leaves a gap around rest."""
NARROW = 0.2
"""Half of an arc [rad] up to which the chord stands for the arc of the least forces."""


class Branched(NamedTuple):
    """Least power within sets that have gaps, for N targets."""

    force: Array
    """Forces (k, N) [N]."""
    met: NDArray[np.bool_]
    """Which targets are met by forces in the sets (N,)."""
    value: Array
    """Power (N,) [W] that no forces in the sets undercut, by the tables."""


@dataclass(frozen=True, eq=False)
class _Parts:
    """Open parts: whose they are, their sets, and prices to begin with."""

    row: NDArray[np.intp]
    sets: Sets
    prices: Array


def gaps(robot: DualRobot, force: Array, sets: Sets, prices: Array | None = None) -> Array:
    """How far (n, N) forces (k, N) are in a gap of their sets, as a share; 0 where they are not. Those of
    prices (r, N) are in one where they are between what an actuator gives forward and in reverse, but not
    where they drag more than lift does: that is left to the commands."""
    lines, planes = robot.answers.lines, robot.answers.planes
    x, y = robot.answers.pair(force)
    size = np.concatenate([np.abs(force[:lines]), np.hypot(x, y)])
    result = np.zeros(size.shape)
    if lines:
        band = robot.band[:lines]
        inside = (size[:lines] < band * (1.0 - NOTHING)) & (size[:lines] > NOTHING * robot.most[:lines])
        result[:lines] = np.where(inside & (sets.low[:lines] < sets.high[:lines]), 1.0, 0.0)
    if prices is None and len(dragging := robot.answers.dragging):
        over = (force[lines + 2 * planes :] - robot.answers.drag(force[:lines])) / robot.most_drag
        result[dragging] = np.where(over > HOLLOW, over, 0.0)
    if planes:
        low, radial = sets.low[lines:], size[lines:]
        off = np.abs(wrapped(np.arctan2(y, x) - sets.middle)) - sets.half
        aside = (off > CLOSE) & (radial > NEARLY * robot.most[lines:])
        hole = (low > HOLLOW * size.max(axis=0)) & (radial < 0.98 * low)
        wide = sets.half > NARROW
        result[lines:] = np.where(aside & wide, off, 0.0)
        result[lines:] += np.where(hole & wide, 1.0 - radial / np.maximum(low, 1e-300), 0.0)
    if len(places := sets.reversing):
        result[lines + places] = _between_ways(robot, force, sets, prices, result[lines + places])
    return result


def _between_ways(robot: DualRobot, force: Array, sets: Sets, prices: Array | None, amount: Array) -> Array:
    """`gaps` (q, N) of the planes that push either way, from those of their forces forward alone."""
    lines, places = robot.answers.lines, sets.reversing
    most, both = robot.most[lines + places], sets.reverse[places] > 0.0
    x, y = (values[places] for values in robot.answers.pair(force))
    if prices is not None:
        off, ahead = robot.answers.undecided(robot.matrix @ prices, sets)
        return np.asarray(np.where(both, np.where(off > CLOSE * most, np.pi, amount * ahead), amount))
    angle, size = np.arctan2(y, x) - sets.middle[places], np.hypot(x, y)
    outside = np.full(size.shape, True)
    for turn, largest in ((0.0, sets.high[lines + places]), (np.pi, sets.reverse[places])):
        aside = np.abs(wrapped(angle + turn)) - sets.half[places] > CLOSE
        outside &= aside | (size > largest + NEARLY * most)
    return np.asarray(np.where(both, np.where(outside & (size > NEARLY * most), np.pi, 0.0), amount))


def may_have_gaps(robot: DualRobot, sets: Sets, force: Array) -> bool:
    """Whether forces (k, N) may lie in gaps: a quick look."""
    if robot.band.any() or len(sets.forked) or len(sets.reversing):
        return True
    if sets.rests:
        return False
    return bool((robot.answers.sizes(force) < 0.98 * sets.low[robot.answers.lines :]).any())


def least_power(robot: DualRobot, target: Array, sets: Sets, root: Prices, deadline: Deadline) -> Branched:
    """Forces in the sets for targets (r, N) some of whose answers `root` are in gaps."""
    count = target.shape[1]
    start = _Parts(np.arange(count), _columns(sets, count), root.prices)
    root = root._replace(value=dual_value(robot, target, sets, root.prices))
    best = _Best(robot, root)
    parts, answer = start, root
    for _ in range(ROUNDS):
        amount = gaps(robot, answer.force, parts.sets, answer.prices)
        nearer = np.flatnonzero(best.keep(parts, answer, amount))
        if not len(nearer):
            break
        parts = _dive(robot, parts, nearer, amount[:, nearer], answer)
        answer = _solved(robot, target, parts, deadline)
    parts, answer, value = start, root, np.full(count, np.inf)
    for round_ in range(ROUNDS + 1):
        amount = gaps(robot, answer.force, parts.sets, answer.prices)
        open_ = best.keep(parts, answer, amount)
        goes_on = round_ < ROUNDS and not (open_.any() and deadline.passed())
        kept = _cheapest(np.flatnonzero(open_ & goes_on), parts.row, answer.value)
        left = np.ones(len(parts.row), bool)
        left[kept] = False
        np.minimum.at(value, parts.row[left], answer.value[left])
        if not len(kept):
            break
        parts = _cut(robot, parts, kept, amount[:, kept], answer)
        answer = _solved(robot, target, parts, deadline)
    return Branched(best.force, best.met, value)


def _solved(robot: DualRobot, target: Array, parts: _Parts, deadline: Deadline) -> Prices:
    """The prices of parts; what is unsolved and has a gap is cut on."""
    own = target[:, parts.row]
    return solve(robot, own, parts.sets, parts.prices, STEPS_AT_KINK, deadline)


class _Best:
    """The cheapest answers without a gap so far, of N targets."""

    def __init__(self, robot: DualRobot, root: Prices) -> None:
        self._robot, self._value = robot, np.full(len(root.value), np.inf)
        self.force = root.force.copy()
        """Forces (k, N) [N]; those of the hulls where there is no answer yet."""
        self.met = np.zeros(len(root.value), bool)
        """Where there is one (N,)."""

    def keep(self, parts: _Parts, answer: Prices, amount: Array) -> NDArray[np.bool_]:
        """Remember answers without a gap; which of those that have one (N,) could still be cheaper."""
        sets, answers = parts.sets, self._robot.answers
        # The smoothed dual of a narrow arc may have a force that is smaller than any in it.
        hollow = (answers.sizes(answer.force) < 0.9 * sets.low[answers.lines :]) & (sets.half <= NARROW)
        full = answer.solved & ~(amount > 0.0).any(axis=0) & ~hollow.any(axis=0)
        for i in np.flatnonzero(full):
            row = parts.row[i]
            if answer.value[i] < self._value[row]:
                self._value[row], self.met[row] = answer.value[i], True
                self.force[:, row] = answer.force[:, i]
        open_ = answer.solved | (~answer.beyond & (amount > 0.0).any(axis=0))
        return open_ & ~full & (answer.value < self._value[parts.row] * (1.0 - CLOSE))


def halves(robot: DualRobot, sets: Sets, force: Array) -> list[Sets] | None:
    """Both parts of the sets of one target whose forces (k,) lie in a gap; None where they do not."""
    amount = gaps(robot, force[:, None], sets)
    if not amount.any():
        return None
    one, chosen = _columns(sets, 1), np.zeros(amount.shape, bool)
    chosen[amount[:, 0].argmax(), 0] = True
    sides = (np.full(amount.shape, side) for side in (-1.0, 1.0))
    return [narrowed(robot, one, force[:, None], chosen, side) for side in sides]


def _columns(sets: Sets, count: int) -> Sets:
    return Sets(*(np.broadcast_to(values, (len(values), count)) for values in sets.parts))


def _cheapest(places: NDArray[np.intp], row: NDArray[np.intp], value: Array) -> NDArray[np.intp]:
    """Of parts at some places, the cheapest of each target."""
    if not len(places):
        return places
    places = places[np.lexsort((value[places], row[places]))]
    rows = row[places]
    first = np.concatenate([[0], np.flatnonzero(np.diff(rows)) + 1])
    rank = np.arange(len(rows)) - np.repeat(first, np.diff(np.append(first, len(rows))))
    return np.asarray(places[rank < MOST_PARTS])


def _cut(robot: DualRobot, parts: _Parts, kept: NDArray[np.intp], amount: Array, answer: Prices) -> _Parts:
    """Both parts of each open part, whose worst gap is cut."""
    twice, side = np.tile(kept, 2), np.repeat([-1.0, 1.0], len(kept))
    chosen = np.arange(len(amount))[:, None] == np.tile(amount.argmax(axis=0), 2)
    doubled = Sets(*(values[:, twice] for values in parts.sets.parts))
    sets = narrowed(robot, doubled, answer.force[:, twice], chosen, side + np.zeros(chosen.shape))
    return _Parts(parts.row[twice], sets, answer.prices[:, twice])


def _dive(robot: DualRobot, parts: _Parts, kept: NDArray[np.intp], amount: Array, answer: Prices) -> _Parts:
    """Each open part with all its gaps left on their nearer sides; fins that cannot rest keep that force."""
    lines, planes = robot.answers.lines, robot.answers.planes
    force, sets, chosen = answer.force[:, kept], parts.sets.take(kept), amount > 0.0
    x, y = robot.answers.pair(force)
    angle, size = np.arctan2(y, x), np.hypot(x, y)
    hole = chosen[lines:] & (size < 0.98 * sets.low[lines:])
    side = np.where(np.abs(force[:lines]) > 0.5 * robot.band[:lines], 1.0, -1.0)
    dragging = robot.answers.dragging
    side[dragging] = np.where(force[dragging] < 0.5 * (sets.low + sets.high)[dragging], -1.0, 1.0)
    off = wrapped(angle - sets.middle)
    turned = np.where(sets.reverse > 0.0, np.cos(off), off)
    side = np.concatenate([side, np.where(turned < 0.0, -1.0, 1.0)])
    cut = chosen.copy()
    cut[lines:] &= ~hole
    sets = narrowed(robot, sets, force, cut, side)
    inside = sets.middle + np.clip(wrapped(angle - sets.middle), -sets.half, sets.half)
    ring = force.copy()
    ring[lines : lines + planes] = np.where(hole, sets.low[lines:] * np.cos(inside), x)
    ring[lines + planes : lines + 2 * planes] = np.where(hole, sets.low[lines:] * np.sin(inside), y)
    fixed = np.zeros(chosen.shape, bool)
    fixed[lines:] = hole
    return _Parts(parts.row[kept], robot.frozen(sets, ring, fixed), answer.prices[:, kept])


def narrowed(robot: DualRobot, sets: Sets, force: Array, chosen: NDArray[np.bool_], side: Array) -> Sets:
    """Sets (n, N) of which chosen ones (n, N) are cut by forces (k, N), and one side is kept: of an arc the
    half towards smaller (-1) or larger angles (1), of a full circle that away from or around the force, of
    either way reverse or the rest, of a dead band rest or what is beyond, of drag less or more."""
    lines, planes = robot.answers.lines, robot.answers.planes
    low, high, low_cost, high_cost, middle, half, reverse, reverse_cost, flipped = map(np.array, sets.parts)
    if planes:
        either = chosen[lines:] & (reverse > 0.0)
        plane, turn, back = chosen[lines:] & ~either, side[lines:], either & (side[lines:] < 0.0)
        high[lines:] = np.where(back, reverse, high[lines:])
        high_cost[lines:] = np.where(back, reverse_cost, high_cost[lines:])
        middle, flipped = np.where(back, middle + np.pi, middle), np.where(back, 1.0, flipped)
        reverse = np.where(either, 0.0, reverse)
        angle = np.arctan2(*robot.answers.pair(force)[::-1])
        full = half >= np.pi
        moved = np.where(full, angle + np.where(turn > 0.0, 0.0, np.pi), middle + 0.5 * turn * half)
        middle, half = np.where(plane, wrapped(moved), middle), np.where(plane, 0.5 * half, half)
    if lines:
        cut, beyond, positive = chosen[:lines], side[:lines] > 0.0, force[:lines] > 0.0
        edge = np.where(beyond, np.where(positive, 1.0, -1.0) * robot.band[:lines], 0.0)
        row, dragging = np.arange(lines)[:, None], robot.answers.dragging
        cost = robot.band_cost[row, np.where(beyond, np.where(positive, 2, 0), 1)]
        above = cut & (beyond == positive)  # the part lies above the edge
        if len(dragging):
            own = np.pad(force[:lines], ((0, planes), (0, 0)))
            edge[dragging], cost[dragging] = own[dragging], robot.answers.marginal(own)[1][dragging]
            above[dragging] = (cut & beyond)[dragging]
        low[:lines] = np.where(above, edge, low[:lines])
        low_cost[:lines] = np.where(above, cost, low_cost[:lines])
        below = cut & ~above
        high[:lines] = np.where(below, edge, high[:lines])
        high_cost[:lines] = np.where(below, cost, high_cost[:lines])
    return Sets(low, high, low_cost, high_cost, middle, half, reverse, reverse_cost, flipped)
