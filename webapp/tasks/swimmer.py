"""One robot of a swim: its closed loop, its record, where it is at the moment."""

import math
from dataclasses import fields

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.control import FaultMonitor, make_controller
from finlab.sim import ClosedLoop, RunLog, Tick, perturbed
from finlab.sim.log import lies_over, log_of_ticks
from webapp.session.swim_plan import Plan
from webapp.tasks.moment import FORCES, POINTS, Moment, figures_of, row_of


class Swimmer:
    """A `ClosedLoop` on the worker's thread, and the last moment taken from it for the page."""

    def __init__(self, plan: Plan, swim: ClosedLoop) -> None:
        """Take over a swim that is at its start."""
        self.method, self.swim, self._plan = plan.method, swim, plan
        self.layout, self.fins, self.period_s = swim.layout, swim.layout.names, swim.period_s
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
        self._about = {f.name: getattr(start, f.name) for f in fields(RunLog) if f.name != "columns"}
        self.shown = self.moment()

    @property
    def about(self) -> str:
        """The scenario."""
        return self._plan.scenario

    def step(self) -> None:
        """Swim for one control period."""
        tick = self.swim.step()
        self._rows.append(row_of(tick))
        self._ticks.append(tick)
        if self._capsized is None and lies_over(tick.quaternion):
            self._capsized = tick.time
        self._note_findings()

    def _note_findings(self) -> None:
        """When the monitor detected an unannounced loss; forgotten once the fin is whole or taken for it."""
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
        swim, n = self.swim, len(self.fins)
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
            failed=tuple(swim.damage.lost),
            found=tuple(self._found.items()),
            doubted=tuple(name for name, chance in zip(self.fins, chances, strict=True) if chance > 0.5),
            controllable=swim.controllable,
            capsized=self._capsized,
            done=swim.done,
            figures=figures_of(rows, self.period_s),
            record=rows[:: max(1, math.ceil(len(rows) / POINTS))],
        )


def closed_loop(plan: Plan, allocator: Allocator) -> ClosedLoop:
    """The swim of a plan with an allocator, at its start."""
    layout = plan.layout
    swim = ClosedLoop(
        layout,
        allocator,
        plan.path,
        make_controller(plan.controller, layout),
        sensors=plan.sensors,
        current=plan.current,
        failures=plan.losses,
        announced=plan.announced,
        monitor=FaultMonitor(layout),
        truth=perturbed(layout, **plan.truth),
    )
    for name in plan.failed:
        swim.fail(name, announced=True)
    for name in plan.weak:
        swim.fail(name, "torn", plan.share, announced=False)
    return swim
