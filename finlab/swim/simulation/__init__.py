"""Simulation of a robot that swims: body, fins, sensors, and the closed loop around an allocator.

    loop = ClosedLoop(layout, finlab.Allocator(layout), make_trajectory("circle"), failures=[("bow",
    30.0)]) log = loop.run()

World: z up. Body: x forward, y left, z up. SI and radians.
"""

from finlab.swim.simulation.closed_loop import ClosedLoop as ClosedLoop
from finlab.swim.simulation.devices import NO_NOISE as NO_NOISE
from finlab.swim.simulation.devices import NOISE_ALONE as NOISE_ALONE
from finlab.swim.simulation.devices import SensorSettings as SensorSettings
from finlab.swim.simulation.log import RunLog as RunLog
from finlab.swim.simulation.log import Tick as Tick
from finlab.swim.simulation.log import load_log as load_log
from finlab.swim.simulation.task import SHIPPED as SHIPPED
from finlab.swim.simulation.task import Trajectory as Trajectory
from finlab.swim.simulation.task import make_trajectory as make_trajectory
from finlab.swim.simulation.task import straight as straight
from finlab.swim.simulation.truth import Fault as Fault
from finlab.swim.simulation.truth import perturbed as perturbed

__all__ = [
    "NOISE_ALONE",
    "NO_NOISE",
    "SHIPPED",
    "ClosedLoop",
    "Fault",
    "RunLog",
    "SensorSettings",
    "Tick",
    "Trajectory",
    "load_log",
    "make_trajectory",
    "perturbed",
    "straight",
]
