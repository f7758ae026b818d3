"""Body-frame controllers: measurements and a setpoint in, a wrench out. numpy only.

Any object with the shape of `Controller` plugs into `finlab.sim.ClosedLoop`.
"""

from finlab.control.completion import Completion
from finlab.control.controller import Controller, Measurement, Setpoint
from finlab.control.gains import WAYPOINT_GAINS, VelocityGains, WaypointGains, load_gains
from finlab.control.velocity import VelocityController
from finlab.control.waypoint import WaypointController

__all__ = [
    "WAYPOINT_GAINS",
    "Completion",
    "Controller",
    "Measurement",
    "Setpoint",
    "VelocityController",
    "VelocityGains",
    "WaypointController",
    "WaypointGains",
    "load_gains",
]
