"""The weighted sum of error and energy, by Levenberg-Marquardt within limits for many commands at once.

Each row minimizes `J = ||(w - target) / sigma||^2 + energy_tradeoff * J_en`. The energy is a quadratic form
that couples only the amplitude and frequency of one fin, so a damped step costs one 6 x 6 solve however many
fins there are (the matrix inversion lemma on the 2 x 2 blocks). A limit that a step would cross fixes its
variable there and the rest of the step is solved anew.

It serves the plant and the learned surrogate. The last steps of method `learned`, on the error alone, have a
leaner Levenberg-Marquardt of their own (`learned.levenberg_marquardt`): they run in every call of about a
millisecond, always for as many steps, and need neither energy nor a record of which rows are done.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights, command_energy, energy_scale

Array = NDArray[Any]
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


@dataclass(frozen=True, eq=False)
class DescentOptions:
    """How long and how carefully to descend."""

    n_steps: int = 30
    """Most steps of one row."""
    energy_tradeoff: float = 0.0
    """Weight of the energy proxy beside the squared normalized error."""
    damping: float = 1e-2
    """Damping of the first step for a full range of each command, times one plus the objective."""
    tolerance: float = 1e-9
    """A row whose objective is below, or whose step lowers it by less than this share of itself, is done."""
    energy_weights: EnergyWeights = DEFAULT_WEIGHTS
    """Weights within the energy proxy; without inertial power, since a quadratic form is needed."""
    energy_upper: Array | None = None
    """Upper limits (n, 3) that the energy divides by; the robot's own where None."""
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
    is_over: Callable[[], bool] = lambda: False,
) -> Descent:
    """Minimize J from B start commands.

    Args:
        plant: the robot.
        start: commands (B, n, 3), within the limits.
        target: desired wrench of each row (B, 6).
        sigma: per-axis standard deviation (6,).
        options: see `DescentOptions`.
        is_over: says when to stop with the best commands so far.
    """
    energy = _EnergyForm(plant, options)
    command = plant.feasible(start)
    wrench, slope = plant.linearize(command)
    objective = _objective(plant, command, wrench, target, sigma, options)
    slope = slope * energy.width / sigma[:, None]
    largest = options.largest_damping
    damping = np.minimum(np.maximum(options.damping * (1.0 + objective), _least(slope, options)), largest)
    busy = np.arange(len(command))
    for _ in range(options.n_steps):
        residual = (wrench[busy] - target[busy]) / sigma
        position = (command[busy] - plant.lower) / energy.safe_width
        step = _clamped_step(position, residual, slope[busy], damping[busy], energy, plant, options.passes)
        trial = plant.feasible(command[busy] + (step * energy.width).reshape(-1, plant.n_fins, 3))
        trial_wrench, trial_slope = plant.linearize(trial)
        trial_objective = _objective(plant, trial, trial_wrench, target[busy], sigma, options)
        better = trial_objective < objective[busy]
        gain = objective[busy] - trial_objective
        rows = busy[better]
        command[rows], wrench[rows] = trial[better], trial_wrench[better]
        slope[rows] = trial_slope[better] * energy.width / sigma[:, None]
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


