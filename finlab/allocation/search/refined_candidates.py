"""From candidates to refined answers, and what else is tried where those miss the target."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.levenberg_marquardt import refine
from finlab.allocation.search.prepared import Prepared
from finlab.arrays import Array
from finlab.forces.fin_sets import planar_sets
from finlab.forces.force_space import PlanarProblem, polar, realize
from finlab.forces.out_of_reach import nearest, wrench_of


@dataclass(frozen=True)
class RankingSettings:
    """When an answer counts as exact, and which of two answers comes first."""

    exact_error: float = 1e-5
    """Normalized error up to which an answer is exact and cost decides: a thousandth of what counts as
    delivered."""
    error_resolution: float = 5e-5
    """Normalized error by which one inexact answer may be worse than another that is cheaper."""
    inexact_rank: float = 1e9
    """Rank of inexact answers, behind every exact one. Efforts reach thousands where an arc of zero
    directions ends near zero, since the effort divides by that end."""
    switch_gain: float = 0.01
    """Share of its cost that a robot in motion must save before it changes the way it moves."""


RANKING = RankingSettings()
"""How answers are compared everywhere."""


class RefinedCandidates(NamedTuple):
    """P refined answers to each of N targets, best first."""

    command: Array
    """(N, P, n, 3)."""
    wrench: Array
    """Normalized wrench (N, P, 6)."""
    error: Array
    """Normalized error (N, P)."""
    cost: Array
    """(N, P)."""
    origin: NDArray[np.intp]
    """Number of the seed that each came from (N, P); -1 for starts of other kinds."""

    def with_first(self, other: RefinedCandidates) -> RefinedCandidates:
        """These answers behind those of another search."""
        return RefinedCandidates._make(np.concatenate(both, axis=1) for both in zip(other, self, strict=True))


def refine_candidates(
    prepared: Prepared,
    target: Array,
    command: Array,
    origin: NDArray[np.intp],
    steps: int,
    warm_start: bool = False,
) -> RefinedCandidates:
    """Refined commands (N, P, n, 3), best first: the cheapest exact one, or the most exact one.

    With `warm_start`, the first command is how the robot moves now; another must save the share
    `switch_gain` of its cost to take its place.
    """
    rows, p, n, _ = command.shape
    repeated = target if rows == 1 else np.repeat(target, p, axis=0)
    refined = refine(prepared.commands, repeated, command.reshape(-1, n, 3), steps)
    cost = prepared.cost(refined.command)
    if p == 1:
        command, wrench, error = (values[:, None] for values in refined)
        return RefinedCandidates(command, wrench, error, cost[:, None], origin)
    score = cost.reshape(rows, p)
    if warm_start:
        score = score.copy()
        score[:, 0] *= 1.0 - RANKING.switch_gain
    error = refined.error.reshape(rows, p)
    resolution = RANKING.error_resolution * prepared.exactness
    order = rank(score, error, exact_error(prepared), resolution).argsort(axis=1)
    order += np.arange(0, rows * p, p)[:, None]
    flat = (*refined, cost, origin.reshape(-1))
    return RefinedCandidates._make(values.take(order, axis=0) for values in flat)


def exact_error(prepared: Prepared) -> float:
    """The normalized error up to which answers for a robot are exact."""
    return RANKING.exact_error * prepared.exactness


def improve(
    prepared: Prepared,
    target: Array,
    candidates: RefinedCandidates,
    rows: NDArray[np.bool_],
    starts: Array | None,
    steps: int,
) -> None:
    """Refine some rows of the candidates further, in place, together with new starts (rows, S, n, 3)."""
    command, origin = candidates.command[rows], candidates.origin[rows]
    if starts is not None:
        command = np.concatenate([command, prepared.commands.feasible(starts)], axis=1)
        origin = np.concatenate([origin, np.full(starts.shape[:2], -1)], axis=1)
    longer = refine_candidates(prepared, target[rows], command, origin, steps)
    for kept, new in zip(candidates, longer, strict=True):
        kept[rows] = new[:, : kept.shape[1]]


def rank(cost: Array, error: Array, exact_error: float, error_resolution: float = 0.0) -> Array:
    """What to sort answers by: the cost of exact ones, and behind them the error of the others.

    Errors that differ by less than the resolution count as one, and the cost decides.
    """
    missed = error > exact_error
    if not missed.any():
        return cost
    behind = RANKING.inexact_rank
    coarse = error_resolution * np.floor(error / error_resolution) if error_resolution else error
    return np.where(missed, behind * (1.0 + coarse) + np.minimum(cost, error_resolution * behind), cost)


@dataclass(frozen=True)
class MissedSettings:
    """How long targets are refined that the first search did not reach."""

    first_lm_steps: int = 5
    """Levenberg-Marquardt steps on the answers that are there, since most need only a few more."""
    turned: int = 6
    """Starts in which fins at rest point elsewhere: what little they give may be what is missing."""
    nearest_lm_steps: int = 8
    """Steps from the nearest wrench that the fins can deliver."""
    last_lm_steps: int = 25
    """Steps from fresh starts, which begin anywhere."""
    restarts: int = 32
    """Fresh starts for the very few that even so stay further away than they need to."""
    needless_error: float = 5e-4
    """Normalized error beyond what is known to be needed that is not worth further starts."""
    needless_share: float = 2e-3
    """The same as a share of what is needed."""
    cost_lm_steps: int = 3
    """Steps after an inexact answer was made cheaper, which changes its error a little."""


MISSED = MissedSettings()
"""How long missed targets are refined."""

WEAK = 1e-2
"""Share of its largest force up to which a fin counts as being at rest."""
SPARING = 1e-6
"""What squared forces count where the nearest wrench is sought, see `nearest`."""

FallbackForces = Callable[[PlanarProblem, Array], Array | None]
"""From targets (R, 6) that were missed to planar forces (R, n, 2) [N] that come near them, or None."""


def nearest_forces(problem: PlanarProblem, target: Array) -> Array:
    """The forces (R, n, 2) whose wrench is nearest, small ones where many are."""
    return nearest(planar_sets(problem), target, hessian=SPARING).force


def refine_missed(
    prepared: Prepared,
    target: Array,
    candidates: RefinedCandidates,
    missed: NDArray[np.bool_],
    fallback: FallbackForces,
    settings: MissedSettings = MISSED,
) -> None:
    """Improve, in place, the answers to targets that were missed.

    Args:
        prepared: the layout.
        target: normalized wrenches (N, 6).
        candidates: the answers so far.
        missed: which targets (N,) were missed.
        fallback: where to start from when more steps do not help; None from it ends the search.
        settings: how long to go on.
    """
    exact = exact_error(prepared)
    turned = _turned_at_rest(prepared, candidates.command[missed, 0], settings.turned)
    improve(prepared, target, candidates, missed, turned, settings.first_lm_steps)
    missed = candidates.error[:, 0] > exact
    if not missed.any():
        return
    force = fallback(prepared.planar, target[missed])
    if force is None:
        return
    needed = np.zeros(len(target))
    left = target[missed] - wrench_of(prepared.planar.effectiveness, force)
    needed[missed] = np.linalg.norm(left, axis=-1)
    start, _ = realize(prepared.planar, polar(prepared.planar, force))
    improve(prepared, target, candidates, missed, start[:, None], settings.nearest_lm_steps)
    acceptable = settings.needless_error * prepared.exactness + (1.0 + settings.needless_share) * needed
    missed &= candidates.error[:, 0] > np.maximum(exact, acceptable)
    if missed.any():
        fresh = _fresh_starts(prepared, int(missed.sum()), settings.restarts)
        improve(prepared, target, candidates, missed, fresh, settings.last_lm_steps)
    reduce_cost(prepared, target, candidates, settings.cost_lm_steps)


def reduce_cost(prepared: Prepared, target: Array, candidates: RefinedCandidates, lm_steps: int) -> None:
    """Give inexact answers, in place, the amplitudes and frequencies by which their forces cost least."""
    missed = candidates.error[:, 0] > exact_error(prepared)
    if missed.any():
        force = prepared.plant.force(candidates.command[missed, 0])[..., 1:]
        cheap, _ = realize(prepared.planar, polar(prepared.planar, force))
        improve(prepared, target, candidates, missed, cheap[:, None], lm_steps)


def _turned_at_rest(prepared: Prepared, command: Array, count: int) -> Array:
    """Commands (R, count, n, 3): those given (R, n, 3), but with fins at rest at random directions."""
    force = prepared.plant.force(command)[..., 1:]
    rests = np.sqrt((force * force).sum(-1)) <= WEAK * prepared.planar.fins.maximum
    starts = np.repeat(command[:, None], count, axis=1)
    drawn = _fresh_starts(prepared, len(command), count)[..., 2]
    starts[..., 2] = np.where(rests[:, None], drawn, starts[..., 2])
    return starts


def _fresh_starts(prepared: Prepared, rows: int, count: int) -> Array:
    """Random commands (rows, count, n, 3), the same for each row."""
    drawn = prepared.plant.sample(np.random.default_rng(0), (count,))
    return np.broadcast_to(drawn, (rows, *drawn.shape))
