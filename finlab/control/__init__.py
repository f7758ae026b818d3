"""Body-frame controllers: measurements and a setpoint in, a wrench out. numpy only.

Any object with the shape of `Controller` plugs into `finlab.sim.ClosedLoop`.
"""

from finlab.control.completion import Completion as Completion
from finlab.control.controller import Controller as Controller
from finlab.control.controller import Measurement as Measurement
from finlab.control.controller import Setpoint as Setpoint
from finlab.control.gains import WAYPOINT_GAINS as WAYPOINT_GAINS
from finlab.control.gains import VelocityGains as VelocityGains
from finlab.control.gains import WaypointGains as WaypointGains
from finlab.control.gains import load_gains as load_gains
from finlab.control.velocity import VelocityController as VelocityController
from finlab.control.waypoint import WaypointController as WaypointController
