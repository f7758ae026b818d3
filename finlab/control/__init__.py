"""Body-frame controllers: measurements and a setpoint in, a wrench out. numpy only.

Any object with the shape of `Controller` plugs into `finlab.sim.ClosedLoop`.
"""

from finlab.control.body_frame import CONTROLLERS as CONTROLLERS
from finlab.control.body_frame import VelocityController as VelocityController
from finlab.control.body_frame import WaypointController as WaypointController
from finlab.control.body_frame import make_controller as make_controller
from finlab.control.contract import Completion as Completion
from finlab.control.contract import Controller as Controller
from finlab.control.contract import Foresighted as Foresighted
from finlab.control.contract import Learner as Learner
from finlab.control.contract import Measurement as Measurement
from finlab.control.contract import Setpoint as Setpoint
from finlab.control.contract import steerable_loss as steerable_loss
from finlab.control.contract import steers as steers
from finlab.control.fault_monitor import Diagnosis as Diagnosis
from finlab.control.fault_monitor import FaultMonitor as FaultMonitor
from finlab.control.hypotheses import MonitorSettings as MonitorSettings
from finlab.control.observer import MotionObserver as MotionObserver
from finlab.control.tracking_controller import TrackingController as TrackingController
from finlab.control.tracking_controller import gains_for as gains_for

__all__ = [
    "CONTROLLERS",
    "Completion",
    "Controller",
    "Diagnosis",
    "FaultMonitor",
    "Foresighted",
    "Learner",
    "Measurement",
    "MonitorSettings",
    "MotionObserver",
    "Setpoint",
    "TrackingController",
    "VelocityController",
    "WaypointController",
    "gains_for",
    "make_controller",
    "steerable_loss",
    "steers",
]
