"""The paper's weighted sum `err_norm^2 + w J_en`: a little of the wrench given up for a little energy.

It starts from exact answers; `weighted_descent` minimizes the sum inside the limits.
"""

import numpy as np

from finlab.allocation.command_cost import EffortCost
from finlab.allocation.search.levenberg_marquardt import CommandProblem, Refined
from finlab.allocation.weighted_descent import DescentOptions, descend
from finlab.arrays import Array
from finlab.physics.energy import EnergyMeter

LM_STEPS = 25
"""Most Levenberg-Marquardt steps; far fewer are needed for small weights."""


class NormalizedRobot:
    """A prepared layout, in normalized wrenches."""

    def __init__(self, problem: CommandProblem) -> None:
        self.n_fins = len(problem.lower)
        self.lower, self.upper, self.width = problem.lower, problem.upper, problem.span
        self.full_turn = problem.wraps
        self._problem = problem

    def linearize(self, command: Array) -> tuple[Array, Array]:
        """Normalized wrenches (R, 6) of commands (R, n, 3) and their derivatives (R, 6, 3 n)."""
        rows, width = len(command), 3 * self.n_fins
        force, slopes = self._problem.fin.force_and_slopes(command)
        wrench = force.reshape(rows, width) @ self._problem.columns.reshape(width, 6)
        jacobian: Array = np.matmul(slopes, self._problem.columns).reshape(rows, width, 6)
        return wrench, jacobian.swapaxes(1, 2)

    def feasible(self, command: Array) -> Array:
        """Commands (R, n, 3) brought within the limits."""
        return self._problem.clamp(command)


def minimize_weighted_sum(
    problem: CommandProblem, target: Array, command: Array, energy: EnergyMeter, energy_tradeoff: float
) -> tuple[Refined, Array]:
    """Commands near a local minimum of the weighted sum, and their energies (R,).

    Args:
        problem: the layout.
        target: normalized wrenches (R, 6).
        command: where to start (R, n, 3), inside the limits.
        energy: of this robot.
        energy_tradeoff: w.
    """
    options = DescentOptions(n_steps=LM_STEPS, damping=1e-4, tolerance=1e-6)
    cost = EffortCost(energy, energy_tradeoff)
    found = descend(NormalizedRobot(problem), command, target, np.ones(6), options, cost)
    error = np.linalg.norm(found.wrench - target, axis=-1)
    return Refined(found.command, found.wrench, error), energy(found.command)
