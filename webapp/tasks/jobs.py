"""The jobs of one page beside the event loop, and score cards and ranges, which are two of them."""

import asyncio
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from finlab.analysis import AttainableSet, ScoreCard, attainable_set, score_card
from finlab.forces.reach import Ranges, axis_ranges
from finlab.layout import Layout
from webapp.session.looking import DRAWN
from webapp.session.state import Flow, State
from webapp.tasks.answering import Answering, Refining
from webapp.tasks.background import Newest
from webapp.tasks.comparison import Comparison
from webapp.tasks.context import Context
from webapp.tasks.fitting import Fitting
from webapp.tasks.improving import Improver
from webapp.tasks.swimming import Swimming

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
        now = attainable_set(layout, kind, failed=failed, flow=flow)
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
        self.analyst = Newest(loop, workers.cards, find, context.changed, CARD_REST_S)
        self.improver = Improver(context)
        self.fitting = Fitting(context)
        self.comparison = Comparison(context)
        self.swimming = Swimming(context)

    def ask(self) -> None:
        """Have the workers answer the present state, unless they were asked already."""
        session, state = self._session, self._session.state
        robot = state.layout.name, state.layout.names
        if self._robot != robot:
            # What is known of another robot must not stand under this one's name.
            self._robot = robot
            for task in (self.answering, self.analyst, self.ranging):
                task.forget()
        self.analyst.ask(Question(state.able, state.failed, session.saved, session.display.drawn, state.flow))
        self.ranging.ask(State(state.able, state.failed, target=state.target, speed=state.speed))
        self.answering.ask()

    def _beside(self) -> None:
        """Marks and candidates come shortly after an answer: the page is written once for both, unless one
        of them takes long."""
        if self._late is None:
            self._late = self._loop.later(TOGETHER_S, self._write)
        if not (self.ranging.busy or self.answering.searching):
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
        tasks: tuple[Any, ...] = self.comparison, self.improver, self.fitting, self.answering, self.analyst
        for task in (*tasks, self.ranging):
            task.forget()
