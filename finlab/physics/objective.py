"""What an allocation keeps least: mean power in watts, or the paper's effort `J_en`.

Both are sums over the fins of a cost of amplitude and frequency; effort adds a little for the zero direction.
"""

from dataclasses import dataclass
from typing import Literal, get_args

from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.physics.effort import EffortMeter
from finlab.physics.plant import Plant

Name = Literal["power", "effort"]


@dataclass(frozen=True)
class Objective:
    """What is kept least.

    Raises:
        AllocationError: an unknown objective.
    """

    name: Name = "power"
    """`power`: mean mechanical watts by each fin's own model. `effort`: the paper's energy proxy `J_en`."""

    def __post_init__(self) -> None:
        if self.name not in get_args(Name):
            raise AllocationError(f"objective: expected 'power' or 'effort', got {self.name!r}")

    def meter(self, plant: Plant) -> "CostMeter":
        """Returns the meter of the cost of a robot's commands."""
        if self.name == "power":
            return PowerMeter(plant)
        return EffortMeter(plant.upper)


class PowerMeter:
    """The power of one robot whose fins are all healthy, ready for many commands."""

    def __init__(self, plant: Plant) -> None:
        """Make it for the fins of a plant."""
        self._plant = plant

    def fins(self, command: Array) -> Array:
        """Power (R, n) [W] of each fin under commands (R, n, 3)."""
        return self._plant.power(command)

    def __call__(self, command: Array) -> Array:
        """Power (R,) [W] of commands (R, n, 3)."""
        total: Array = self.fins(command).sum(-1)
        return total

    def gradient(self, command: Array) -> Array:
        """Derivatives (R, n, 3) of the power by commands (R, n, 3)."""
        return self._plant.power_gradient(command)


CostMeter = PowerMeter | EffortMeter
"""Commands (R, n, 3) of one robot to costs (R,), and their slopes."""
