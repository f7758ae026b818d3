"""A robot that swims on the page: steps it at the pace of the clock, never further behind than a moment."""

import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial

from finlab.errors import FinlabError
from finlab.sim import ClosedLoop, make_trajectory
from webapp.session.state import State
from webapp.session.swim_plan import Plan
from webapp.tasks.pace import Pace
from webapp.tasks.solver import Solver
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.worker import Worker

BUDGET_S = 0.06
"""Longest time on the worker before the others have their turn [s]."""


class Swimming:
    """The swim of one page. All methods but `_advance` run on the event loop."""

    def __init__(
        self,
        solver: Solver,
        worker: Worker,
        post: Callable[[Callable[[], object]], None],
        changed: Callable[[], None],
        failed: Callable[[str], None],
    ) -> None:
        """Prepare.

        Args:
            solver: whose allocators are used, on the worker's thread alone.
            worker: whose thread swims.
            post: brings a call to the event loop.
            changed: called there when the state of the run has changed.
            failed: called there with a sentence when it cannot go on.
        """
        self._solver, self._worker, self._post = solver, worker, post
        self._changed, self._failed = changed, failed
        self.plan: Plan | None = None
        """What is being swum, None while nothing is."""
        self.swimmers: tuple[Swimmer, ...] = ()
        """The robots; none while they are being made."""
        self.running = False
        """Whether the clock runs."""
        self.pace = Pace()
        """At what speed it is to go, and goes."""
        self._busy = False
        self._stop = threading.Event()
        self._acts: deque[Callable[[ClosedLoop], None]] = deque()

    @property
    def active(self) -> bool:
        """Whether there is a swim, running or not."""
        return self.plan is not None

    @property
    def done(self) -> bool:
        """Whether it has come to its end."""
        return bool(self.swimmers) and self.swimmers[0].done

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.swimmers[0].time if self.swimmers else 0.0

    def start(self, plan: Plan) -> None:
        """Begin at the beginning; a swim that is under way is given up."""
        self.stop()
        self.plan, self.running, self._busy = plan, True, True
        stop = self._stop

        def job() -> None:
            swimmers = tuple(self._swimmer(plan, method) for method in plan.methods)
            self._post(partial(self._begin, stop, swimmers))

        self._worker.submit(id(self), job, partial(self._fault, stop))

    def _swimmer(self, plan: Plan, method: str) -> Swimmer:
        path = make_trajectory(plan.path) if isinstance(plan.path, str) else plan.path
        allocator = self._solver.allocator(State(plan.layout, method=method))
        failures = [(name, 0.0) for name in plan.failed]
        return Swimmer(method, ClosedLoop(plan.layout, allocator, path, plant=plan.plant, failures=failures))

    def _begin(self, stop: threading.Event, swimmers: tuple[Swimmer, ...]) -> None:
        if stop is self._stop:
            self.swimmers, self._busy = swimmers, False
            self._changed()

    def _fault(self, stop: threading.Event, text: str) -> None:
        """On the worker's thread: it cannot go on."""
        self._post(partial(self._give_up, stop, f"the swim cannot go on: {text}"))

    def _give_up(self, stop: threading.Event, text: str) -> None:
        if stop is self._stop:
            self.stop()
            self._failed(text)

    def stop(self) -> None:
        """Give up and forget."""
        self._stop.set()
        self._stop = threading.Event()  # what is still under way belongs to the old one
        self._worker.forget(id(self))
        self.plan, self.swimmers, self.running = None, (), False
        self._busy = False
        self._acts.clear()
        self.pace.start_anew()

    def set_running(self, running: bool) -> None:
        """Let the clock run, or hold it."""
        self.running = running and self.active and not self.done
        self.pace.start_anew()

    def step(self) -> None:
        """Hold the clock, and swim for one control period."""
        self.set_running(False)
        self._submit(1)

    def toggle(self, name: str) -> None:
        """A fin of all robots breaks, or is mended, before the next step."""
        if not self.swimmers:
            raise FinlabError("nothing swims yet; press Start")
        swim = self.swimmers[0]
        broken = name in swim.failed
        if not broken and len(swim.failed) + 1 >= len(swim.fins):
            raise FinlabError(f"{name} is the last fin that works; mend another one first")
        self._acts.append(lambda swim: swim.mend(name) if broken else swim.fail(name))
        if not self.running:
            self._submit(0)

    def tick(self, elapsed: float) -> None:
        """Time has passed on the wall [s]; swim that far, if the last stretch is done."""
        if not self.running or not self.swimmers:
            return
        n_steps = self.pace.due(elapsed, self.swimmers[0].period_s)
        if n_steps:
            self._submit(n_steps)

    def _submit(self, n_steps: int) -> None:
        if self._busy or not self.swimmers:
            return
        self._busy = True
        stop = self._stop
        self._worker.submit(
            id(self), partial(self._advance, n_steps, stop, self.swimmers), partial(self._fault, stop)
        )

    def _advance(self, n_steps: int, stop: threading.Event, swimmers: tuple[Swimmer, ...]) -> None:
        """On the worker's thread: some steps, but no longer than the others can wait."""
        end, done = time.monotonic() + BUDGET_S, 0
        while self._acts and not stop.is_set():
            act = self._acts.popleft()
            for swimmer in swimmers:
                act(swimmer.swim)
        while done < n_steps and not swimmers[0].swim.done and not stop.is_set():
            for swimmer in swimmers:
                swimmer.step()
            done += 1
            if time.monotonic() > end:
                break
        moments = tuple(swimmer.moment() for swimmer in swimmers)
        self._post(partial(self._take, stop, done, moments))

    def _take(self, stop: threading.Event, done: int, moments: tuple) -> None:
        if stop is not self._stop:
            return
        self._busy = False
        for swimmer, moment in zip(self.swimmers, moments, strict=True):
            swimmer.take(moment)
        self.pace.paid(done * self.swimmers[0].period_s, self.time)
        if self.done:
            self.running = False
        self._changed()
