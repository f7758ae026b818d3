"""Works out what a layout can do, beside the solver and only once a change has come to rest."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from finlab.analysis import AttainableSet, ScoreCard, attainable_set, score_card
from finlab.analysis.attainable import Kind
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.worker import Worker

REST_S = 0.35
"""How long nothing may change before work starts [s]: a card takes a second of computing."""
DRAWN: dict[str, Kind | None] = {"none": None, "forces": "force", "torques": "torque"}
"""What set can be drawn, by the word on its button."""


@dataclass(frozen=True)
class Question:
    """What is to be worked out."""

    layout: Layout
    """The robot."""
    failed: tuple[str, ...]
    """Names of failed fins."""
    saved: Layout
    """The layout to compare with."""
    drawn: str
    """Key of `DRAWN`."""
    alone: bool
    """Whether the set keeps all else at zero."""


@dataclass(frozen=True)
class Findings:
    """What came of it."""

    question: Question
    """What was asked."""
    card: ScoreCard
    """What the working fins can do."""
    before: ScoreCard | None
    """The same for the saved layout, where it is another one."""
    now: AttainableSet | None
    """What the working fins attain, where a set is drawn."""
    whole: AttainableSet | None
    """The same with all fins, where one has failed."""


def find(question: Question) -> Findings:
    """Answer a question; takes about a second.

    Raises:
        FinlabError: the layout cannot be analysed.
    """
    layout, failed = question.layout, question.failed
    other = question.saved != layout and set(failed) <= set(question.saved.names)
    kind = DRAWN[question.drawn]
    now = whole = None
    if kind is not None:
        now = attainable_set(layout, kind, failed=failed, alone=question.alone)
        whole = attainable_set(layout, kind, alone=question.alone) if failed else None
    card = score_card(layout, failed)
    return Findings(question, card, score_card(question.saved, failed) if other else None, now, whole)


class Analyst:
    """Keeps the findings of one page up to date."""

    def __init__(
        self,
        worker: Worker,
        loop: asyncio.AbstractEventLoop,
        post: Callable[[Callable[[], object]], None],
        changed: Callable[[], None],
    ) -> None:
        """Prepare.

        Args:
            worker: whose thread computes.
            loop: the event loop that everything else here runs on.
            post: brings a call to it.
            changed: called there when there are new findings.
        """
        self._worker, self._loop, self._post, self._changed = worker, loop, post, changed
        self._question: Question | None = None
        self._timer: asyncio.TimerHandle | None = None
        self.findings: Findings | None = None
        """The newest findings; they may belong to an earlier question."""
        self.error: str | None = None
        """Why there are none, where the newest question could not be answered."""

    def ask(self, question: Question) -> None:
        """Have a question answered soon, unless it is the one that was asked last."""
        if question == self._question:
            return
        self._question = question
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._loop.call_later(REST_S, self._start, question)

    @property
    def busy(self) -> bool:
        """True while the findings are older than the question."""
        answered = self.error is not None or (
            self.findings is not None and self.findings.question == self._question
        )
        return not answered

    def close(self) -> None:
        """Nobody wants to know any more."""
        if self._timer is not None:
            self._timer.cancel()
        self._worker.forget((id(self), "analysis"))

    def _start(self, question: Question) -> None:
        def job() -> None:
            try:
                self._post(partial(self._take, find(question)))
            except FinlabError as error:
                self._post(partial(self._fail, str(error)))

        self.error = None
        self._worker.submit((id(self), "analysis"), job)

    def _take(self, findings: Findings) -> None:
        self.findings, self.error = findings, None
        self._changed()

    def _fail(self, text: str) -> None:
        self.error = text
        self._changed()
