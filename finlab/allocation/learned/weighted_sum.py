"""The paper's weighted sum `err_norm^2 + w J_en`: a little of the wrench given up for a little energy.

It starts from exact answers; Levenberg-Marquardt on the squares of error and energy together minimizes the
sum, through the surrogate's Jacobian and inside the limits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.levenberg_marquardt import CommandProblem, Refined
from finlab.physics.energy import EnergyMeter, EnergyWeights, energy_scale

Array = NDArray[Any]


@dataclass(frozen=True)
class WeightedSumSettings:
    """How the sum is minimized."""

    lm_steps: int = 25
    """Most Levenberg-Marquardt steps; far fewer are needed for small weights."""
    damping: float = 1e-4
    """Damping of the first step, in units of the limit ranges."""
    less_damping: float = 0.3
    """Factor of the damping after a step that lowered the sum."""
    more_damping: float = 10.0
    """Factor of the damping after one that did not."""
    settled_gain: float = 1e-7
    """Relative gain of a step below which a row counts as settled."""


WEIGHTED_SUM = WeightedSumSettings()
"""What the pipeline uses."""


def minimize_weighted_sum(
    problem: CommandProblem,
    target: Array,
    command: Array,
    energy: EnergyMeter,
    energy_tradeoff: float,
    settings: WeightedSumSettings = WEIGHTED_SUM,
) -> tuple[Refined, Array]:
    """Commands near a local minimum of the weighted sum, and their energies (R,).

    Args:
        problem: the layout.
        target: normalized wrenches (R, 6).
        command: where to start (R, n, 3), inside the limits.
        energy: of this robot, without inertial power: a sum of squares is needed.
        energy_tradeoff: w.
        settings: how long and how carefully.
    """
    rows, n, _ = command.shape
    slope = _energy_slope(problem, energy.weights) * np.sqrt(energy_tradeoff)
    bend = np.zeros((3 * n, 3 * n))
    for i in range(n):
        bend[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = slope[i].T @ slope[i]

    def evaluate(command: Array) -> Array:
        error = ((problem.wrench(command) - target) ** 2).sum(-1)
        total: Array = error + energy_tradeoff * energy(command)
        return total

    total, damping = evaluate(command), np.full(rows, settings.damping)
    for _ in range(settings.lm_steps):
        force, by_command = problem.fin.force_and_slopes(command)
        residual = target - force.reshape(rows, 3 * n) @ problem.columns.reshape(3 * n, 6)
        jacobian = (np.matmul(by_command, problem.columns) * problem.span[..., None]).reshape(rows, 3 * n, 6)
        # Half the gradient, in units of the limit ranges: the energy is a quadratic form of the command.
        position = np.divide(command, problem.span, out=np.zeros_like(command), where=problem.span > 0.0)
        downhill = (jacobian @ residual[..., None])[..., 0] - position.reshape(rows, 3 * n) @ bend
        held = _held(problem, command, downhill)
        matrix = jacobian @ jacobian.swapaxes(1, 2) + bend
        matrix = np.where(held[:, :, None] | held[:, None, :], 0.0, matrix)
        matrix.reshape(rows, -1)[:, :: 3 * n + 1] += damping[:, None] + 1e-12 + held
        change = np.linalg.solve(matrix, np.where(held, 0.0, downhill)[..., None])[..., 0]
        tried = problem.clamp(command + change.reshape(rows, n, 3) * problem.span)
        new = evaluate(tried)
        better = new < total
        gain = np.where(better, (total - new) / np.maximum(total, 1e-12), 0.0)
        command = np.where(better[:, None, None], tried, command)
        total = np.where(better, new, total)
        damping = damping * np.where(better, settings.less_damping, settings.more_damping)
        if (gain < settings.settled_gain).all() and better.any():
            break
    wrench = problem.wrench(command)
    error = np.linalg.norm(wrench - target, axis=-1)
    return Refined(command, wrench, error), energy(command)


def _energy_slope(problem: CommandProblem, weights: EnergyWeights) -> Array:
    """The matrices (n, 3, 3) whose products with a command over its ranges, squared, sum to the energy."""
    half = 0.5 * weights.product
    form = np.array(
        [[weights.amplitude, half, 0.0], [half, weights.frequency, 0.0], [0.0, 0.0, weights.zero_direction]]
    )
    values, vectors = np.linalg.eigh(form)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    slope: Array = root * (problem.span / energy_scale(problem.upper))[:, None, :]
    return slope


def _held(problem: CommandProblem, command: Array, downhill: Array) -> NDArray[np.bool_]:
    """Which commands (R, 3n) are at a limit and want out, or cannot move at all."""
    low, high = problem.edges
    want = downhill.reshape(command.shape)
    held: NDArray[np.bool_] = ((command <= low) & (want < 0.0)) | ((command >= high) & (want > 0.0))
    return (held | (problem.span <= 0.0)).reshape(len(command), -1)
