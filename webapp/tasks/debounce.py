"""Work that takes a while is begun only once what it is about has come to rest; the newest question wins."""

import asyncio
from collections.abc import Callable
from functools import partial
from typing import Generic, TypeVar

from webapp.tasks.worker import Worker

Question = TypeVar("Question")
Found = TypeVar("Found")


class Debounced(Generic[Question, Found]):
    """Keeps the findings of one page about one thing up to date."""

    def __init__(
        self,
        work: Callable[[Question], Found],
        rest_s: float,
        worker: Worker,
        loop: asyncio.AbstractEventLoop,
        post: Callable[[Callable[[], object]], None],
        changed: Callable[[], None],
    ) -> None:
        """Prepare.

        Args:
            work: answers a question on the worker's thread.
            rest_s: how long the question may not change before work starts [s].
            worker: whose thread computes.
            loop: the event loop that everything else here runs on.
            post: brings a call to it.
            changed: called there when there are new findings.
        """
        self._work, self._rest_s = work, rest_s
        self._worker, self._loop, self._post, self._changed = worker, loop, post, changed
        self._question: Question | None = None
        self._answered: Question | None = None
        self._timer: asyncio.TimerHandle | None = None
        self.findings: Found | None = None
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
        self._timer = self._loop.call_later(self._rest_s, self._start, question)

    @property
    def busy(self) -> bool:
        """True while the findings are older than the question."""
        return self._question is not None and self._answered != self._question

    def close(self) -> None:
        """Nobody wants to know any more."""
        if self._timer is not None:
            self._timer.cancel()
        self._worker.forget(id(self))

    def _start(self, question: Question) -> None:
        def job() -> None:
            self._post(partial(self._take, question, self._work(question), None))

        def failed(text: str) -> None:
            self._post(partial(self._take, question, None, text))

        self._worker.submit(id(self), job, failed)

    def _take(self, question: Question, found: Found | None, error: str | None) -> None:
        self._answered, self.error = question, error
        if found is not None:
            self.findings = found
        self._changed()
