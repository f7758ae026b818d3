"""What an allocation keeps least: mean power in watts, or the paper's effort `J_en`.

Both are sums over the fins of a cost of amplitude and frequency; effort adds a little for the zero direction.
"""

from typing import Literal

from finlab.arrays import Array
from finlab.physics.effort import EffortMeter
from finlab.physics.plant import Plant

Name = Literal["power", "effort"]
"""`power`: mean mechanical watts by each fin's own model. `effort`: the paper's energy proxy `J_en`."""


class PowerMeter:
    """The power of one robot whose fins are all healthy, ready for many commands."""

    def __init__(self, plant: Plant) -> None:
        """Make it for the fins of a plant."""
        self._plant = plant

    def __call__(self, command: Array) -> Array:
        """Power (R,) [W] of commands (R, n, 3)."""
        total: Array = self._plant.power(command).sum(-1)
        return total

    def gradient(self, command: Array) -> Array:
        """Derivatives (R, n, 3) of the power by commands (R, n, 3)."""
        return self._plant.power_gradient(command)


CostMeter = PowerMeter | EffortMeter
"""Commands (R, n, 3) of one robot to costs (R,), and their slopes."""


def cost_meter(objective: Name, plant: Plant) -> CostMeter:
    """Returns the meter of what the commands of a robot cost."""
    return PowerMeter(plant) if objective == "power" else EffortMeter(plant.upper)
