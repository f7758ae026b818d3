"""A body that moves in water, after Fossen, and actuators that follow their commands.

The equations are in `fossen.py`, where fits and the monitor's model take them from. One body in
simulation, and how fins and other actuators follow their commands, are computed by the core.
"""

from finlab.swim.vehicle.fossen import GRAVITY, complete_body, ucat_body
from finlab.swim.vehicle.vehicle import STATE_SIZE, Vehicle

__all__ = ["GRAVITY", "STATE_SIZE", "Vehicle", "complete_body", "ucat_body"]
