"""Simulation of a robot that swims: body, fins, sensors, and the closed loop around an allocator.

    loop = ClosedLoop(layout, finlab.load_allocator(), make_trajectory("circle"), failures=[("bow", 30.0)])
    log = loop.run()

World: z up. Body: x forward, y left, z up. SI and radians.
"""

from finlab.sim.closed_loop import ClosedLoop
from finlab.sim.fin_motion import Servo
from finlab.sim.log import RunLog, Tick, load_log
from finlab.sim.parameters import VehicleParameters, vehicle_parameters
from finlab.sim.plants import PLANTS
from finlab.sim.sensors import NO_NOISE, SensorSettings
from finlab.sim.task import Cruise, Task
from finlab.sim.trajectory import SHIPPED, Trajectory, make_trajectory
from finlab.sim.vehicle import Vehicle

__all__ = [
    "NO_NOISE",
    "PLANTS",
    "SHIPPED",
    "Cruise",
    "SensorSettings",
    "Servo",
    "ClosedLoop",
    "RunLog",
    "Task",
    "Tick",
    "Trajectory",
    "Vehicle",
    "VehicleParameters",
    "load_log",
    "make_trajectory",
    "vehicle_parameters",
]
