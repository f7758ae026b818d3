"""Commands of robots with drag: what the dual leaves to their own laws.

The dual takes a foil for all between its curve of lift and drag and the chord of it. From the forces that are
cheapest there, Levenberg-Marquardt steps mostly lead to commands that give the wrench; where they do not,
other starts are tried.
"""

import numpy as np

from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.arrays import Array
from finlab.physics.plant import Plant
from finlab.precision import NEARLY, NOTHING, ROUNDS


def command_with_drag(
    problem: CommandProblem, plant: Plant, wrench: Array, starts: Array, enough: float
) -> Array | None:
    """Returns a command (n, 3) that gives a normalized wrench (6,), the cheapest of those found; None where
    there is none.

    Args:
        problem: the robot.
        plant: its power.
        wrench: what is to be given.
        starts: commands (R, n, 3) to begin with.
        enough: normalized error at which no further step is taken.
    """
    found = refine(problem, wrench[None], starts, 2 * ROUNDS, enough)
    met = found.error <= NEARLY
    if not met.any():
        return None
    power = plant.power(found.command).sum(axis=-1)
    return np.asarray(found.command[np.where(met, power, np.inf).argmin()])


def prices_at(problem: CommandProblem, plant: Plant, command: Array, directions: Array) -> Array:
    """Returns the prices (r, 1) of normalized `directions` (6, r) at which a command (n, 3) would be the
    cheapest for what it gives, as near as there are: there, what a command that can change adds to the wrench
    is worth the power that it adds."""
    jacobian = problem.fin.force_and_jacobian(command[None])[1][0] @ problem.effectiveness
    low, high = problem.edges
    free = (command > low) & (command < high)
    width = problem.width[free]
    rows = width[:, None] * (jacobian[free] @ directions)
    prices: Array = np.linalg.lstsq(rows, width * plant.power_gradient(command)[free], rcond=NOTHING)[0]
    return prices[:, None]
