"""The weighted sum of error and cost, by Levenberg-Marquardt within limits for many commands at once.

Each row minimizes `J = ||(w - target) / sigma||^2 + cost`. For the cost stands a quadratic that couples only
the amplitude and frequency of one fin, so a damped step costs one 6 x 6 solve however many fins there are
(the matrix inversion lemma on the 2 x 2 blocks). A limit that a step would cross fixes its variable there and
the rest of the step is solved anew.

The last steps of method `search`, on the error alone, have a leaner Levenberg-Marquardt of their own
(`search.levenberg_marquardt`): they run in every call of about a millisecond, always for as many steps, and
need neither cost nor a record of which rows are done.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.command_cost import Bowl, CommandCost
from finlab.arrays import Array
from finlab.forces.small_systems import solve_symmetric

Mask = NDArray[np.bool_]

HELD = 1e30
"""Damping that keeps a variable where it is."""


class Robot(Protocol):
    """Commands to wrenches within limits, such as a `Plant`."""

    @property
    def n_fins(self) -> int:
        """How many fins there are."""

    @property
    def lower(self) -> Array:
        """Lower limits (n, 3)."""

    @property
    def upper(self) -> Array:
        """Upper limits (n, 3)."""

    @property
    def width(self) -> Array:
        """Ranges of the limits (n, 3)."""

    @property
    def full_turn(self) -> Mask:
        """Fins (n,) whose zero direction may turn freely."""

    def linearize(self, command: Array) -> tuple[Array, Array]:
        """Wrenches (B, 6) of commands (B, n, 3) and their derivatives (B, 6, 3 n)."""

    def feasible(self, command: Array) -> Array:
        """Commands (B, n, 3) brought within the limits."""


@dataclass(frozen=True)
class DescentOptions:
    """How long and how carefully to descend."""

    n_steps: int = 30
    """Most steps of one row."""
    damping: float = 1e-2
    """Damping of the first step for a full range of each command, times one plus the objective."""
    tolerance: float = 1e-9
    """A row whose objective is below, or whose step lowers it by less than this share of itself, is done."""
    least_damping: float = 1e-12
    """Least damping, absolute."""
    least_relative_damping: float = 1e-13
    """Least damping relative to a row's squared derivatives: less would leave systems singular to rounding
    where fins are strong and levers long."""
    largest_damping: float = 1e9
    """A row whose damping is larger is done: no step in any direction helps."""
    damping_factors: tuple[float, float] = (0.2, 6.0)
    """Factor of the damping after a step that lowers the objective, and after one that does not."""
    passes: int = 2
    """Times a step is solved: once freely, then with the limits it crossed."""


class Descent(NamedTuple):
    """Where B rows ended."""

    command: Array
    """Commands (B, n, 3), within the limits."""
    wrench: Array
    """Their wrenches (B, 6) [N, N m]."""
    objective: Array
    """J (B,)."""


def descend(
    plant: Robot,
    start: Array,
    target: Array,
    sigma: Array,
    options: DescentOptions,
    cost: CommandCost | None = None,
    is_over: Callable[[], bool] = lambda: False,
) -> Descent:
    """Minimize J from B start commands.

    Args:
        plant: the robot.
        start: commands (B, n, 3), within the limits.
        target: desired wrench of each row (B, 6).
        sigma: per-axis standard deviation (6,).
        options: see `DescentOptions`.
        cost: what counts beside the squared normalized error; nothing where None.
        is_over: says when to stop with the best commands so far.
    """
    width = plant.width.ravel()
    safe_width = np.where(plant.width > 0, plant.width, 1.0)
    command = plant.feasible(start)
    wrench, slope = plant.linearize(command)
    objective = _objective(command, wrench, target, sigma, cost)
    slope = slope * width / sigma[:, None]
    largest = options.largest_damping
    damping = np.minimum(np.maximum(options.damping * (1.0 + objective), _least(slope, options)), largest)
    busy = np.arange(len(command))
    for _ in range(options.n_steps):
        residual = (wrench[busy] - target[busy]) / sigma
        position = (command[busy] - plant.lower) / safe_width
        bowl = _bowl(plant, command[busy], cost)
        step = _clamped_step(position, residual, slope[busy], damping[busy], bowl, plant, options.passes)
        trial = plant.feasible(command[busy] + (step * width).reshape(-1, plant.n_fins, 3))
        trial_wrench, trial_slope = plant.linearize(trial)
        trial_objective = _objective(trial, trial_wrench, target[busy], sigma, cost)
        better = trial_objective < objective[busy]
        gain = objective[busy] - trial_objective
        rows = busy[better]
        command[rows], wrench[rows] = trial[better], trial_wrench[better]
        slope[rows] = trial_slope[better] * width / sigma[:, None]
        objective[rows] = trial_objective[better]
        changed = damping[busy] * np.where(better, *options.damping_factors)
        damping[busy] = np.minimum(np.maximum(changed, _least(slope[busy], options)), largest)
        settled = better & (gain <= options.tolerance * np.maximum(objective[busy], options.tolerance))
        busy = busy[~settled & (objective[busy] > options.tolerance**2) & (damping[busy] < largest)]
        if not len(busy) or is_over():
            break
    return Descent(command, wrench, objective)


def _least(slope: Array, options: DescentOptions) -> Array:
    """Least damping (B,) of rows with these derivatives (B, 6, 3 n)."""
    squared: Array = np.einsum("bij,bij->b", slope, slope)
    return np.maximum(options.least_damping, options.least_relative_damping * squared)


def _objective(command: Array, wrench: Array, target: Array, sigma: Array, cost: CommandCost | None) -> Array:
    total: Array = (((wrench - target) / sigma) ** 2).sum(axis=-1)
    return total if cost is None else total + cost(command)


def _bowl(plant: Robot, command: Array, cost: CommandCost | None) -> Bowl:
    """The quadratic that stands for the cost near commands (B, n, 3), in positions between the limits (0 at
    the lower, 1 at the upper one)."""
    if cost is None:
        nothing = np.zeros(command.shape)
        return Bowl(nothing, nothing, nothing[..., 0])
    return cost.bowl(command).in_units(plant.width)


def _times(vector: Array, diagonal: Array, mixed: Array) -> Array:
    """A matrix of blocks, its diagonal (..., n, 3) and amplitude-frequency entries (..., n), times vectors
    (..., n, 3)."""
    result = vector * diagonal
    # Entry by entry: arithmetic on slices of two is several times slower in numpy.
    result[..., 0] += vector[..., 1] * mixed
    result[..., 1] += vector[..., 0] * mixed
    return result


def _inverse(bowl: Bowl, damping: Array, held: Mask) -> tuple[Array, Array]:
    """Inverse of damping plus curvature: diagonal (B, n, 3) and amplitude-frequency entry (B, n).

    Half the cost's Hessian is meant, as the Gauss-Newton matrix is half the error's.
    """
    diagonal = bowl.diagonal + damping[:, None, None] + held * HELD
    determinant = diagonal[..., 0] * diagonal[..., 1] - bowl.mixed**2
    inverse = 1.0 / diagonal
    inverse[..., 0] = diagonal[..., 1] / determinant
    inverse[..., 1] = diagonal[..., 0] / determinant
    return inverse, -bowl.mixed / determinant


def _clamped_step(
    position: Array,
    residual: Array,
    slope: Array,
    damping: Array,
    bowl: Bowl,
    plant: Robot,
    passes: int,
) -> Array:
    """The damped step (B, 3 n) in positions, with variables fixed at the limits that it would cross."""
    shape = position.shape
    pull = bowl.slope
    gradient = np.einsum("bij,bi->bj", slope, residual).reshape(shape) + pull
    free_turn = np.zeros(shape[1:], dtype=bool)
    free_turn[:, 2] = plant.full_turn
    at_low, at_high = position <= 0, position >= 1
    held = ((at_low & (gradient > 0)) | (at_high & (gradient < 0))) & ~free_turn
    moved = np.zeros(shape)
    low, high = np.where(free_turn, -0.5, -position), np.where(free_turn, 0.5, 1 - position)
    for _ in range(passes):
        step = np.where(held, moved, _damped_step(residual, slope, pull, damping, held, bowl))
        bounded = np.clip(step, low, high)
        crossing = (bounded != step) & ~free_turn & ~held
        if not crossing.any():
            break
        held |= crossing
        moved = np.where(crossing, bounded, moved)
        jump = np.where(crossing, bounded, 0.0)
        residual = residual + np.einsum("bij,bj->bi", slope, jump.reshape(len(position), -1))
        pull = pull + _times(jump, bowl.diagonal, bowl.mixed)
    return bounded.reshape(len(position), -1)


def _damped_step(residual: Array, slope: Array, pull: Array, damping: Array, held: Mask, bowl: Bowl) -> Array:
    """Minimizer of `||r + J d||^2 + cost + damping ||d||^2` over the free variables, shape (B, n, 3)."""
    n_rows, n_fins = pull.shape[:2]
    inverse, mixed = _inverse(bowl, damping, held)

    rest = -_times(pull, inverse, mixed)
    weighted = _times(slope.reshape(n_rows, 6, n_fins, 3), inverse[:, None], mixed[:, None])
    weighted = weighted.reshape(n_rows, 6, -1)
    matrix = weighted @ slope.transpose(0, 2, 1)
    matrix[:, np.arange(6), np.arange(6)] += 1.0
    missing = residual + np.einsum("bij,bj->bi", slope, rest.reshape(n_rows, -1))
    multiplier = solve_symmetric(matrix, missing[..., None])[..., 0]
    return np.asarray(rest - np.einsum("bij,bi->bj", weighted, multiplier).reshape(pull.shape))
