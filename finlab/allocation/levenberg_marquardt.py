"""Levenberg-Marquardt on the commands, through the surrogate's closed-form Jacobian, inside the limits.

The last word of every learned allocation: it works in commands, not forces, and with the whole
surrogate, so it removes what the planar search's simplifications leave.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned_fin import LearnedFin

Array = NDArray[np.float64]


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


def refine(problem: CommandProblem, target: Array, command: Array, steps: int, damping: float = 1e-6) -> Array:
    """Reduce the tracking error of commands (R, n, 3) towards normalized targets (R, 6).

    Each step is the smallest change, in units of the limit ranges, that cancels the error to first
    order; commands at a limit that would leave it are held. A step that makes a row worse is undone
    and that row's damping raised.
    """
    rows, n, _ = command.shape
    span = problem.upper - problem.lower
    flat_columns = problem.columns
    mu = np.full(rows, damping)
    best = command
    best_error = np.full(rows, np.inf)
    identity = np.eye(6)
    for step in range(steps + 1):
        if step == steps:
            error = ((target - problem.wrench(command)) ** 2).sum(-1)
            return np.where((error < best_error)[:, None, None], command, best)
        force, slope = problem.fin.force_and_jacobian(command)
        residual = target - force.reshape(rows, 3 * n) @ flat_columns.reshape(3 * n, 6)
        error = (residual * residual).sum(-1)
        worse = error > best_error
        if worse.any():
            mu = np.where(worse, mu * 30.0 + 1e-4, mu * 0.3)
            command = np.where(worse[:, None, None], best, command)
            force, slope = problem.fin.force_and_jacobian(command)
            residual = target - force.reshape(rows, 3 * n) @ flat_columns.reshape(3 * n, 6)
            error = (residual * residual).sum(-1)
        best, best_error = command, error
        # (R, n, 3 commands, 6): change of the normalized wrench per unit of each limit range.
        jacobian = np.matmul(np.swapaxes(slope, -1, -2), flat_columns) * span[..., None]
        scale = _freedom(problem, command)
        for _ in range(2):
            scaled = (jacobian * scale[..., None]).reshape(rows, 3 * n, 6)
            gram = np.swapaxes(scaled, 1, 2) @ scaled
            gram += (mu[:, None, None] + 1e-9) * identity
            multiplier = np.linalg.solve(gram, residual[..., None])
            change = ((scaled @ multiplier)[..., 0]).reshape(rows, n, 3) * scale
            # Hold what is at a limit and wants out, then solve again with the rest.
            out = _leaves(problem, command, change)
            if not out.any():
                break
            scale = np.where(out, 0.0, scale)
        command = problem.clamp(command + change * span)
    return best


def _freedom(problem: CommandProblem, command: Array) -> Array:
    """1 for every command that may move (R, n, 3); 0 for those with a zero-width range."""
    return np.broadcast_to((problem.upper > problem.lower).astype(np.float64), command.shape)


def _leaves(problem: CommandProblem, command: Array, change: Array) -> NDArray[np.bool_]:
    """True where a command sits at a limit and the change would push it out."""
    tolerance = 1e-9
    below = (command <= problem.lower + tolerance) & (change < 0)
    above = (command >= problem.upper - tolerance) & (change > 0)
    out = below | above
    out[..., 2] &= ~problem.wraps
    return out
