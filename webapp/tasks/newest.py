"""Work in the background of which the newest question wins: the one pattern behind all that takes time."""

import asyncio
from collections.abc import Callable
from functools import partial
from typing import Generic, TypeVar

from webapp.tasks.event_loop import EventLoop
from webapp.tasks.worker import Worker

Question = TypeVar("Question")
Found = TypeVar("Found")


class Newest(Generic[Question, Found]):
    """Answers one kind of question for one page; one that waits gives way to a newer one.

    All methods are called on the event loop; only `work` runs on the worker's thread.
    """

    def __init__(
        self,
        loop: EventLoop,
        worker: Worker,
        work: Callable[[Question], Found],
        changed: Callable[[], None],
        rest_s: float = 0.0,
    ) -> None:
        """Prepare.

        Args:
            loop: where everything else runs.
            worker: whose thread computes.
            work: answers a question there.
            changed: called on the loop when there are findings, or an error.
            rest_s: how long the question may not change before work begins [s].
        """
        self._loop, self._worker, self._work, self._changed = loop, worker, work, changed
        self._rest_s = rest_s
        self._timer: asyncio.TimerHandle | None = None
        self._round = object()
        self.question: Question | None = None
        """What was asked last."""
        self.answered: Question | None = None
        """The question that findings and error belong to; it may be an earlier one."""
        self.findings: Found | None = None
        """What came of it; None where nothing did."""
        self.error: str | None = None
        """Why nothing came of it."""

    @property
    def busy(self) -> bool:
        """True while the newest question has no answer."""
        return self.answered is not self.question

    def ask(self, question: Question) -> None:
        """Have a question answered, unless it is the one that was asked last."""
        if self.question is not None and question == self.question:
            return
        self.question = question
        if self._rest_s == 0.0:
            self._start(question)
            return
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._loop.later(self._rest_s, partial(self._start, question))

    def forget(self) -> None:
        """Drop question and findings; what is still under way counts no more."""
        if self._timer is not None:
            self._timer.cancel()
        self._worker.forget(id(self))
        self._round = object()
        self.question = self.answered = self.findings = self.error = None

    def _start(self, question: Question) -> None:
        take = partial(self._take, self._round, question)

        def job() -> None:
            found = self._work(question)
            self._loop.post(partial(take, found, None))

        self._worker.submit(id(self), job, lambda text: self._loop.post(partial(take, None, text)))

    def _take(self, begun: object, question: Question, found: Found | None, error: str | None) -> None:
        if begun is self._round:
            self.answered, self.findings, self.error = question, found, error
            self._changed()
