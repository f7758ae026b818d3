"""What commands cost, weighed beside the squared normalized error, with slopes.

Effort is a number of its own, about one for each fin that works. Power in watts is divided by a tenth of
what the robot's strongest fin takes at full load, which is a usual load, so that one weight serves both
objectives, and weak fins as well as strong ones.
"""

import numpy as np

from finlab.arrays import Array
from finlab.physics.objective import CostMeter, Objective, PowerMeter
from finlab.physics.plant import Plant

USUAL_LOAD = 0.1
"""Share of the full load that counts as much as one unit of effort: the errors that are given up for either
are then alike (at most 4e-3 with a weight of 1e-4)."""
DIRECTIONS = 16
"""Zero directions at which a fin's full load is looked for."""


class CommandCost:
    """The weighted cost of a robot's commands."""

    def __init__(self, meter: CostMeter, weight: float) -> None:
        """Make it of the meter of the cost in its own unit."""
        self._told = meter
        self.weight = weight
        """What the cost in its own unit is multiplied by."""

    def __call__(self, command: Array) -> Array:
        """Returns costs (B,) of commands (B, n, 3)."""
        return self.weight * self._told(command)

    def gradient(self, command: Array) -> Array:
        """Returns their derivatives (B, n, 3) by the commands."""
        return self.weight * self._told.gradient(command)


def command_cost(plant: Plant, objective: Objective, sigma: Array, weight: float) -> CommandCost:
    """Returns the cost of a robot's commands, as much as it counts beside the squared normalized error.

    Where all fins together give less than one sigma, the weight falls with the square of what they give: an
    error that is large for such a robot must not look small beside its cost.

    Args:
        plant: the robot.
        objective: what is kept least.
        sigma: per-axis standard deviation (6,) of the error.
        weight: of one unit of effort, or of one usual load.
    """
    loads = _full_loads(plant)
    wrench = (plant.force(loads)[..., None, :] @ (plant.effectiveness / sigma))[..., 0, :]
    largest = np.linalg.norm(wrench, axis=-1)
    weight *= min(1.0, float((largest.max(axis=0) ** 2).sum()))
    meter = objective.meter(plant)
    if not isinstance(meter, PowerMeter):
        return CommandCost(meter, weight)
    usual = USUAL_LOAD * float(meter.fins(loads).max())
    return CommandCost(meter, weight / usual if usual > 0.0 else weight)


def _full_loads(plant: Plant) -> Array:
    """Commands (K, n, 3) with amplitude and frequency at their upper limits, or at half of them, where fins
    that saturate give more, in all directions."""
    share = np.linspace(0.0, 1.0, DIRECTIONS)
    command = np.tile(plant.upper, (2, DIRECTIONS, 1, 1))
    command[1, ..., :2] = np.maximum(0.5 * plant.upper, plant.lower)[:, :2]
    command[..., 2] = plant.lower[:, 2] + share[:, None] * plant.width[:, 2]
    return command.reshape(-1, plant.n_fins, 3)
