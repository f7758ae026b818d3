"""Levenberg-Marquardt on the commands, through the surrogate's closed-form Jacobian, inside the limits.

The last word of every learned allocation: it works in commands, not forces, and with the whole
surrogate, so it removes what the planar search's simplifications leave.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned_fin import LearnedFin

Array = NDArray[Any]


class CommandProblem(NamedTuple):
    """One layout as the refinement sees it."""

    fin: LearnedFin
    """The learned fin."""
    columns: Array
    """Normalized wrench per newton (n, 3, 6) of each fin's force along shaft, e_h and e_z."""
    lower: Array
    """Lower limits (n, 3)."""
    upper: Array
    """Upper limits (n, 3)."""
    wraps: NDArray[np.bool_]
    """True (n,) where the zero direction may turn a full circle."""

    def wrench(self, command: Array) -> Array:
        """Normalized wrenches (R, 6) of commands (R, n, 3)."""
        rows, n, _ = command.shape
        return self.fin.force(command).reshape(rows, 3 * n) @ self.columns.reshape(3 * n, 6)

    def clamp(self, command: NDArray[np.floating]) -> NDArray[np.floating]:
        """Commands (..., n, 3) inside the limits, zero directions wrapped first; the type is kept."""
        kind = command.dtype.type
        middle = (0.5 * (self.lower[:, 2] + self.upper[:, 2])).astype(kind)
        half_turn, turn = kind(np.pi), kind(2 * np.pi)
        moved = command.copy()
        moved[..., 2] = np.mod(command[..., 2] - middle + half_turn, turn) + (middle - half_turn)
        np.maximum(moved, self.lower.astype(kind), out=moved)
        return np.minimum(moved, self.upper.astype(kind), out=moved)


class Refined(NamedTuple):
    """R refined commands."""

    command: Array
    """(R, n, 3), inside the limits."""
    wrench: Array
    """Normalized wrench (R, 6) by the surrogate."""
    error: Array
    """Normalized error (R,) of that wrench."""


def refine(
    problem: CommandProblem,
    target: Array,
    command: Array,
    steps: int,
    *,
    damping: float = 1e-6,
    weights: Array | float = 1.0,
) -> Refined:
    """Reduce the tracking error of commands (R, n, 3) towards normalized targets (R, 6).

    Each step is the smallest change, in units of the limit ranges, that cancels the error to first
    order; commands at a limit that would leave it are held. A step that makes a row worse is undone
    and that row's damping raised.

    Args:
        problem: the layout.
        target: normalized wrenches (R, 6).
        command: where to start (R, n, 3).
        steps: number of steps.
        damping: first damping of each row.
        weights: of the axes of the error (6,); the error and wrench that are answered are weighted too.
    """
    rows, n, _ = command.shape
    span = problem.upper - problem.lower
    columns = (problem.columns * weights).reshape(3 * n, 6)
    target = target * weights
    damping_of = np.full(rows, damping)
    best: tuple[Array, Array, Array] | None = None  # command, wrench, squared error
    for step in range(steps + 1):
        if step < steps:
            force, slope = problem.fin.force_and_jacobian(command)
        else:
            force = problem.fin.force(command)
        wrench = force.reshape(rows, 3 * n) @ columns
        residual = target - wrench
        error = np.einsum("ri,ri->r", residual, residual)
        if best is not None:
            worse = error > best[2]
            damping_of = np.where(worse, damping_of * 30.0 + 1e-4, damping_of * 0.3)
            if worse.any():
                command = np.where(worse[:, None, None], best[0], command)
                wrench = np.where(worse[:, None], best[1], wrench)
                error = np.where(worse, best[2], error)
                residual = target - wrench
                if step < steps:
                    force, slope = problem.fin.force_and_jacobian(command)
        best = (command, wrench, error)
        if step < steps:
            # (R, n, 3 commands, 6): change of the normalized wrench per unit of each limit range.
            jacobian = np.matmul(slope.swapaxes(-1, -2), columns.reshape(n, 3, 6))
            jacobian *= span[..., None]
            command = problem.clamp(command + _step(problem, command, jacobian, residual, damping_of) * span)
    assert best is not None
    return Refined(best[0], best[1], np.sqrt(best[2]))


def _step(problem: CommandProblem, command: Array, jacobian: Array, residual: Array, damping: Array) -> Array:
    """Damped smallest change (R, n, 3), in units of the limit ranges, that leaves no limit."""
    rows, n, _ = command.shape
    free = jacobian.reshape(rows, 3 * n, 6)
    for attempt in range(2):
        gram = free.swapaxes(1, 2) @ free
        gram.reshape(rows, 36)[:, ::7] += (damping + 1e-9)[:, None]
        multiplier = np.linalg.solve(gram, residual[..., None])
        change = (free @ multiplier).reshape(rows, n, 3)
        if attempt == 0:
            # Hold what is at a limit and wants out, then solve again with the rest.
            out = _leaves(problem, command, change)
            if not out.any():
                break
            free = np.where(out.reshape(rows, 3 * n, 1), 0.0, free)
    return change


def _leaves(problem: CommandProblem, command: Array, change: Array) -> NDArray[np.bool_]:
    """True where a command sits at a limit and the change would push it out."""
    tolerance = 1e-9
    below = (command <= problem.lower + tolerance) & (change < 0)
    above = (command >= problem.upper - tolerance) & (change > 0)
    out = below | above
    out[..., 2] &= ~problem.wraps
    return out
