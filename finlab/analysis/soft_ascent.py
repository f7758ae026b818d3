"""Starts for climbs of the weakest direction: many layouts of thrusters at once, each moved to a
maximum of a smooth measure.

The weakest direction is the least distance d_k of the facets of a zonotope from the origin, which
has a kink wherever two of them are equally near: a climb is held up by few facets at many poor
layouts. The soft minimum

    s = -(1 / beta) log((1 / K) sum_k exp(-beta d_k))

is smooth, and near the mean of all distances while beta is small. A gradient ascent (Adam) whose
beta grows passes most of those layouts by. See E. L. Allgower and K. Georg, Introduction to
Numerical Continuation Methods (2003), and D. P. Kingma and J. Ba, Adam (2015), algorithm 1.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.thruster import Thruster
from finlab.analysis.climb import Rules
from finlab.analysis.slopes import NUDGE, WeakestDirection, difference
from finlab.arrays import Array
from finlab.layout import Layout

MAX_FACETS = 600
"""Most facets that are looked at, after all losses: those of eleven thrusters and six axes."""
FACING_ROUNDS = 2
"""How often the reversal of each thruster, and of each two, is tried."""
HOP_SIZE = 0.1
"""Standard deviation of a hop's change of a number, as a share of its bounds."""
HOP_PARENTS = 8
"""Best vectors from which hops begin."""
HOPS_OF_EACH = 3
"""Hops from each of them."""
FIRST_MEMORY = 0.9
"""Share of the mean slope that a step keeps (beta_1 of Adam)."""
SECOND_MEMORY = 0.99
"""Share of the mean square of the slope that a step keeps (beta_2 of Adam)."""
LEAST_SIZE = 1e-12
"""Slope that is added to the size of slopes, which may be 0 [N]."""
RULE_COST = 20.0
"""Cost of a broken rule per metre, over the mean distance [1/m]."""
REPAIRS = 20
"""Most steps back within the rules, at the end."""
REPAIR_MARGIN = 1e-7
"""How far beyond the rules such a step aims [m]."""
SPREAD = 1e-9
"""Random part of the largest column that is added to columns, so that none depend on others."""


class Schedule(NamedTuple):
    """How an ascent goes on in time."""

    steps: int
    """Its steps."""
    even_steps: int
    """How many of them have even limits, where thrusters may be reversed."""
    sharpness: tuple[float, float]
    """beta times the mean distance, at the first step and after the last."""
    step_size: tuple[float, float]
    """Change of a number by a steady slope, at the first step and after the last, as a share of its
    bounds."""


FIRST = Schedule(steps=800, even_steps=600, sharpness=(30.0, 2000.0), step_size=(0.03, 0.0002))
"""From anywhere."""
HOP = Schedule(steps=400, even_steps=0, sharpness=(60.0, 2000.0), step_size=(0.02, 0.0002))
"""From near a vector that is good already."""


class FacetTable:
    """Which columns span the facets of n thrusters in m axes, and which push at them."""

    def __init__(self, n: int, m: int, after_loss: bool) -> None:
        """Takes the numbers of thrusters and axes, and whether each facet counts after the loss of
        any one thruster that does not span it."""
        uncovered = set(combinations(range(n), m - 1))
        sets = list[tuple[int, ...]]()
        facets = list[tuple[int, int, int]]()  # set, column left out of it, lost thruster
        for chosen in combinations(range(n), m):
            for k in range(m):
                spanning = chosen[:k] + chosen[k + 1 :]
                if spanning not in uncovered:
                    continue
                uncovered.remove(spanning)
                if not sets or sets[-1] != chosen:
                    sets.append(chosen)
                others = set(range(n)) - set(spanning)
                for lost in others if after_loss else (n,):
                    facets.append((len(sets) - 1, k, lost))
        self.sets = np.array(sets)
        self.set_of, self.left_out, lost_of = np.array(facets).T
        indices = np.arange(n)
        chosen_of = self.sets[self.set_of]
        is_spanning = (chosen_of[:, :, None] == indices) & (
            np.arange(m)[:, None] != self.left_out[:, None, None]
        )
        self.pushes = ~is_spanning.any(axis=1) & (indices != lost_of[:, None])
        """Whether a thruster pushes at a facet, at one of its ends (K, n)."""


class Facets(NamedTuple):
    """K facets of each of P zonotopes sum_i [least_i, most_i] b_i."""

    distance: Array
    """From the origin (P, K) [N, scaled]."""
    normal: Array
    """Unit normals (P, K, m)."""
    force: Array
    """Forces (P, K, n) [N] that give the wrench at each facet's foot, where those of the columns
    that span it have no limits: with them the slope of a distance is as if the normal did not
    turn."""

    def slope(self, weight: Array) -> Array:
        """Returns the slope of sum_k w_k d_k by all columns (P, n, m), for weights (P, K)."""
        weighted = self.force * weight[..., None]
        return np.asarray(np.swapaxes(weighted, -1, -2) @ self.normal)


