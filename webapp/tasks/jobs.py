"""The jobs of one page beside the event loop, and score cards and ranges, which are two of them."""

import asyncio
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

from finlab.allocation.allocation import Allocation
from finlab.analysis import AttainableSet, ScoreCard, attainable_set, score_card
from finlab.forces.reach import Ranges, axis_ranges
from finlab.layout import Layout
from webapp.session.looking import DRAWN
from webapp.session.state import Flow, State, compared
from webapp.tasks.answering import Answering, Refining
from webapp.tasks.background import Context, Newest
from webapp.tasks.fitting import Fitting
from webapp.tasks.improving import Improver
from webapp.tasks.log_reading import LogReading
from webapp.tasks.swimming import Swimming

TRIES = 3
"""Answers of each method, of whose times the shortest counts: the first one may have to load a network, and
on a busy machine any may have to wait."""

Answer = Allocation | str


class Run(NamedTuple):
    """One comparison, as far as it has come."""

    state: State | None = None
    """The question, None before the first run."""
    answers: tuple[tuple[str, Answer], ...] = ()
    cancelled: bool = False

    @property
    def methods(self) -> tuple[str, ...]:
        """All of them, in their order."""
        return () if self.state is None else compared(self.state.layout)

    @property
    def running(self) -> bool:
        """True until all methods have answered."""
        return len(self.answers) < len(self.methods) and not self.cancelled


class Comparison(Newest[State, Allocation]):
    """The runs of one page: one question per method, so that those of other pages are answered in between."""

    def __init__(self, context: Context) -> None:
        super().__init__(context.loop, context.workers.answers, self._quickest, self._hear)
        self._solver, self._render = context.solver, context.changed
        self.run = Run()

    def start(self, state: State) -> None:
        """Ask all methods about a state; a run that is still going on is given up."""
        super().forget()
        self.run = Run(state)
        self._next(state)

    def cancel(self) -> None:
        """Ask no more; the answers so far stay."""
        super().forget()
        self.run = self.run._replace(cancelled=True)

    def forget(self) -> None:
        """Give up and forget."""
        super().forget()
        self.run = Run()

    def _next(self, state: State) -> None:
        if self.run.running:
            self.ask(replace(state, method=self.run.methods[len(self.run.answers)]))

    def _quickest(self, state: State) -> Allocation:
        return min((self._solver.solve(state) for _ in range(TRIES)), key=lambda answer: answer.solve_ms)

    def _hear(self) -> None:
        if self.answered is not None:
            answer = self.findings or self.error or "no answer"
            self.run = self.run._replace(answers=(*self.run.answers, (self.answered.method, answer)))
            self._render()
            self._next(self.answered)


REST_S = 0.12
"""How long the target may not change before the marks are worked out again [s]."""
CARD_REST_S = 0.35
"""How long a layout may not change before its card is worked out [s]: that takes a second."""
TOGETHER_S = 0.4
"""How long what comes beside an answer waits for the rest of it [s]."""


@dataclass(frozen=True)
class Question:
    """What is to be worked out."""

    layout: Layout
    failed: tuple[str, ...]
    saved: Layout
    """Another one to compare with."""
    drawn: str
    flow: Flow | None = None


@dataclass(frozen=True)
class Findings:
    """What came of it."""

    question: Question
    card: ScoreCard
    """What the working fins can do."""
    before: ScoreCard | None
    """The same for the layout to compare with, where it is another one."""
    now: AttainableSet | None
    """What the working fins attain, where a set is drawn."""
    whole: AttainableSet | None
    """The same with all fins, where one has failed; else that of the layout to compare with."""


@lru_cache(maxsize=32)
def find(question: Question) -> Findings:
    """Answer a question; takes about a second, but all first pages ask the same."""
    layout, failed, saved, flow = question.layout, question.failed, question.saved, question.flow
    other = saved != layout
    # An actuator that the other layout does not have cannot have failed there.
    lost = tuple(name for name in failed if name in saved.names)
    kind = DRAWN[question.drawn]
    now = reference = None
    if kind is not None:
        now = attainable_set(layout, kind, lost=failed, flow=flow)
        if failed or other:
            reference = attainable_set(layout if failed else saved, kind, flow=flow)
    card = score_card(layout, failed, flow)
    before = score_card(saved, lost, flow) if other and len(lost) < saved.n else None
    return Findings(question, card, before, now, reference)


@lru_cache(maxsize=32)
def find_ranges(question: State) -> Ranges:
    """The range of each component of a state's target."""
    return axis_ranges(question.layout, question.target, question.failed, question.flow)


class Jobs:
    """Questions under way, and what came of them."""

    def __init__(self, context: Context) -> None:
        self._session = context.session
        self._robot: tuple[str, tuple[str, ...]] | None = None
        self._loop, self._changed = context.loop, context.changed
        self._late: asyncio.TimerHandle | None = None
        loop, workers = context.loop, context.workers
        self.answering = Answering(context, self._beside)
        self.refining = Refining(context, self.answering)
        self.ranging = Newest(loop, workers.marks, find_ranges, self._beside, REST_S)
        self.both = Newest(loop, workers.answers, context.solver.both, self._beside, REST_S)
        self.analyst = Newest(loop, workers.cards, find, context.changed, CARD_REST_S)
        self.improver = Improver(context, lambda: context.session.display.drawn)
        self.fitting = Fitting(context)
        self.log = LogReading(context)
        self.comparison = Comparison(context)
        self.swimming = Swimming(context)

    def ask(self) -> None:
        """Have the workers answer the present state, unless they were asked already."""
        session, state = self._session, self._session.state
        robot = state.layout.name, state.layout.names
        if self._robot != robot:
            # What is known of another robot must not stand under this one's name.
            self._robot = robot
            for task in (self.answering, self.analyst, self.ranging, self.both):
                task.forget()
        able, drawn = state.able, session.display.drawn
        self.analyst.ask(Question(able, state.failed, session.saved, drawn, state.flow))
        self.ranging.ask(State(able, state.damage, target=state.target, speed=state.speed))
        self.answering.ask()
        if state.layout.interaction is not None and self._session.desk.task in ("Design", "Allocate"):
            self.both.ask(state)

    def _beside(self) -> None:
        """Marks and candidates come shortly after an answer: the page is written once for both, unless one
        of them takes long."""
        if self._late is None:
            self._late = self._loop.later(TOGETHER_S, self._write)
        if not (self.ranging.busy or self.both.busy or self.answering.searching):
            self._write()

    def _write(self) -> None:
        if self._late is not None:
            self._late.cancel()
        self._late = None
        self._changed()

    def stop(self) -> None:
        """The page has gone."""
        self.swimming.stop()
        self.refining.stop()
        tasks: tuple[Any, ...] = (
            self.comparison,
            self.improver,
            self.fitting,
            self.log,
            self.answering,
            self.analyst,
        )
        for task in (*tasks, self.ranging, self.both):
            task.forget()
