"""A body that moves in water, after Fossen, and actuators that follow their commands.

The equations stand once, in `fossen.py`: simulation, control and fits all use them.
"""

from finlab.swim.vehicle.fossen import GRAVITY, complete_body, ucat_body
from finlab.swim.vehicle.vehicle import STATE_SIZE, Vehicle

__all__ = ["GRAVITY", "STATE_SIZE", "Vehicle", "complete_body", "ucat_body"]
