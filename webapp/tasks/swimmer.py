"""One robot of a swim: its record, where it is at the moment; and how fast it may go, and does."""

import math
import time
from collections import deque
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.sim import ClosedLoop
from finlab.sim.log import Tick

LAG_S = 0.25
"""What the swim may be behind the clock [s]; what is more is dropped, so that nothing piles up."""
WINDOW_S = 2.0
"""Time over which the true speed is measured [s]."""

POINTS = 300
"""Most points of a plotted line; a longer record is thinned out."""


class Pace:
    """Counts what is owed to the clock, and measures what is paid."""

    def __init__(self) -> None:
        """At real time, with nothing owed."""
        self.speed = 1.0
        """Simulated time per time on the wall that is asked for."""
        self._owed = 0.0
        self._past: deque[tuple[float, float]] = deque()

    def set_speed(self, speed: float) -> None:
        """Another speed; the true one is measured anew."""
        self.speed = speed
        self._past.clear()

    def start_anew(self) -> None:
        """The clock begins to run, or is held: nothing is owed, nothing is known of the true speed."""
        self._owed = 0.0
        self._past.clear()

    def due(self, elapsed: float, period_s: float) -> int:
        """Steps of a period [s] that are due after more time on the wall [s]."""
        self._owed = min(self._owed + elapsed * self.speed, LAG_S * max(self.speed, 1.0))
        return int(self._owed / period_s)

    def paid(self, simulated_s: float, now_s: float) -> None:
        """Some time has been simulated [s], and the swim stands at a time [s]."""
        self._owed = max(self._owed - simulated_s, 0.0)
        now = time.monotonic()
        self._past.append((now, now_s))
        while now - self._past[0][0] > WINDOW_S:
            self._past.popleft()

    @property
    def rate(self) -> float | None:
        """Simulated time per time on the wall over the last moments; None before it is known."""
        if len(self._past) < 2:
            return None
        (wall, start), (now, end) = self._past[0], self._past[-1]
        return (end - start) / (now - wall) if now - wall > 0.5 else None


class Moment(NamedTuple):
    """What the page shows of a robot."""

    time: float
    """Simulated time [s]."""
    pose: Array
    """Position (3,) and quaternion w, x, y, z (7,)."""
    motion: Array
    """What the fins do (n, 3): amplitude [rad], frequency [Hz], direction [rad]."""
    force: Array
    """Force of each fin (n, 3) in the body frame [N]."""
    asked: Array
    """Wrench (6,) that the controller asked for [N, N m]."""
    delivered: Array
    """Wrench (6,) that the fins gave."""
    reference: Array
    """Where the robot should be (3,) [m]."""
    lost: tuple[str, ...]
    """Fins that are lost."""
    failed: tuple[str, ...]
    """Those that the allocator takes for lost."""
    found: tuple[tuple[str, float], ...]
    """Those of which nobody told it, each with the time that the monitor needed to find out [s]."""
    controllable: bool
    """Whether the working fins hold surge, heave and yaw."""
    done: bool
    """Whether the task is over."""
    record: Array
    """Rows of ticks (N, 20 + 2 n); `TIME` to `FORCES` say where what is."""


TIME, ERROR, DEPTH_ERROR, POWER, SOLVE_MS = range(5)
"""Columns of a record: time [s], distance from where it should be [m], that of the depth [m], inertial power
of all fins [W], time of the allocation [ms]."""
ASKED, DELIVERED, PLACE, FORCES = 5, 11, 17, 20
"""First columns of the asked (6) and delivered (6) wrench [N, N m], the position (3) [m], and of
the force of each fin (n) [N]; then comes the probability of each fin being broken (n)."""


class Swimmer:
    """A `ClosedLoop` on the worker's thread, and the last moment taken from it for the page."""

    def __init__(self, method: str, swim: ClosedLoop) -> None:
        """Take over a swim that is at its start."""
        self.method, self.swim = method, swim
        self.fins, self.period_s = swim.layout.names, swim.period_s
        times = np.linspace(0.0, swim.task.duration_s, POINTS)
        self.path: Array = np.array([swim.task.setpoint(float(t)).position for t in times])
        """The way to go (POINTS, 3) [m]."""
        self.duration_s = swim.task.duration_s
        self.unknown_fins = swim.allocator.unknown_fins(swim.layout)
        """Fins that its method has not learned."""
        self._rows: list[Array] = []
        self._last: Tick | None = None
        self._found: dict[str, float] = {}
        self.shown = self.moment()
        """What the page shows now."""

    def step(self) -> None:
        """Swim for one control period."""
        tick = self._last = self.swim.step()
        off = tick.position - tick.reference
        power = float(tick.driving_power.sum())
        head = (tick.time, float(np.linalg.norm(off)), abs(float(off[2])), power, tick.solve_ms)
        force = np.linalg.norm(tick.fin_force, axis=1)
        suspicion = tick.fault_probability
        self._rows.append(np.concatenate([head, tick.asked, tick.delivered, tick.position, force, suspicion]))
        self._note_findings()

    def _note_findings(self) -> None:
        """When the monitor found out what nobody told; forgotten once the fin is whole or taken for it."""
        swim = self.swim
        unknown = [name for name in swim.lost if name not in swim.told]
        self._found = {
            name: self._found.get(name, swim.time - self.period_s - swim.broken[name].time_s)
            for name in unknown
            if name in swim.failed
        }

    def moment(self) -> Moment:
        """What there is to show after the last step; called on the thread that swims."""
        swim, n, last = self.swim, len(self.fins), self._last
        rows = self._rows
        thin = rows[:: max(1, math.ceil(len(rows) / POINTS))]
        return Moment(
            time=swim.time,
            pose=swim.state[:7].copy(),
            motion=swim.fins.command,
            force=np.zeros((n, 3)) if last is None else last.fin_force,
            asked=np.zeros(6) if last is None else last.asked,
            delivered=np.zeros(6) if last is None else last.delivered,
            reference=swim.task.setpoint(swim.time).position,
            lost=swim.lost,
            failed=swim.failed,
            found=tuple(self._found.items()),
            controllable=swim.controllable,
            done=swim.done,
            record=np.array(thin) if thin else np.zeros((0, FORCES + 2 * n)),
        )

    @property
    def track_error(self) -> float | None:
        """Root of the mean square distance from where it should have been so far [m]."""
        return _root_mean_square(self.shown.record[:, ERROR])

    @property
    def depth_error(self) -> float | None:
        """The same of the depth [m]."""
        return _root_mean_square(self.shown.record[:, DEPTH_ERROR])

    @property
    def power(self) -> float | None:
        """Mean inertial power of all fins so far [W]."""
        return float(self.shown.record[:, POWER].mean()) if len(self.shown.record) else None


def _root_mean_square(values: Array) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if len(values) else None
