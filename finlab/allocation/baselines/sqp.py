"""Method `sqp`: re-linearize at the iterate, box QP on the normalized residual, backtracking line search."""

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.baselines.box_least_squares import solve_box_quadratics
from finlab.allocation.baselines.model_based import TIME_LIMIT_S, ModelBased, TimeLimit, check_time_limit
from finlab.inference.normalization import Normalization
from finlab.physics import Plant

Array = NDArray[np.float64]

CHUNK = 2048
"""Rows stepped together; more would not fit the caches."""
SOLVED = 1e-8
"""Normalized error at which a row stops."""
RIDGE = 1e-13
"""Least weight of a step's length, relative to the squared derivatives: that the quadratic programs have one
solution must not be lost to rounding where fins are strong."""


class Sqp(ModelBased):
    """Sequential quadratic programming as the paper describes it, all targets of a layout stepped together.

    Each step minimizes `||r + J d||^2 + regularization ||d||^2` exactly within the limits, over commands as
    positions between their limits. The first start is the middle of the limits; targets that are not met from
    there get further, random starts, and the smallest error wins. Knows the analytic fin model.

    Args:
        normalization: sigma scales the error.
        n_steps: most steps per start.
        n_starts: starts per target.
        regularization: weight of a step's length, as a share of the squared error at the iterate.
        time_limit_s: processor time per target after which the best command so far is the answer.
    """

    name = "sqp"

    def __init__(
        self,
        normalization: Normalization,
        *,
        n_steps: int = 30,
        n_starts: int = 4,
        regularization: float = 1e-4,
        time_limit_s: float = TIME_LIMIT_S,
    ) -> None:
        super().__init__(normalization)
        self.n_steps = n_steps
        self.n_starts = n_starts
        self.regularization = regularization
        self.time_limit_s = check_time_limit(time_limit_s)

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        limit = TimeLimit(self.time_limit_s * len(targets))
        best = np.empty((len(targets), plant.n_fins, 3))
        error = np.full(len(targets), np.inf)
        middle = (plant.lower + plant.upper) / 2
        others = plant.sample(np.random.default_rng(seed), (self.n_starts - 1,))
        for start in (middle, *others):
            for first in range(0, len(targets), CHUNK):
                rows = np.arange(first, min(first + CHUNK, len(targets)))
                rows = rows[error[rows] > SOLVED]
                if not len(rows) or (limit.over and start is not middle):
                    continue
                command, reached = self._descend(plant, start, targets[rows], limit)
                better = reached < error[rows]
                best[rows[better]], error[rows[better]] = command[better], reached[better]
        return best

    def _descend(self, plant: Plant, start: Array, targets: Array, limit: TimeLimit) -> tuple[Array, Array]:
        """Where one start (n, 3) ends for each target (B, 6), and the normalized error (B,) there."""
        sigma, width = self.normalization.std, plant.width.ravel()
        command = np.tile(start, (len(targets), 1, 1))
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
