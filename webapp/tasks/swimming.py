"""A robot that swims on the page: steps it at the pace of the clock, never further behind than a
moment."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from finlab.errors import FinlabError
from finlab.layout.damage import FaultKind
from finlab.swim.simulation import RunLog
from webapp.session.state import State
from webapp.session.swim_plan import Plan
from webapp.tasks.context import Context
from webapp.tasks.slot import Slot
from webapp.tasks.solver import Solver
from webapp.tasks.swimmer import Moment, Swimmer, closed_loop

LAG_S = 0.25
"""What the swim may be behind the clock [s]; what is more is dropped, so that nothing piles up."""
WINDOW_S = 2.0
"""Time over which the true speed is measured [s]."""
BUDGET_S = 0.06
"""Longest time on the worker before the others have their turn [s]."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Some steps of a swim."""

    n_steps: int
    swimmer: Swimmer
    actions: tuple[Callable[[Swimmer], None], ...] = ()
    """What is done to the robot before them, such as a loss."""


class Swimming(Slot["Plan | Stretch", "Swimmer | tuple[int, Moment]"]):
    """The swim of one page: its start, then one stretch after the other."""

    def __init__(self, context: Context) -> None:
        # An allocator of its own, for it is used on the thread that swims.
        solve = partial(swim_on, context.solver.for_other_thread)
        super().__init__(context.pools.swims, context.bell, solve)
        self.swimmer: Swimmer | None = None
        """The robot; None while it is being made."""
        self.active = False
        """Whether there is a swim, running or not."""
        self.running = False
        self.pace = Pace()
        self._actions: list[Callable[[Swimmer], None]] = []

    @property
    def done(self) -> bool:
        """Whether it has come to its end."""
        return self.swimmer is not None and self.swimmer.visible_moment.done

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.swimmer.visible_moment.time if self.swimmer is not None else 0.0

    def start(self, plan: Plan) -> None:
        """Begin at the beginning; a swim that is under way is given up."""
        self.halt()
        self.running = self.active = True
        self.ask(plan)

    def attend(self) -> bool:
        """Take the robot, or what it has swum. FinlabError: it cannot go on."""
        was_busy = self.busy
        came = super().attend()
        if not was_busy or self.busy:
            return came
        if isinstance(self.answer, Swimmer):
            self.swimmer = self.answer
        elif self.answer is not None and self.swimmer is not None:
            done, self.swimmer.visible_moment = self.answer
            self.pace.paid(done * self.swimmer.period_s, self.time)
            self.running = self.running and not self.done
            if self._actions and not self.running:
                self._submit(0)
        else:
            error = self.error
            self.halt()
            raise FinlabError(f"the swim cannot go on: {error}")
        return True

    def halt(self) -> None:
        """Give up and forget."""
        self.forget()
        self.swimmer = None
        self.running = False
        self.active = False
        self._actions.clear()
        self.pace.start_anew()

    def set_running(self, running: bool) -> None:
        """Let the clock run, or hold it."""
        self.running = running and self.active and not self.done
        self.pace.start_anew()

    def step(self) -> None:
        """Hold the clock, and swim for one control period."""
        self.set_running(False)
        self._submit(1)

    def toggle(self, name: str, announced: bool = True) -> None:
        """A fin breaks, or is mended, before the next step, announced to the allocator or not."""
        if self.swimmer is None:
            raise FinlabError("nothing swims yet; press Start")
        lost = self.swimmer.visible_moment.lost
        broken = name in lost
        if not broken and len(lost) + 1 >= len(self.swimmer.fins):
            raise FinlabError(f"{name} is the last fin that works; mend another one first")
        kind: FaultKind = "whole" if broken else "lost"
        self._actions.append(lambda swimmer: swimmer.swim.fail(name, kind, announced=announced))
        if not self.running:
            self._submit(0)

    def log(self) -> RunLog:
        """The swim so far. Raises FinlabError: nothing has been swum yet."""
        if self.swimmer is None or self.time == 0.0:
            raise FinlabError("nothing has been swum yet; press Start")
        return self.swimmer.log()

    def tick(self, elapsed: float) -> None:
        """Time has passed on the wall [s]; swim that far, if the last stretch is done."""
        if not self.running or self.swimmer is None:
            return
        n_steps = self.pace.due(elapsed, self.swimmer.period_s)
        if n_steps:
            self._submit(n_steps)

    def _submit(self, n_steps: int) -> None:
        if self.swimmer is not None and not self.busy:
            actions = tuple(self._actions)
            self._actions = []
            self.ask(Stretch(n_steps, self.swimmer, actions))


def swim_on(solver: Solver, question: "Plan | Stretch") -> "Swimmer | tuple[int, Moment]":
    """A robot at its start; or some steps of one, as many as the others can wait for, and its
    moment then."""
    if isinstance(question, Plan):
        allocator = solver.allocator(State(question.layout, method=question.method))
        return Swimmer(question, closed_loop(question, allocator))
    end = time.monotonic() + BUDGET_S
    done = 0
    swimmer = question.swimmer
    for action in question.actions:
        action(swimmer)
    while done < question.n_steps and not swimmer.swim.done:
        swimmer.step()
        done += 1
        if time.monotonic() > end:
            break
    return done, swimmer.moment()


class Pace:
    """Counts what is owed to the clock, and measures what is paid."""

    def __init__(self) -> None:
        self.speed = 1.0
        """Simulated time per time on the wall that is asked for."""
        self._owed = 0.0
        self._past: deque[tuple[float, float]] = deque()

    def set_speed(self, speed: float) -> None:
        """Another speed; the true one is measured again."""
        self.speed = speed
        self._past.clear()

    def start_anew(self) -> None:
        """The clock begins to run, or is held: nothing is owed, nothing is known of the true
        speed."""
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
        wall, start = self._past[0]
        now, end = self._past[-1]
        return (end - start) / (now - wall) if now - wall > 0.5 else None
