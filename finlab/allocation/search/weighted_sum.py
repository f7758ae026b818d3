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
    found = descend(problem, command, target, np.ones(6), options, cost)
    error = np.linalg.norm(found.wrench - target, axis=-1)
    return Refined(found.command, found.wrench, error), energy(found.command)
