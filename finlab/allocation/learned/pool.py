"""Refined answers and their order: the cheapest exact one first, or the most exact one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.levenberg_marquardt import refine
from finlab.allocation.learned.prepared import Prepared

Array = NDArray[Any]

TOLERANCE = 2e-4
"""Normalized error (by the surrogate) below which an answer counts as exact and energy decides."""
INEXACT = 1e9
"""Rank of inexact answers, behind every exact one. Energies reach thousands where an arc of zero directions
ends near zero, since the energy divides by that end."""
GRAIN = 5e-5
"""Normalized error by which one inexact answer may be worse than another that is cheaper."""
SWITCH_GAIN = 0.01
"""Share of its energy that a robot in motion must save before it changes the way it moves."""


class Pool(NamedTuple):
    """P refined answers to each of N targets, best first."""

    command: Array
    """(N, P, n, 3)."""
    wrench: Array
    """Normalized wrench (N, P, 6) by the surrogate."""
    error: Array
    """Normalized error (N, P) by the surrogate."""
    energy: Array
    """(N, P)."""


def refine_pool(prepared: Prepared, target: Array, command: Array, steps: int, steady: bool = False) -> Pool:
    """Refined commands (N, P, n, 3), best first: the cheapest exact one, or the most exact one.

    With `steady`, the first command is how the robot moves now; another must save the share
    `SWITCH_GAIN` of its energy to take its place.
    """
    rows, p, n, _ = command.shape
    repeated = target if rows == 1 else np.repeat(target, p, axis=0)
    refined = refine(prepared.commands, repeated, command.reshape(-1, n, 3), steps)
    energy = prepared.energy(refined.command)
    cost = energy.reshape(rows, p)
    if steady:
        cost = cost.copy()
        cost[:, 0] *= 1.0 - SWITCH_GAIN
    error = refined.error.reshape(rows, p)
    order = rank(cost, error, TOLERANCE, GRAIN).argsort(axis=1) + np.arange(0, rows * p, p)[:, None]
    return Pool(*(values.take(order, axis=0) for values in (*refined, energy)))


def improve(
    prepared: Prepared,
    target: Array,
    pool: Pool,
    rows: NDArray[np.bool_],
    starts: Array | None,
    steps: int,
) -> None:
    """Refine some rows of a pool further, in place, together with new starts (rows, S, n, 3)."""
    command = pool.command[rows]
    if starts is not None:
        command = np.concatenate([command, prepared.commands.clamp(starts)], axis=1)
    longer = refine_pool(prepared, target[rows], command, steps)
    for kept, new in zip(pool, longer, strict=True):
        kept[rows] = new[:, : kept.shape[1]]


def rank(energy: Array, error: Array, tolerance: float, grain: float = 0.0) -> Array:
    """What to sort answers by: the energy of exact ones, and behind them the error of the others.

    Errors in the same grain count as one, and the energy decides.
    """
    missed = error > tolerance
    if not missed.any():
        return energy
    coarse = grain * np.floor(error / grain) if grain else error
    return np.where(missed, INEXACT * (1.0 + coarse) + np.minimum(energy, grain * INEXACT), energy)
