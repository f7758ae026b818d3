"""One robot of a swim: its closed loop, its record, and its moment as the page shows it."""

import math
from dataclasses import fields
from typing import NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.swim.control import FaultMonitor, make_controller
from finlab.swim.simulation import ClosedLoop, RunLog, Tick
from finlab.swim.simulation.log import lies_over, log_of_ticks
from webapp.session.swim_plan import Plan

POINTS = 300
"""Most points of a plotted line; a longer record is thinned out."""
NOW = 10
"""Periods of which the present power is the mean: it jumps with every beat."""

TIME = 0
"""Column of a record: time [s]."""
ERROR = 1
"""Column of a record: distance from the reference [m]."""
DEPTH_ERROR = 2
"""Column of a record: distance from the depth of the reference [m]."""
POWER = 3
"""Column of a record: driving power of all fins with motor losses [W]."""
SURGE = 4
"""First of two columns of a record: surge force, asked and delivered [N]."""
PLACE = 6
"""First of three columns of a record: position [m]."""
FORCES = 9
"""First of n columns of a record: force of each fin [N]; after them come n probabilities that a fin
is broken."""


class Figures(NamedTuple):
    """What a swim has come to so far."""

    track_m: float
    """Root mean square distance from where it should have been [m]."""
    depth_m: float
    """The same of the depth [m]."""
    mean_w: float
    """Mean driving power of all fins with motor losses [W]."""
    now_w: float
    """The same over the last second [W]."""
    energy_wh: float
    """Energy of that so far [Wh]."""


class Moment(NamedTuple):
    """What the page shows of a robot."""

    time: float
    pose: Array
    """Position (3,) and quaternion w, x, y, z (7,)."""
    motion: Array
    """What the fins do (n, 3): amplitude [rad], frequency [Hz], direction [rad]."""
    angle: Array
    """Angle of each blade (n,) [rad]."""
    force: Array
    """Force of each fin (n, 3) in the body frame [N]."""
    asked: Array
    """Wrench (6,) that the controller asked for [N, N m]."""
    delivered: Array
    """Wrench (6,) that the fins gave."""
    reference: Array
    """Where the robot should be (3,) [m]."""
    flow: Array
    """Velocity of the water where it is (3,), in the world [m/s]."""
    lost: tuple[str, ...]
    """Actuators that are lost, known or not."""
    believed_lost: tuple[str, ...]
    """Those that the allocator takes for lost."""
    found: tuple[tuple[str, float], ...]
    """Unannounced losses that the monitor has detected, each with the time that it took [s]."""
    doubted: tuple[str, ...]
    """Those that the monitor takes for broken in some way, more likely than not."""
    controllable: bool
    capsized: float | None
    """When it first lay on its side or stood on its end [s]; None where it never did."""
    done: bool
    figures: Figures | None
    """What the swim has come to; None before the first step."""
    record: Array
    """Rows of ticks (N, 9 + 2 n), thinned out; `TIME` to `FORCES` say where what is."""


def row_of(tick: Tick) -> Array:
    """The row of a tick in a record."""
    deviation = tick.position - tick.reference
    head = (
        tick.time,
        float(np.linalg.norm(deviation)),
        abs(float(deviation[2])),
        float(tick.driving_power.sum()),
        tick.asked[0],
        tick.delivered[0],
    )
    force = np.linalg.norm(tick.force, axis=1)
    return np.concatenate([head, tick.position, force, tick.fault_probability])


def figures_of(rows: Array, period_s: float) -> Figures | None:
    """What a whole record (N, ...) with a row per period [s] comes to; None where it has no
    rows."""
    if not len(rows):
        return None
    power = rows[:, POWER]
    duration = len(rows) * period_s
    return Figures(
        track_m=float(np.sqrt(np.mean(rows[:, ERROR] ** 2))),
        depth_m=float(np.sqrt(np.mean(rows[:, DEPTH_ERROR] ** 2))),
        mean_w=float(power.mean()),
        now_w=float(power[-NOW:].mean()),
        energy_wh=float(power.mean()) * duration / 3600.0,
    )


