"""From a target to the cheapest exact commands, by the fins' own laws.

Search in force space, from all fins and where it may pay from sub-layouts -> Levenberg-Marquardt on the
commands -> the cheapest exact answer. No network takes part, nor any random number where the target is within
reach.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.models import file_stamps
from finlab.allocation.search.cheaper_commands import cheaper_commands
from finlab.allocation.search.prepared import (
    SEEDS,
    Prepared,
    neighbour_seeds,
    prepare,
    resting_fins,
    resting_seeds,
)
from finlab.allocation.search.rate_limits import is_within_rates, planar_force, within_rates
from finlab.allocation.search.refined_candidates import (
    MISSED,
    FallbackForces,
    RefinedCandidates,
    exact_error,
    improve,
    nearest_forces,
    rank,
    refine_candidates,
    refine_missed,
)
from finlab.allocation.search.settings import SearchSettings
from finlab.arrays import Array
from finlab.forces import force_space
from finlab.layout import Layout


@dataclass(frozen=True)
class SearchNumbers:
    """What the search does that users need not set."""

    promising_error: float = 0.02
    """Normalized error below which a search in force space counts as successful: refinement removes the
    rest."""
    convex_steps: int = 10
    """Most quadratic problems for a cost that grows faster than force; by Newton's method, most forces settle
    after five."""
    few_fins_steps: int = 8
    """The same for other costs with up to five fins."""
    many_fins_steps: int = 12
    """The same from `SEEDS.many` fins on."""
    near_best: int = 3
    """Allocations of so many fins near which more seeds are tried."""
    same_cost: float = 2e-4
    """Share by which costs differ at least of forces that are refined as two."""
    dear: float = 0.01
    """Share of its cost by which refinement may make an answer dearer: where a fin is near the peak of its
    thrust, commands that differ much hardly differ in force."""
    bound_steps: int = 30
    """The same where a lower bound is asked for."""
    wide_seeds: int = 64
    """Random seeds of the wide search for alternatives."""
    wide_steps: int = 40
    """Steps of that search, enough to converge: alternatives are counted by their local minima."""
    alternative_error: float = 1e-3
    """Normalized error up to which another answer is an alternative."""
    tick_lm_steps: int = 5
    """Levenberg-Marquardt steps on a target that is out of reach within a tick: the next tick goes on."""
    leaving_lm_steps: int = 10
    """The same on the way to another allocation, from commands that are at the ends of their rates."""
    worth_leaving: float = 0.03
    """Share of its cost that a robot in motion must save in the end before its fins go towards another way,
    which takes several ticks."""


SEARCH = SearchNumbers()
"""What every pipeline uses."""


class Pipeline:
    """Answers targets on layouts without failures; every array is numpy's."""

    def __init__(self, std: Array, settings: SearchSettings) -> None:
        """Make it for wrenches normalized by `std` (6,)."""
        self.std, self.settings = std, settings
        self.objective = objective = settings.aim
        self._prepared = lru_cache(maxsize=128)(lambda layout, _: prepare(layout, std, objective))

    def prepare(self, layout: Layout) -> Prepared:
        """The layout, kept from the last time; force tables whose files have changed are read again."""
        return self._prepared(layout, file_stamps(layout))

    def with_settings(self, settings: SearchSettings) -> Pipeline:
        """The same layouts prepared, with other settings."""
        other = copy(self)
        other.settings = settings
        return other

    def solve(
        self,
        prepared: Prepared,
        targets: Array,
        previous: Array | None = None,
        *,
        seeds: Array | None = None,
        fallback: FallbackForces = nearest_forces,
    ) -> RefinedCandidates:
        """Refined answers, best first, to a few targets (N, 6).

        Args:
            prepared: the layout.
            targets: desired wrenches (N, 6).
            previous: command (n, 3) of the previous tick, for a single target; its forces are then the first
                seed, before all others.
            seeds: sizes of forces (N, S, n) or planar forces (N, S, 2, n) [N] to start from, by default those
                of the layout.
            fallback: where to start from when targets were missed; None from it ends their search.
        """
        target = targets / self.std
        if seeds is None:
            seeds = self.own_seeds(prepared)[None].repeat(len(target), axis=0)
        many = prepared.plant.n_fins >= SEEDS.many
        start = _Start(seeds, many and self.settings.subsets and not self.objective.convex, fallback)
        if previous is None:
            return self._descend(prepared, target, start)
        candidates = self._descend_from_previous(prepared, target, start, previous)
        # Arcs that pass the seam are brought back inside the fin's own limits.
        return candidates._replace(command=prepared.commands.feasible(candidates.command))

    def explore(self, prepared: Prepared, targets: Array) -> RefinedCandidates:
        """Many refined answers to one target (1, 6): all that many seeds lead to.

        Fins rest alone and in pairs, for good where the objective would have them all work.
        """
        target = targets / self.std
        seeds, works = self.wide_seeds(prepared)
        command, origin, _ = self._search(
            prepared, target, seeds[None], False, keep=len(seeds), steps=SEARCH.wide_steps, works=works
        )
        return refine_candidates(prepared, target, command, origin, MISSED.first_lm_steps)

    def own_seeds(self, prepared: Prepared) -> Array:
        """Sizes of forces (S, n) [N] from which every search begins, unless others are given."""
        return prepared.seeds if self.settings.subsets else prepared.seeds[:1]

    def wide_seeds(self, prepared: Prepared) -> tuple[Array, Array | None]:
        """The same (S, n) for the wide search, and which fins may work (S, n), where not all may."""
        n, maximum = prepared.plant.n_fins, prepared.planar.fins.maximum
        if self.objective.convex:
            works = resting_seeds(np.ones(n), resting_fins(n), 0.0)
            return works * maximum, works
        drawn = np.random.default_rng(0).random((SEARCH.wide_seeds, n)) ** 2 * maximum
        return np.concatenate([prepared.seeds, drawn]), None

    def steps(self, n: int) -> int:
        """Most quadratic problems of a search with n fins."""
        usual = SEARCH.few_fins_steps if n < SEEDS.many else SEARCH.many_fins_steps
        return self.settings.search_steps or (SEARCH.convex_steps if self.objective.convex else usual)

    def _descend_from_previous(
        self, prepared: Prepared, target: Array, start: _Start, previous: Array
    ) -> RefinedCandidates:
        """Answers within what the servos allow after a previous command (n, 3): mostly the cheapest one of
        all is among them.

        Where cost grows faster than force there is but one minimum, and the search goes on from where the
        robot is. Otherwise the way that it moves now is kept, fins at rest turn to where they would be
        cheapest, and where another way is worth it, all fins go towards that, dear as the steps may be.
        """
        force, period = planar_force(prepared, previous)[None, None], self.settings.period_s
        if self.objective.convex:
            start = start._replace(seeds=force)
            free = self._descend(prepared, target, start)
            if is_within_rates(prepared, previous, free.command[0, 0], period):
                return free
            near = within_rates(prepared, previous, period)
            return self._descend(near, target, start, warm_start=True)
        free = self._descend(prepared, target, start)
        if is_within_rates(prepared, previous, free.command[0, 0], period):
            # The first seed is how the robot moves now, which was not tried.
            return free._replace(origin=np.where(free.origin < 0, -1, free.origin + 1))
        near = within_rates(prepared, previous, period, free.command[0, 0, :, 2])
        kept = force if start.seeds.ndim == 4 else np.hypot(force[:, :, 0], force[:, :, 1])
        start = start._replace(seeds=np.concatenate([kept, start.seeds], axis=1))
        found = self._descend(near, target, start, warm_start=True)
        if free.cost[0, 0] < (1.0 - SEARCH.worth_leaving) * found.cost[0, 0]:
            towards, fresh = near.commands.feasible(free.command[:, :1]), np.full((1, 1), -1)
            other = refine_candidates(near, target, towards, fresh, SEARCH.leaving_lm_steps)
            if other.error[0, 0] <= max(exact_error(prepared), found.error[0, 0]):
                return found.with_first(other)
        return found

    def _descend(
        self, prepared: Prepared, target: Array, start: _Start, warm_start: bool = False
    ) -> RefinedCandidates:
        """Search from seeds, refine, and go on where that did not reach the target."""
        # Fins that rest have hardly any slope: two steps where there are such.
        steps = self.settings.refine_steps + (not self.objective.convex)
        steps += prepared.arcs is not None or warm_start  # fins at stops take more steps
        command, origin, expected = self._search(
            prepared, target, start.seeds, warm_start, near_best=start.near_best
        )
        searched = command[:, 0]
        exact = exact_error(prepared)
        if prepared.unsettled:
            command = _cheaper(prepared, target, command)
        candidates = refine_candidates(prepared, target, command, origin, steps, warm_start)
        candidates = RefinedCandidates._make(values[:, : self.settings.n_refined] for values in candidates)
        missed = candidates.error[:, 0] > exact
        if missed.any() and warm_start:
            improve(prepared, target, candidates, missed, None, SEARCH.tick_lm_steps)
        elif missed.any():
            refine_missed(prepared, target, candidates, missed, start.fallback)
            searched = np.where(missed[:, None, None], candidates.command[:, 0], searched)
        if self.objective.convex:  # what was reached late, or became dear on the way, is made cheaper
            dear = missed | (candidates.cost[:, 0] > (1.0 + SEARCH.dear) * expected)
            dear &= candidates.error[:, 0] <= exact
            if dear.any():
                found = _cheaper(prepared, target[dear], searched[dear, None])
                improve(prepared, target, candidates, dear, found, 1)
        return candidates

    def _search(
        self,
        prepared: Prepared,
        target: Array,
        seeds: Array,
        warm_start: bool,
        *,
        near_best: bool = False,
        keep: int | None = None,
        steps: int | None = None,
        works: Array | None = None,
    ) -> tuple[Array, NDArray[np.intp], Array]:
        """Cheapest commands (N, P, n, 3) reached from seeds, whose seeds they are (N, P), and what the first
        should cost (N,).

        With `warm_start`, the first seed is how the robot moves now; what it leads to stays first.
        """
        (rows, n_seeds), n, problem = seeds.shape[:2], seeds.shape[-1], prepared.planar
        if prepared.arcs is not None:
            n_arcs = len(prepared.arcs[0])
            arcs = (np.tile(values, (rows * n_seeds, 1)) for values in prepared.arcs)
            problem = problem._replace(fins=problem.fins.within(*arcs))
            seeds = np.repeat(seeds, n_arcs, axis=1)
            works = None if works is None else np.repeat(works, n_arcs, axis=0)
        n_starts = seeds.shape[1]
        flat = target if rows == 1 else np.repeat(target, n_starts, axis=0)
        steps = steps or self.steps(n)
        planar = force_space.descend(problem, flat, seeds.reshape(-1, *seeds.shape[2:]), steps, works)
        if n_starts == 1 and self.objective.convex:
            command, cost = force_space.realize(problem, planar)
            return command[:, None], np.zeros((rows, 1), np.intp), cost
        ends = self._ends(prepared, problem, planar, rows)
        origin = np.repeat(np.arange(n_seeds), n_starts // n_seeds)
        if near_best:
            best = (
                _distinct(ends.score)[:, : SEARCH.near_best]
                + np.arange(0, rows * n_starts, n_starts)[:, None]
            )
            size, fins = planar.size[best.ravel()], prepared.planar.fins
            near = neighbour_seeds(size, size > force_space.IDLE * fins.maximum, fins.maximum).reshape(-1, n)
            flat = target if rows == 1 else np.repeat(target, len(near) // rows, axis=0)
            planar = force_space.descend(prepared.planar, flat, near, steps)
            ends = ends.beside(self._ends(prepared, prepared.planar, planar, rows))
            origin = np.concatenate([origin, np.full(len(near) // rows, -1)])
        score = ends.score
        if warm_start:
            score = score.copy()  # it may be the cost itself
            score[:, 0] = -1.0
        # With fins at rest, what refinement corrects changes the order of the costs: twice as many are tried.
        ways = ends.command.shape[2]
        chosen = _distinct(score)[:, : keep or self.settings.n_refined * min(ways, 2)]
        row = np.arange(rows)[:, None]
        # What resting fins leave undone cannot always be corrected: all ways are refined.
        kept = ends.command[row, chosen].swapaxes(1, 2).reshape(rows, -1, n, 3)
        return kept, np.tile(origin[chosen], (1, ways)), ends.cost[row[:, 0], chosen[:, 0]]

    def _ends(
        self, prepared: Prepared, problem: force_space.PlanarProblem, planar: force_space.Planar, rows: int
    ) -> _Ends:
        """Where S descents for each of N targets (rows) have ended."""
        shares = (None,) if self.objective.convex else (force_space.IDLE, 0.0, None)
        found = [force_space.realize(problem, planar, share) for share in shares]
        command, cost = np.stack([each for each, _ in found], axis=1), found[0][1]
        error = np.einsum("ri,ri->r", planar.residual, planar.residual)
        score = rank(cost, error, (SEARCH.promising_error * prepared.exactness) ** 2)
        return _Ends(*(values.reshape(rows, -1, *values.shape[1:]) for values in (command, cost, score)))


class _Start(NamedTuple):
    """Where the search for N targets begins."""

    seeds: Array
    """Sizes of forces (N, S, n) or planar forces (N, S, 2, n) [N]."""
    near_best: bool
    """Whether the seeds near the best allocation are tried as well."""
    fallback: FallbackForces
    """Where to start from when targets were missed."""


class _Ends(NamedTuple):
    """Where S descents for each of N targets have ended."""

    command: Array
    """(N, S, W, n, 3), in W ways to let fins rest."""
    cost: Array
    """In the first way (N, S)."""
    score: Array
    """What they are sorted by (N, S)."""

    def beside(self, other: _Ends) -> _Ends:
        """These and others."""
        return _Ends(*(np.concatenate(both, axis=1) for both in zip(self, other, strict=True)))


def _cheaper(prepared: Prepared, target: Array, command: Array) -> Array:
    """`cheaper_commands` near P commands (N, P, n, 3) for each of N targets."""
    flat = command.reshape(-1, *command.shape[2:])
    each = target.repeat(command.shape[1], axis=0)
    found = cheaper_commands(prepared.commands, prepared.cost, each, flat, exact_error(prepared))
    return found.reshape(command.shape)


def _distinct(score: Array) -> NDArray[np.intp]:
    """Places (N, S) of scores, the least first, those that hardly differ from one before them last: several
    starts mostly lead to the same forces."""
    order = score.argsort(axis=1)
    ranked = np.take_along_axis(score, order, axis=1)
    again = np.zeros(order.shape, bool)
    again[:, 1:] = np.diff(ranked) <= SEARCH.same_cost * ranked[:, :-1]
    found: NDArray[np.intp] = np.take_along_axis(order, again.argsort(axis=1, kind="stable"), axis=1)
    return found
