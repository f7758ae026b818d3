"""The way to the answer that is shown, step by step: played once, then any step again."""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.errors import AllocationError, FinlabError
from webapp.tasks.background import Newest
from webapp.tasks.context import Context
from webapp.tasks.solver import Reply, Solver

STEP_S = 0.9
"""How long each step is shown [s]."""


@dataclass(frozen=True, eq=False)
class Shown:
    """What is on the robot, and of which answer it is."""

    reply: Reply
    """The answer with all that belongs to it."""
    place: tuple[int, int | None]
    """Which mode, and which sample, of a session."""
    end: Allocation
    """What is on the robot."""
    name: str
    """What people call it."""


class Step(NamedTuple):
    """One step of a way."""

    name: str
    """What it is called."""
    answer: Allocation
    """What the fins do in it, by their own laws."""


class Way(NamedTuple):
    """How an answer came about."""

    start: str
    """Where it began."""
    steps: tuple[Step, ...]
    """All steps, the answer last."""


def way_to(solver: Solver, shown: Shown) -> Way:
    """How what is shown of an answer came about.

    Raises:
        AllocationError: the method does not tell.
    """
    allocator, answer = solver.allocator(shown.reply.state), shown.reply.answer
    layout = answer.layout.without(answer.failed) if answer.failed else answer.layout
    alive = np.isfinite(answer.command[:, 0])
    path = allocator.path(layout, answer.target, shown.end.command[alive], answer.policy, answer.seed)
    if path is None:
        raise AllocationError(f"method {allocator.name!r} does not tell how it came to this; use 'search'")
    command = np.full((len(path.names), *answer.command.shape), np.nan)
    command[:, alive] = path.command
    found = (answer.with_command(each) for each in command[:-1])
    return Way(path.start, (*map(Step, path.names, found), Step(shown.name, shown.end)))


class Refinement:
    """The way to what is shown, and the step of it that is on the robot."""

    def __init__(self, context: Context) -> None:
        """Nothing is played yet."""
        self._loop, self._changed, self._notify = context.loop, context.changed, context.notify
        self._found = Newest(
            context.loop, context.workers.answers, partial(way_to, context.solver), self._take
        )
        self._turn = object()
        self.at: int | None = None
        """Which step is on the robot; None while the answer itself is."""

    @property
    def of(self) -> Shown | None:
        """What the way that is known leads to."""
        return self._found.answered

    @property
    def way(self) -> Way | None:
        """The way itself, None while none is known."""
        return self._found.findings

    @property
    def step(self) -> Step | None:
        """The step on the robot, None while the answer itself is there."""
        return None if self.way is None or self.at is None else self.way.steps[self.at]

    def play(self, shown: Shown) -> None:
        """Find the way to what is shown, and show its steps one after the other."""
        self.forget()
        self._found.ask(shown)

    def show(self, index: int) -> None:
        """Leave one step on the robot.

        Raises:
            FinlabError: there is no such step.
        """
        count = 0 if self.way is None else len(self.way.steps)
        if not 0 <= index < count:
            raise FinlabError(f"step of the refinement: expected one of {count}, got {index}")
        self._turn = object()
        self.at = index if index < count - 1 else None

    def forget(self) -> None:
        """Nothing is known: another answer is there, or the page has gone."""
        self._turn, self.at = object(), None
        self._found.forget()

    def _take(self) -> None:
        if self._found.error is not None:
            self._notify("Not possible", self._found.error)
        elif self.way is not None:
            self.show(0)
            self._loop.later(STEP_S, partial(self._go_on, self._turn))
        self._changed()

    def _go_on(self, turn: object) -> None:
        if turn is self._turn and self.at is not None:  # else it was ended, or held
            self.show(self.at + 1)
            self._loop.later(STEP_S, partial(self._go_on, self._turn))
            self._changed()
