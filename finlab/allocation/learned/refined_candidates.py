"""From candidates to refined answers, and what else is tried where those miss the target."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.levenberg_marquardt import refine
from finlab.allocation.learned.prepared import Prepared
from finlab.allocation.learned.proposal import Proposal
from finlab.forces.force_space import PlanarProblem, polar, realize
from finlab.forces.nearest import nearest, wrench_of

Array = NDArray[Any]


@dataclass(frozen=True)
class RankingSettings:
    """When an answer counts as exact, and which of two answers comes first."""

    exact_error: float = 2e-4
    """Normalized error (by the surrogate) up to which an answer is exact and energy decides: a fiftieth of
    what counts as delivered."""
    error_resolution: float = 5e-5
    """Normalized error by which one inexact answer may be worse than another that is cheaper."""
    inexact_rank: float = 1e9
    """Rank of inexact answers, behind every exact one. Energies reach thousands where an arc of zero
    directions ends near zero, since the energy divides by that end."""
    switch_gain: float = 0.01
    """Share of its energy that a robot in motion must save before it changes the way it moves."""


RANKING = RankingSettings()
"""How answers are compared everywhere."""


class RefinedCandidates(NamedTuple):
    """P refined answers to each of N targets, best first."""

    command: Array
    """(N, P, n, 3)."""
    wrench: Array
    """Normalized wrench (N, P, 6) by the surrogate."""
    error: Array
    """Normalized error (N, P) by the surrogate."""
    energy: Array
    """(N, P)."""

    def with_first(self, other: RefinedCandidates) -> RefinedCandidates:
        """These answers behind those of another search."""
        return RefinedCandidates(*(np.concatenate(both, axis=1) for both in zip(other, self, strict=True)))


def refine_candidates(
    prepared: Prepared, target: Array, command: Array, steps: int, keep_mode: bool = False
) -> RefinedCandidates:
    """Refined commands (N, P, n, 3), best first: the cheapest exact one, or the most exact one.

    With `keep_mode`, the first command is how the robot moves now; another must save the share
    `switch_gain` of its energy to take its place.
    """
    rows, p, n, _ = command.shape
    repeated = target if rows == 1 else np.repeat(target, p, axis=0)
    refined = refine(prepared.commands, repeated, command.reshape(-1, n, 3), steps)
    energy = prepared.energy(refined.command)
    cost = energy.reshape(rows, p)
    if keep_mode:
        cost = cost.copy()
        cost[:, 0] *= 1.0 - RANKING.switch_gain
    error = refined.error.reshape(rows, p)
    order = rank(cost, error, RANKING.exact_error, RANKING.error_resolution).argsort(axis=1)
    order += np.arange(0, rows * p, p)[:, None]
    return RefinedCandidates(*(values.take(order, axis=0) for values in (*refined, energy)))


def improve(
    prepared: Prepared,
    target: Array,
    candidates: RefinedCandidates,
    rows: NDArray[np.bool_],
    starts: Array | None,
    steps: int,
) -> None:
    """Refine some rows of the candidates further, in place, together with new starts (rows, S, n, 3)."""
    command = candidates.command[rows]
    if starts is not None:
        command = np.concatenate([command, prepared.commands.clamp(starts)], axis=1)
    longer = refine_candidates(prepared, target[rows], command, steps)
    for kept, new in zip(candidates, longer, strict=True):
        kept[rows] = new[:, : kept.shape[1]]


def rank(energy: Array, error: Array, exact_error: float, error_resolution: float = 0.0) -> Array:
    """What to sort answers by: the energy of exact ones, and behind them the error of the others.

    Errors that differ by less than the resolution count as one, and the energy decides.
    """
    missed = error > exact_error
    if not missed.any():
        return energy
    behind = RANKING.inexact_rank
    coarse = error_resolution * np.floor(error / error_resolution) if error_resolution else error
    return np.where(missed, behind * (1.0 + coarse) + np.minimum(energy, error_resolution * behind), energy)


@dataclass(frozen=True)
class MissedSettings:
    """How long targets are refined that the first search did not reach."""

    first_lm_steps: int = 5
    """Levenberg-Marquardt steps on the answers that are there, since most need only a few more."""
    nearest_lm_steps: int = 8
    """Steps from the nearest wrench that the fins can deliver: the start is off by as much as the surrogate's
    force differs from the planar model."""
    last_lm_steps: int = 25
    """Steps from fresh starts, which begin anywhere."""
    restarts: int = 32
    """Fresh starts for the very few that even so stay further away than they need to."""
    needless_error: float = 5e-4
    """Normalized error beyond what is proven to be needed that is not worth further starts."""
    needless_share: float = 2e-3
    """The same as a share of what is needed."""
    energy_lm_steps: int = 3
    """Steps after an inexact answer was made cheaper, which changes its error a little."""


MISSED = MissedSettings()
"""How long missed targets are refined."""

FallbackForces = Callable[[PlanarProblem, Array], Array | None]
"""From targets (R, 6) that were missed to planar forces (R, n, 2) [N] that come near them, or None."""


def nearest_forces(problem: PlanarProblem, target: Array) -> Array:
    """The forces (R, n, 2) whose wrench is nearest."""
    return nearest(problem.sets, target).force


def refine_missed(
    prepared: Prepared,
    target: Array,
    proposal: Proposal,
    candidates: RefinedCandidates,
    missed: NDArray[np.bool_],
    fallback: FallbackForces,
    settings: MissedSettings = MISSED,
) -> None:
    """Improve, in place, the answers to targets that were missed.

    Args:
        prepared: the layout.
        target: normalized wrenches (N, 6).
        proposal: the network's raw candidates.
        candidates: the answers so far.
        missed: which targets (N,) were missed.
        fallback: where to start from when more steps do not help; None from it ends the search.
        settings: how long to go on.
    """
    improve(prepared, target, candidates, missed, None, settings.first_lm_steps)
    missed = candidates.error[:, 0] > RANKING.exact_error
    if not missed.any():
        return
    force = fallback(prepared.planar, target[missed])
    if force is None:
        return
    needed = np.zeros(len(target))
    left = target[missed] - wrench_of(prepared.planar.columns, force)
    needed[missed] = np.linalg.norm(left, axis=-1)
    start, _ = realize(prepared.planar, polar(prepared.planar, force))
    improve(prepared, target, candidates, missed, start[:, None], settings.nearest_lm_steps)
    acceptable = settings.needless_error + (1.0 + settings.needless_share) * needed
    missed &= candidates.error[:, 0] > np.maximum(RANKING.exact_error, acceptable)
    if missed.any():
        fresh = _fresh_starts(prepared, proposal.command[missed], settings.restarts)
        improve(prepared, target, candidates, missed, fresh, settings.last_lm_steps)
    reduce_energy(prepared, target, candidates, settings.energy_lm_steps)


def reduce_energy(prepared: Prepared, target: Array, candidates: RefinedCandidates, lm_steps: int) -> None:
    """Give inexact answers, in place, the amplitudes and frequencies by which their forces cost least."""
    missed = candidates.error[:, 0] > RANKING.exact_error
    if missed.any():
        force = prepared.commands.fin.force(candidates.command[missed, 0])[..., 1:]
        cheap, _ = realize(prepared.planar, polar(prepared.planar, force))
        improve(prepared, target, candidates, missed, cheap[:, None], lm_steps)


def _fresh_starts(prepared: Prepared, proposed: Array, count: int) -> Array:
    """Commands (N, count, n, 3): raw candidates of the network and random ones, half and half."""
    raw = proposed[:, : count // 2].astype(np.float64)
    lower, upper = prepared.commands.lower, prepared.commands.upper
    unit = np.random.default_rng(0).random((count - raw.shape[1], len(lower), 3))
    spread = np.broadcast_to(lower + unit * (upper - lower), (len(proposed), *unit.shape))
    return np.concatenate([raw, spread], axis=1)
