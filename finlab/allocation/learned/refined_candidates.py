"""Refined answers and their order: the cheapest exact one first, or the most exact one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.levenberg_marquardt import refine
from finlab.allocation.learned.prepared import Prepared

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
