"""What commands cost, weighed beside the squared normalized error, with slopes and a convex quadratic model.

Effort is a number of its own, about one for each fin that works. Power in watts is divided by a tenth of
what the robot's strongest fin takes at full load, which is a usual load, so that one weight serves both
objectives, and weak fins as well as strong ones.
"""

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.physics.energy import EnergyMeter, energy_scale
from finlab.physics.objective import CostMeter, Objective, PowerMeter
from finlab.physics.plant import Plant

BEND = 0.4
"""Half the curvature of a cost, over its squared slope divided by it: that of s^5, as power grows with the
size s of a stroke."""
USUAL_LOAD = 0.1
"""Share of the full load that counts as much as one unit of effort: the errors that are given up for either
are then alike (at most 4e-3 with a weight of 1e-4)."""
DIRECTIONS = 16
"""Zero directions at which a fin's full load is looked for."""


class Bowl(NamedTuple):
    """A convex quadratic that touches the costs of B commands; halves of its derivatives by the commands."""

    slope: Array
    """Half the gradient (B, n, 3)."""
    diagonal: Array
    """Half the second derivatives by each command alone (B, n, 3)."""
    mixed: Array
    """Half those by amplitude and frequency (B, n)."""

    def in_units(self, unit: Array) -> "Bowl":
        """Returns the same by commands counted in units (n, 3), such as the ranges of their limits."""
        return Bowl(self.slope * unit, self.diagonal * unit**2, self.mixed * (unit[:, 0] * unit[:, 1]))


class CommandCost(ABC):
    """The weighted cost of a robot's commands."""

    def __init__(self, meter: CostMeter, weight: float) -> None:
        """Make it of the meter of the cost in its own unit."""
        self._told = meter
        self.weight = weight
        """What the cost in its own unit is multiplied by."""

    def __call__(self, command: Array) -> Array:
        """Returns costs (B,) of commands (B, n, 3)."""
        return self.weight * self._told(command)

    def slopes(self, command: Array) -> Array:
        """Returns their derivatives (B, n, 3) by the commands."""
        return self.weight * self._told.slopes(command)

    @abstractmethod
    def bowl(self, command: Array) -> Bowl:
        """Returns a quadratic that stands for the cost near the commands."""


class EffortCost(CommandCost):
    """The paper's effort `J_en`: all of it but the inertial part is a quadratic form itself."""

    def __init__(self, meter: EnergyMeter, weight: float) -> None:
        super().__init__(meter, weight)
        scale, weights = energy_scale(meter.upper), meter.weights
        squares = np.array([weights.amplitude, weights.frequency, weights.zero_direction])
        self._scale, self._inertial = scale, weight * weights.inertial
        self._diagonal = weight * squares / scale**2
        self._mixed = 0.5 * weight * weights.product / (scale[:, 0] * scale[:, 1])

    def bowl(self, command: Array) -> Bowl:
        """See `CommandCost`."""
        diagonal = np.broadcast_to(self._diagonal, command.shape)
        mixed = np.broadcast_to(self._mixed, command.shape[:-1])
        if self._inertial:
            scale, inertial = self._scale, self._inertial
            a, f = command[..., 0] / scale[:, 0], command[..., 1] / scale[:, 1]
            bend = BEND * inertial * np.stack([4.0 * f**3, 9.0 * a * a * f, np.zeros_like(a)], axis=-1)
            diagonal = diagonal + bend / scale**2
            mixed = mixed + 6.0 * BEND * inertial * a * f * f / (scale[:, 0] * scale[:, 1])
        return Bowl(0.5 * self.slopes(command), diagonal, mixed)


class PowerCost(CommandCost):
    """Mean mechanical power by each fin's own model."""

    def __init__(self, meter: PowerMeter, weight: float) -> None:
        super().__init__(meter, weight)
        self._meter = meter

    def bowl(self, command: Array) -> Bowl:
        """See `CommandCost`."""
        power, slopes = self._meter.fins(command), self.slopes(command)
        bend = BEND / np.maximum(self.weight * power, 1e-12 * self.weight)
        diagonal = bend[..., None] * slopes * slopes
        return Bowl(0.5 * slopes, diagonal, bend * slopes[..., 0] * slopes[..., 1])


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
    largest = np.linalg.norm((plant.force(loads)[..., None, :] @ (plant.columns / sigma))[..., 0, :], axis=-1)
    weight *= min(1.0, float((largest.max(axis=0) ** 2).sum()))
    meter = objective.meter(plant)
    if isinstance(meter, EnergyMeter):
        return EffortCost(meter, weight)
    usual = USUAL_LOAD * float(meter.fins(loads).max())
    return PowerCost(meter, weight / usual if usual > 0.0 else weight)


def _full_loads(plant: Plant) -> Array:
    """Commands (K, n, 3) with amplitude and frequency at their upper limits, or at half of them, where fins
    that saturate give more, in all directions."""
    share = np.linspace(0.0, 1.0, DIRECTIONS)
    command = np.tile(plant.upper, (2, DIRECTIONS, 1, 1))
    command[1, ..., :2] = np.maximum(0.5 * plant.upper, plant.lower)[:, :2]
    command[..., 2] = plant.lower[:, 2] + share[:, None] * plant.width[:, 2]
    return command.reshape(-1, plant.n_fins, 3)
