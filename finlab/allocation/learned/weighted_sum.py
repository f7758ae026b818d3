"""The paper's weighted sum `err_norm^2 + w J_en`: a little of the wrench given up for a little energy.

Exact answers are where it starts; Levenberg-Marquardt on the squares of error and energy together does the
rest, through the surrogate's Jacobian and inside the limits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.levenberg_marquardt import CommandProblem, Refined
from finlab.physics.energy import EnergyMeter, EnergyWeights, energy_scale

Array = NDArray[Any]

STEPS = 25
"""Most steps; far fewer are needed for small weights."""
DAMPING = (1e-4, 0.3, 10.0)
"""First damping, and its factors after a good and after a bad step."""
SETTLED = 1e-7
"""Relative gain of a step from which a row counts as settled."""


def lessen(
    problem: CommandProblem, target: Array, command: Array, energy: EnergyMeter, energy_tradeoff: float
) -> tuple[Refined, Array]:
    """Commands near a local minimum of the weighted sum, and their energies (R,).

    Args:
        problem: the layout.
        target: normalized wrenches (R, 6).
        command: where to start (R, n, 3), inside the limits.
        energy: of this robot, without inertial power: a sum of squares is needed.
        energy_tradeoff: w.
    """
    rows, n, _ = command.shape
    slope = _energy_slope(problem, energy.weights) * np.sqrt(energy_tradeoff)
    bend = np.zeros((3 * n, 3 * n))
    for i in range(n):
        bend[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = slope[i].T @ slope[i]

    def judge(command: Array) -> Array:
        error = ((problem.wrench(command) - target) ** 2).sum(-1)
        total: Array = error + energy_tradeoff * energy(command)
        return total

    total, damping = judge(command), np.full(rows, DAMPING[0])
    for _ in range(STEPS):
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
        new = judge(tried)
        better = new < total
        gain = np.where(better, (total - new) / np.maximum(total, 1e-12), 0.0)
        command = np.where(better[:, None, None], tried, command)
        total = np.where(better, new, total)
        damping = damping * np.where(better, *DAMPING[1:])
        if (gain < SETTLED).all() and better.any():
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