class _EnergyForm:
    """The energy as a quadratic form in positions between the limits (0 at the lower, 1 at the upper one)."""

    def __init__(self, plant: Robot, options: DescentOptions) -> None:
        self.width = plant.width.ravel()
        self.safe_width = np.where(plant.width > 0, plant.width, 1.0)
        scale = energy_scale(_energy_upper(plant, options))
        self.slope = plant.width / scale
        self.offset = plant.lower / scale
        weights, gamma = options.energy_weights, options.energy_tradeoff
        self.diagonal = gamma * np.array([weights.amplitude, weights.frequency, weights.zero_direction])
        self.product = gamma * weights.product / 2

    def gradient(self, position: Array) -> Array:
        """Half the derivative of the weighted energy by positions (B, n, 3)."""
        value = self.offset + self.slope * position
        result = self.diagonal * value
        result[..., 0] += self.product * value[..., 1]
        result[..., 1] += self.product * value[..., 0]
        return np.asarray(result * self.slope)

    def inverse(self, damping: Array, held: Mask) -> tuple[Array, Array]:
        """Inverse of damping plus energy: diagonal (B, n, 3) and amplitude-frequency entry (B, n).

        Half the energy's Hessian is meant, as the Gauss-Newton matrix is half the error's.
        """
        diagonal = self.diagonal * self.slope**2 + damping[:, None, None] + held * HELD
        off = self.product * self.slope[:, 0] * self.slope[:, 1]
        determinant = diagonal[..., 0] * diagonal[..., 1] - off**2
        inverse = 1.0 / diagonal
        inverse[..., 0] = diagonal[..., 1] / determinant
        inverse[..., 1] = diagonal[..., 0] / determinant
        return inverse, -off / determinant

    @staticmethod
    def apply(vector: Array, inverse: Array, off: Array) -> Array:
        """What `inverse` returned times vectors (..., n, 3)."""
        result = vector * inverse
        # Entry by entry: arithmetic on slices of two is several times slower in numpy.
        result[..., 0] += vector[..., 1] * off
        result[..., 1] += vector[..., 0] * off
        return result


def _clamped_step(
    position: Array,
    residual: Array,
    slope: Array,
    damping: Array,
    energy: _EnergyForm,
    plant: Robot,
    passes: int,
) -> Array:
    """The damped step (B, 3 n) in positions, with variables fixed at the limits that it would cross."""
    shape = position.shape
    pull = energy.gradient(position)
    gradient = np.einsum("bij,bi->bj", slope, residual).reshape(shape) + pull
    free_turn = np.zeros(shape[1:], dtype=bool)
    free_turn[:, 2] = plant.full_turn
    at_low, at_high = position <= 0, position >= 1
    held = ((at_low & (gradient > 0)) | (at_high & (gradient < 0))) & ~free_turn
    moved = np.zeros(shape)
    low, high = np.where(free_turn, -0.5, -position), np.where(free_turn, 0.5, 1 - position)
    for _ in range(passes):
        step = np.where(held, moved, _damped_step(residual, slope, pull, damping, held, energy))
        bounded = np.clip(step, low, high)
        crossing = (bounded != step) & ~free_turn & ~held
        if not crossing.any():
            break
        held |= crossing
        moved = np.where(crossing, bounded, moved)
        jump = np.where(crossing, bounded, 0.0)
        residual = residual + np.einsum("bij,bj->bi", slope, jump.reshape(len(position), -1))
        pull = energy.gradient(position + jump)
    return bounded.reshape(len(position), -1)


def _damped_step(
    residual: Array, slope: Array, pull: Array, damping: Array, held: Mask, energy: _EnergyForm
) -> Array:
    """Minimizer of `||r + J d||^2 + energy + damping ||d||^2` over the free variables, shape (B, n, 3)."""
    n_rows, n_fins = pull.shape[:2]
    inverse, off = energy.inverse(damping, held)

    rest = -energy.apply(pull, inverse, off)
    weighted = energy.apply(slope.reshape(n_rows, 6, n_fins, 3), inverse[:, None], off[:, None])
    weighted = weighted.reshape(n_rows, 6, -1)
    matrix = weighted @ slope.transpose(0, 2, 1)
    matrix[:, np.arange(6), np.arange(6)] += 1.0
    missing = residual + np.einsum("bij,bj->bi", slope, rest.reshape(n_rows, -1))
    multiplier = np.linalg.solve(matrix, missing[..., None])[..., 0]
    return np.asarray(rest - np.einsum("bij,bi->bj", weighted, multiplier).reshape(pull.shape))


def _objective(
    plant: Robot,
    command: Array,
    wrench: Array,
    target: Array,
    sigma: Array,
    options: DescentOptions,
) -> Array:
    total: Array = (((wrench - target) / sigma) ** 2).sum(axis=-1)
    if options.energy_tradeoff != 0:
        energy = command_energy(command, _energy_upper(plant, options), options.energy_weights)
        total = total + options.energy_tradeoff * energy
    return total


def _energy_upper(plant: Robot, options: DescentOptions) -> Array:
    return plant.upper if options.energy_upper is None else options.energy_upper
