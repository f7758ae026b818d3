"""A robot that swims on the page: steps it at the pace of the clock, never further behind than a moment."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from finlab.allocation.allocator import Allocator
from finlab.errors import FinlabError
from finlab.layout.damage import Kind
from finlab.sim import Trajectory, Water
from webapp.session.state import State
from webapp.session.swim_plan import Plan
from webapp.tasks.background import Newest
from webapp.tasks.context import Context
from webapp.tasks.moment import Moment
from webapp.tasks.pace import Pace
from webapp.tasks.recorded import Recorded
from webapp.tasks.swimmer import Swimmer, closed_loop

BUDGET_S = 0.06
"""Longest time on the worker before the others have their turn [s]."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Some steps of a swim."""

    n_steps: int
    """How many are due."""
    swimmers: tuple[Swimmer, ...]
    """Who swims."""


class Swimming:
    """The swim of one page. All methods but `_made` and `_advance` run on the event loop."""

    def __init__(self, context: Context, changed: Callable[[], None]) -> None:
        """`changed` is called on the loop when the run has changed."""
        # An allocator of its own, for it is used on the thread that swims.
        self._solver, self._changed, self._notify = context.solver.aside, changed, context.notify
        loop, worker = context.loop, context.workers.swims
        self._start = Newest(loop, worker, self._made, self._begin)
        self._stretch = Newest(loop, worker, self._advance, self._take)
        self.swimmers: tuple[Swimmer, ...] = ()
        """The robots; none while they are being made."""
        self.running = False
        """Whether the clock runs."""
        self.pace = Pace()
        """At what speed it is to go, and goes."""
        self.at: float | None = None
        """The moment that is looked at again [s]; None for the newest one."""
        self.own_path: Trajectory | None = None
        """A path that was uploaded."""
        self._acts: deque[Callable[[Swimmer], None]] = deque()

    @property
    def active(self) -> bool:
        """Whether there is a swim, running or not."""
        return self._start.question is not None

    @property
    def busy(self) -> bool:
        """Whether it is just swimming a stretch."""
        return self._stretch.busy

    @property
    def done(self) -> bool:
        """Whether it has come to its end."""
        return bool(self.swimmers) and self.swimmers[0].shown.done

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.swimmers[0].shown.time if self.swimmers else 0.0

    def start(self, plan: Plan) -> None:
        """Begin at the beginning; a swim that is under way is given up."""
        self.stop()
        self.running = True
        self._start.ask(plan)

    def _made(self, plan: Plan) -> tuple[Swimmer, ...]:
        def allocator(method: str) -> Allocator:
            return self._solver.allocator(State(plan.layout, method=method))

        return tuple(Swimmer(method, plan, closed_loop(plan, allocator(method))) for method in plan.methods)

    def _begin(self) -> None:
        if self._start.error is not None:
            self._give_up(self._start.error)
            return
        self.swimmers = self._start.findings or ()
        self._changed()

    def _give_up(self, text: str) -> None:
        self.stop()
        self._notify("Not possible", f"the swim cannot go on: {text}")

    def stop(self) -> None:
        """Give up and forget."""
        self._start.forget()
        self._stretch.forget()
        self.swimmers, self.running, self.at = (), False, None
        self._acts.clear()
        self.pace.start_anew()

    def set_running(self, running: bool) -> None:
        """Let the clock run, or hold it."""
        self.running = running and self.active and not self.done
        self.at = None
        self.pace.start_anew()

    def step(self) -> None:
        """Hold the clock, and swim for one control period."""
        self.set_running(False)
        self._submit(1)

    def toggle(self, name: str, announced: bool = True) -> None:
        """A fin of all robots breaks, or is mended, before the next step, announced to allocators or not."""
        if not self.swimmers:
            raise FinlabError("nothing swims yet; press Start")
        lost = self.swimmers[0].shown.lost
        broken = name in lost
        if not broken and len(lost) + 1 >= len(self.swimmers[0].fins):
            raise FinlabError(f"{name} is the last fin that works; mend another one first")
        kind: Kind = "whole" if broken else "lost"
        self._act(lambda swimmer: swimmer.swim.fail(name, kind, announced=announced))

    def meet(self, water: Water, buoyancy: float) -> None:
        """Before the next step of all robots the water becomes another, and their buoyancy (a factor)."""
        if self.active:
            self._act(lambda swimmer: swimmer.meet(water, buoyancy))

    def _act(self, act: Callable[[Swimmer], None]) -> None:
        self._acts.append(act)
        self.at = None  # what happens happens now
        if not self.running:
            self._submit(0)

    def look_at(self, time: float) -> None:
        """Hold the clock, and look at an earlier moment [s]; at the newest one where it is not earlier.

        Raises:
            FinlabError: nothing has been swum yet.
        """
        self._check_swum()
        self.set_running(False)
        self.at = None if time > self.time - 0.5 * self.swimmers[0].period_s else max(0.0, time)

    @property
    def seen(self) -> tuple[Moment, ...]:
        """The moments of all robots that are looked at."""
        if self.at is None:
            return tuple(swimmer.shown for swimmer in self.swimmers)
        return tuple(swimmer.recorded().moment(self.at) for swimmer in self.swimmers)

    @property
    def seen_time(self) -> float:
        """Their time [s]."""
        return self.time if self.at is None else self.at

    def records(self) -> tuple[Recorded, ...]:
        """All robots' swims so far.

        Raises:
            FinlabError: nothing has been swum yet.
        """
        self._check_swum()
        return tuple(swimmer.recorded() for swimmer in self.swimmers)

    def _check_swum(self) -> None:
        if self.time == 0.0:
            raise FinlabError("nothing has been swum yet; press Start")

    def tick(self, elapsed: float) -> None:
        """Time has passed on the wall [s]; swim that far, if the last stretch is done."""
        if not self.running or not self.swimmers:
            return
        n_steps = self.pace.due(elapsed, self.swimmers[0].period_s)
        if n_steps:
            self._submit(n_steps)

    def _submit(self, n_steps: int) -> None:
        if self.swimmers and not self._stretch.busy:
            self._stretch.ask(Stretch(n_steps, self.swimmers))

    def _advance(self, stretch: Stretch) -> tuple[int, tuple[Moment, ...]]:
        """On the worker's thread: some steps, but no longer than the others can wait."""
        end, done, swimmers = time.monotonic() + BUDGET_S, 0, stretch.swimmers
        while self._acts:
            act = self._acts.popleft()
            for swimmer in swimmers:
                act(swimmer)
        while done < stretch.n_steps and not swimmers[0].swim.done:
            for swimmer in swimmers:
                swimmer.step()
            done += 1
            if time.monotonic() > end:
                break
        return done, tuple(swimmer.moment() for swimmer in swimmers)

    def _take(self) -> None:
        if self._stretch.findings is None:
            self._give_up(self._stretch.error or "")
            return
        done, moments = self._stretch.findings
        for swimmer, moment in zip(self.swimmers, moments, strict=True):
            swimmer.shown = moment
        self.pace.paid(done * self.swimmers[0].period_s, self.time)
        if self.done:
            self.running = False
        self._changed()
