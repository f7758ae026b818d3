"""A body that moves in water, after Fossen, and actuators that follow their commands.

The equations stand once, in `fossen.py`: simulation, control and fits all use them.
"""

from finlab.vehicle.actuator_motion import ActuatorMotion
from finlab.vehicle.body import GRAVITY, complete_body, ucat_body
from finlab.vehicle.fin_lag import FinLag
from finlab.vehicle.fin_motion import FinMotion
from finlab.vehicle.fossen import Dynamics
from finlab.vehicle.vehicle import STATE_SIZE, Vehicle

__all__ = [
    "GRAVITY",
    "STATE_SIZE",
    "ActuatorMotion",
    "Dynamics",
    "FinLag",
    "FinMotion",
    "Vehicle",
    "complete_body",
    "ucat_body",
]