class Swimmer:
    """A `ClosedLoop` on the worker's thread, and the last moment taken from it for the page."""

    def __init__(self, plan: Plan, swim: ClosedLoop) -> None:
        """Take over a swim that is at its start."""
        self.method = plan.method
        self.swim = swim
        self._plan = plan
        self.layout = swim.layout
        self.fins = swim.layout.names
        self.period_s = swim.period_s
        times = np.linspace(0.0, swim.task.duration_s, POINTS)
        self.path: Array = np.array([swim.task.setpoint(float(t)).position for t in times])
        """The way to go (POINTS, 3) [m]."""
        self.duration_s = swim.task.duration_s
        self.unknown_fins = swim.allocator.unknown_fins
        """Fins that its method has not learned."""
        self._rows: list[Array] = []
        self._ticks: list[Tick] = []
        self._found: dict[str, float] = {}
        self._capsized: float | None = None
        start = swim.log
        self._about = {
            f.name: getattr(start, f.name) for f in fields(RunLog) if f.name != "columns"
        }
        self.visible_moment = self.moment()

    @property
    def about(self) -> str:
        """The scenario."""
        return self._plan.day.name

    def step(self) -> None:
        """Swim for one control period."""
        tick = self.swim.step()
        self._rows.append(row_of(tick))
        self._ticks.append(tick)
        if self._capsized is None and lies_over(tick.quaternion):
            self._capsized = tick.time
        self._note_findings()

    def _note_findings(self) -> None:
        """When the monitor detected an unannounced loss; forgotten once the fin is whole or taken
        for it."""
        swim = self.swim
        unknown = [name for name in swim.lost if name not in swim.told]
        self._found = {
            name: self._found.get(name, swim.time - self.period_s - swim.broken[name].time_s)
            for name in unknown
            if name in swim.damage.lost
        }

    def log(self) -> RunLog:
        """All so far; called on the page's thread, after the first step."""
        return log_of_ticks(self._ticks.copy(), **self._about)  # while another thread may swim on

    def moment(self) -> Moment:
        """What there is to show after the last step; called on the thread that swims."""
        swim = self.swim
        n = len(self.fins)
        last = self._ticks[-1] if self._ticks else None
        chances = np.zeros(n) if last is None else last.fault_probability
        rows = np.array(self._rows) if self._rows else np.zeros((0, FORCES + 2 * n))
        return Moment(
            time=swim.time,
            pose=swim.state[:7].copy(),
            motion=swim.motion.command,
            angle=swim.fin_motion.angle,
            force=np.zeros((n, 3)) if last is None else last.force,
            asked=np.zeros(6) if last is None else last.asked,
            delivered=np.zeros(6) if last is None else last.delivered,
            reference=swim.task.setpoint(swim.time).position,
            flow=np.array(swim.vehicle.current),
            lost=swim.lost,
            believed_lost=tuple(swim.damage.lost),
            found=tuple(self._found.items()),
            doubted=tuple(
                name for name, chance in zip(self.fins, chances, strict=True) if chance > 0.5
            ),
            controllable=swim.controllable,
            capsized=self._capsized,
            done=swim.done,
            figures=figures_of(rows, self.period_s),
            record=rows[:: max(1, math.ceil(len(rows) / POINTS))],
        )


def closed_loop(plan: Plan, allocator: Allocator) -> ClosedLoop:
    """The swim of a plan with an allocator, at its start."""
    layout = plan.layout
    day = plan.day
    swim = ClosedLoop(
        layout,
        allocator,
        plan.path,
        make_controller(plan.controller, layout),
        sensors=day.sensors,
        current=day.current,
        failures=plan.losses,
        announced=plan.announced,
        monitor=FaultMonitor(layout),
        truth=day.true(layout),
    )
    for name in plan.lost:
        swim.fail(name, announced=True)
    for name in plan.weak:
        swim.fail(name, "torn", day.weak or 0.0, announced=False)
    return swim