def facets_of(columns: Array, least: Array, most: Array, table: FacetTable) -> Facets:
    """Returns all facets of P robots.

    The normal of a facet is orthogonal to m - 1 columns: a row of the inverse of m columns that
    contain those.

    Args:
        columns: b (P, n, m).
        least: (n,) [N].
        most: (n,) [N].
        table: which columns span which facet.
    """
    random = np.random.default_rng(0)
    spread = SPREAD * np.abs(columns).max() * random.standard_normal(columns.shape[1:])
    inverse = np.linalg.inv((columns + spread)[:, table.sets])
    dual = np.swapaxes(inverse, -1, -2)  # c_i in rows: c_i b_j is 1 for i = j, else 0
    dual = dual[:, table.set_of]  # (P, K, m, m)
    row = dual[:, np.arange(len(table.set_of)), table.left_out]
    normal = row / np.linalg.norm(row, axis=-1, keepdims=True)
    pull = normal @ np.swapaxes(columns, -1, -2) * table.pushes
    # On whichever side of the zonotope the facet is nearer, the normal points outwards.
    ahead = np.maximum(pull * most, pull * least).sum(axis=-1)
    astern = np.maximum(-pull * most, -pull * least).sum(axis=-1)
    sign = np.where(astern < ahead, -1.0, 1.0)[..., None]
    normal = sign * normal
    force = np.where(sign * pull > 0.0, most, least) * table.pushes
    # The columns that span it bring the wrench W to the foot: y_j = -c_j (W - (W n) n).
    wrench = force @ columns
    off_foot = wrench - (wrench * normal).sum(axis=-1, keepdims=True) * normal
    spanning_force = np.zeros_like(force)
    chosen = np.broadcast_to(table.sets[table.set_of], dual.shape[:-1])
    np.put_along_axis(spanning_force, chosen, -(dual @ off_foot[..., None])[..., 0], axis=-1)
    return Facets(np.minimum(ahead, astern), normal, force + spanning_force)


def has_few_facets(goal: WeakestDirection, layout: Layout) -> bool:
    """Whether all facets can be looked at: of thrusters alone, as many as axes or a few more."""
    if not all(isinstance(actuator, Thruster) for actuator in layout.actuators):
        return False
    n_losses = layout.n - goal.n_axes + 1 if goal.after_loss else 1
    spans_axes = layout.n - goal.after_loss >= goal.n_axes
    return spans_axes and comb(layout.n, goal.n_axes - 1) * n_losses <= MAX_FACETS


