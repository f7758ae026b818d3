"""Body-frame controllers: measurements and a setpoint in, a wrench out. numpy only.

Any object with the shape of `Controller` plugs into `finlab.swim.simulation.ClosedLoop`.
"""

from finlab.swim.control.body_frame import CONTROLLERS as CONTROLLERS
from finlab.swim.control.body_frame import VelocityController as VelocityController
from finlab.swim.control.body_frame import WaypointController as WaypointController
from finlab.swim.control.body_frame import make_controller as make_controller
from finlab.swim.control.completion import Completion as Completion
from finlab.swim.control.completion import steerable_loss as steerable_loss
from finlab.swim.control.completion import steers as steers
from finlab.swim.control.contract import Controller as Controller
from finlab.swim.control.contract import DriveTelemetry as DriveTelemetry
from finlab.swim.control.contract import Foresighted as Foresighted
from finlab.swim.control.contract import Learner as Learner
from finlab.swim.control.contract import Measurement as Measurement
from finlab.swim.control.contract import Setpoint as Setpoint
from finlab.swim.control.fault_monitor import Diagnosis as Diagnosis
from finlab.swim.control.fault_monitor import FaultMonitor as FaultMonitor
from finlab.swim.control.fault_monitor import Finding as Finding
from finlab.swim.control.monitor_settings import MonitorSettings as MonitorSettings
from finlab.swim.control.observer import MotionObserver as MotionObserver
from finlab.swim.control.tracking_controller import TrackingController as TrackingController
from finlab.swim.control.tracking_controller import gains_for as gains_for

__all__ = [
    "CONTROLLERS",
    "Completion",
    "Controller",
    "Diagnosis",
    "DriveTelemetry",
    "FaultMonitor",
    "Finding",
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
