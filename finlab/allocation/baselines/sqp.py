"""Method `sqp`: re-linearize at the iterate, box QP on the normalized residual, backtracking line search."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.baselines.box_least_squares import solve_box_quadratics
from finlab.allocation.baselines.model_based import TimeLimit, TimeLimited
from finlab.arrays import Array
from finlab.physics import Plant

CHUNK = 2048
"""Rows stepped together; more would not fit the caches."""
SOLVED = 1e-8
"""Normalized error at which a row stops."""
RIDGE = 1e-13
"""Least weight of a step's length, relative to the squared derivatives: that the quadratic programs have one
solution must not be lost to rounding where fins are strong."""


@dataclass(eq=False, repr=False, kw_only=True)
class Sqp(TimeLimited):
    """Sequential quadratic programming as the paper describes it, all targets of a layout stepped together.

    Each step minimizes `||r + J d||^2 + regularization ||d||^2` exactly within the limits, over commands as
    positions between their limits. It starts from the pseudo-inverse's answer, whose fins give their forces
    by the cheapest commands, and from the middle of the limits; of two ends that meet the target the cheaper
    one wins, else the smaller error. Targets that neither meets get further, random starts.
    """

    name = "sqp"
    n_steps: int = 30
    """Most steps per start."""
    n_starts: int = 4
    """Starts per target beside the pseudo-inverse's answer."""
    regularization: float = 1e-4
    """Weight of a step's length, as a share of the squared error at the iterate."""

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        first = self._inverse(plant).command(targets)  # a fin is compiled once, which no target pays for
        limit = TimeLimit(self.time_limit_s * len(targets))
        middle = np.tile((plant.lower + plant.upper) / 2, (len(targets), 1, 1))
        best, error = self._from(plant, first, targets, limit)
        if not limit.over:
            other, reached = self._from(plant, middle, targets, limit)
            cost = self._cost(plant)
            both = (error <= SOLVED) & (reached <= SOLVED)
            better = np.where(both, cost(other) < cost(best), reached < error)
            best[better], error[better] = other[better], reached[better]
        for start in plant.sample(np.random.default_rng(seed), (self.n_starts - 1,)):
            rows = np.flatnonzero(error > SOLVED)
            if not len(rows) or limit.over:
                break
            command, reached = self._from(plant, np.tile(start, (len(rows), 1, 1)), targets[rows], limit)
            better = reached < error[rows]
            best[rows[better]], error[rows[better]] = command[better], reached[better]
        return best

    def _from(self, plant: Plant, start: Array, targets: Array, limit: TimeLimit) -> tuple[Array, Array]:
        """`_descend`, as many rows together as fit the caches."""
        parts = [
            self._descend(plant, start[first : first + CHUNK], targets[first : first + CHUNK], limit)
            for first in range(0, len(targets), CHUNK)
        ]
        command, error = zip(*parts, strict=True) if parts else ((start,), (np.empty(0),))
        return np.concatenate(command), np.concatenate(error)

    def _descend(self, plant: Plant, start: Array, targets: Array, limit: TimeLimit) -> tuple[Array, Array]:
        """Where starts (B, n, 3) end for targets (B, 6), and the normalized errors (B,) there."""
        sigma, width = self.normalization.std, plant.width.ravel()
        command = start.copy()
        busy = np.arange(len(command))
        error = self.normalization.error(plant.wrench(command), targets)
        for _ in range(self.n_steps):
            busy = busy[error[busy] > SOLVED]
            if not len(busy) or limit.over:
                break
            at = command[busy]
            wrench, jacobian = plant.linearize(at)
            residual = (wrench - targets[busy]) / sigma
            slope = jacobian * width / sigma[:, None]
            hessian = slope.transpose(0, 2, 1) @ slope
            diagonal = np.arange(len(width))
            least = 1e-12 + RIDGE * np.einsum("bij,bij->b", slope, slope)
            weight = np.maximum(self.regularization * error[busy] ** 2, least)
            hessian[:, diagonal, diagonal] += weight[:, None]
            gradient = np.einsum("bij,bi->bj", slope, residual)
            low, high = self._room(plant, at)
            step = solve_box_quadratics(hessian, gradient, low, high, is_over=lambda: limit.over)
            step = step.reshape(at.shape) * plant.width
            moved = self._search(plant, command, error, targets, busy, step)
            busy = busy[moved]
        return command, error

    @staticmethod
    def _room(plant: Plant, command: Array) -> tuple[Array, Array]:
        """How far each command may step (B, 3 n), as a share of its range; a free turn, half a turn."""
        safe = np.where(plant.width > 0, plant.width, 1.0)
        low, high = (plant.lower - command) / safe, (plant.upper - command) / safe
        low[:, plant.full_turn, 2], high[:, plant.full_turn, 2] = -0.5, 0.5
        shape = (len(command), -1)
        return np.minimum(low, 0.0).reshape(shape), np.maximum(high, 0.0).reshape(shape)

    def _search(
        self,
        plant: Plant,
        command: Array,
        error: Array,
        targets: Array,
        rows: NDArray[np.intp],
        step: Array,
    ) -> NDArray[np.bool_]:
        """Halve each row's step until its error falls; updates in place, says which rows (B,) moved."""
        moved = np.zeros(len(rows), dtype=bool)
        pending = np.arange(len(rows))
        length = 1.0
        for _ in range(8):
            trial = plant.feasible(command[rows[pending]] + length * step[pending])
            reached = self.normalization.error(plant.wrench(trial), targets[rows[pending]])
            good = reached < error[rows[pending]] * (1 - 1e-4 * length)
            done = rows[pending[good]]
            command[done], error[done] = trial[good], reached[good]
            moved[pending[good]] = True
            pending = pending[~good]
            if not len(pending):
                break
            length /= 2
        return moved