class SoftAscent:
    """Raises the soft minimum over all facets, for many vectors of `Moves` at once."""

    def __init__(self, goal: WeakestDirection, rules: Rules) -> None:
        """Takes a goal to which `has_few_facets` applies, and the rules of the search."""
        self._goal = goal
        self._rules = rules
        moves = rules.moves
        self._width = moves.upper - moves.lower
        self._least = moves.layout.lower[:, 0]
        self._most = moves.layout.upper[:, 0]
        self._table = FacetTable(moves.layout.n, goal.n_axes, goal.after_loss)

    def least_distances(self, vectors: Array) -> Array:
        """Returns the exact goals (P,) [N, scaled] of vectors (P, D)."""
        return np.asarray(self._facets(vectors, self._least, self._most).distance.min(axis=-1))

    def raised(self, vectors: Array, cancelled: Callable[[], bool] = lambda: False) -> Array:
        """Returns vectors at which the soft minimum is large; nearly all keep the rules.

        Where thrusters may be reversed, the ascent begins with even limits, halves of their ranges,
        which do not tell a thruster from a reversed one. Then all are turned as their own limits
        want it: unlike places, which way they face is no matter of small steps.

        Args:
            vectors: where to begin (P, D).
            cancelled: called after each step; the ascent ends when it returns True.
        """
        return self._ascended(vectors, FIRST, cancelled)

    def hopped(
        self,
        vectors: Array,
        random: np.random.Generator,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> Array:
        """Returns vectors (24 or fewer, D) after hops from the best of some: each number changes at
        random, and an ascent follows (basin hopping, after Wales and Doye, 1997).

        Args:
            vectors: vectors (P, D) that were raised before.
            random: draws the changes.
            cancelled: called after each step; the ascent ends when it returns True.
        """
        moves = self._rules.moves
        best = np.argsort(-self.least_distances(vectors), kind="stable")[:HOP_PARENTS]
        parents = np.repeat(vectors[best], HOPS_OF_EACH, axis=0)
        change = HOP_SIZE * random.standard_normal(parents.shape)
        share = self._within_bounds((parents - moves.lower) / self._width + change)
        return self._ascended(moves.lower + share * self._width, HOP, cancelled)

    def _ascended(self, vectors: Array, schedule: Schedule, cancelled: Callable[[], bool]) -> Array:
        """Vectors (P, D) after an ascent by Adam, brought back within the rules."""
        moves = self._rules.moves
        tilts = moves.whole_tilts
        n_even = schedule.even_steps if len(tilts) else 0
        most = 0.5 * (self._most - self._least)
        least = -most
        mean = float(self._facets(vectors, least, most).distance.mean())
        if n_even == 0:
            least = self._least
            most = self._most
        share = (vectors - moves.lower) / self._width
        first = np.zeros_like(share)
        second = np.zeros_like(share)
        for t, time in enumerate(np.linspace(0.0, 1.0, schedule.steps)):
            if 0 < t == n_even:
                share = self._faced(share, tilts)
                least = self._least
                most = self._most
            beta = np.interp(time, (0.0, 1.0), schedule.sharpness) / mean
            step_size = np.interp(time, (0.0, 1.0), schedule.step_size)
            slope = self._slope(moves.lower + share * self._width, least, most, beta, mean)
            first += (1.0 - FIRST_MEMORY) * (slope - first)
            second += (1.0 - SECOND_MEMORY) * (slope**2 - second)
            unbiased = first / (1.0 - FIRST_MEMORY ** (t + 1))
            size = np.sqrt(second / (1.0 - SECOND_MEMORY ** (t + 1)))
            share = self._within_bounds(share + step_size * unbiased / (size + LEAST_SIZE))
            if cancelled():
                break
        return self._repaired(moves.lower + share * self._width)

    def _within_bounds(self, share: Array) -> Array:
        """Shares of the bounds (P, D) brought between 0 and 1; angles of a whole turn go round."""
        is_whole_turn = self._rules.moves.is_whole_turn
        return np.asarray(np.where(is_whole_turn, share % 1.0, np.clip(share, 0.0, 1.0)))

    def _facets(self, vectors: Array, least: Array, most: Array) -> Facets:
        """The facets of the robot moved by vectors (P, D), with limits (n,) [N]."""
        return facets_of(self._goal.columns(vectors), least, most, self._table)

    def _faced(self, share: Array, tilts: NDArray[np.intp]) -> Array:
        """Shares of the bounds (P, D) with those thrusters reversed, by tilts of a whole turn, that
        raise the goal, one or two at a time."""
        moves = self._rules.moves
        value = self.least_distances(moves.lower + share * self._width)
        pairs = [list(pair) for pair in combinations(tilts, 2)]
        for reversed_tilts in FACING_ROUNDS * ([[tilt] for tilt in tilts] + pairs):
            reversed_share = share.copy()
            reversed_share[:, reversed_tilts] = (share[:, reversed_tilts] + 0.5) % 1.0
            trial = self.least_distances(moves.lower + reversed_share * self._width)
            share = np.where((trial > value)[:, None], reversed_share, share)
            value = np.maximum(value, trial)
        return share

    def _slope(self, vectors: Array, least: Array, most: Array, beta: float, mean: float) -> Array:
        """The slope (P, D) per share of the bounds of the soft minimum less the cost of broken
        rules, with limits (n,) [N] and sharpness beta; rules cost by the mean distance [N]."""
        facets = self._facets(vectors, least, most)
        excess = facets.distance - facets.distance.min(axis=-1, keepdims=True)
        weight = np.exp(-beta * excess)
        weight /= weight.sum(axis=-1, keepdims=True)  # ds / dd_k
        slope = self._slope_by_columns(vectors, facets.slope(weight))
        breaks = self._rules.violation(vectors) > 0.0
        if breaks.any():
            slope[breaks] -= RULE_COST * mean * self._rule_slope(vectors[breaks])
        return slope

    def _slope_by_columns(self, vectors: Array, column_slope: Array) -> Array:
        """The slope (P, D) per share of the bounds of what changes with columns by slopes
        (P, n, m)."""
        moves = self._rules.moves
        slope = np.zeros_like(vectors)
        for numbers in moves.numbers_by_kind:
            # A column depends on one number of each kind, so that all of a kind change at once.
            change = np.zeros_like(self._width)
            change[numbers] = NUDGE * self._width[numbers]
            columns = self._goal.columns(np.concatenate([vectors + change, vectors - change]))
            effect = (difference(columns) * column_slope).sum(axis=-1)  # (P, n)
            slope[:, numbers] = effect @ moves.moves_actuator[numbers].T
        return slope

    def _rule_slope(self, vectors: Array) -> Array:
        """The slope (P, D) per share of the bounds of how far vectors (P, D) break the rules."""
        change = NUDGE * np.diag(self._width)
        around = np.concatenate([vectors[:, None] + change, vectors[:, None] - change])
        violation = self._rules.violation(around.reshape(-1, len(change)))
        return difference(violation.reshape(-1, len(change)))

    def _repaired(self, vectors: Array) -> Array:
        """Vectors (P, D) that broke rules moved back along the slopes of these."""
        moves = self._rules.moves
        vectors = vectors.copy()
        for _ in range(REPAIRS):
            violation = self._rules.violation(vectors)
            broken = violation > 0.0
            if not broken.any():
                break
            slope = self._rule_slope(vectors[broken])
            square = (slope**2).sum(axis=-1, keepdims=True)
            # The step along the slope g after which a violation v, were it linear, would be 0.
            step = -(violation[broken, None] + REPAIR_MARGIN) * slope / (square + LEAST_SIZE)
            moved = vectors[broken] + step * self._width
            vectors[broken] = np.clip(moved, moves.lower, moves.upper)
        return vectors
