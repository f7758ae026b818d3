"""Threads that compute, the page that they work for, and questions of which the newest wins."""

import asyncio
import threading
import traceback
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Generic, TypeVar

import viser

from finlab.errors import FinlabError
from webapp.session import Session
from webapp.tasks.solver import Solver

Job = Callable[[], None]
Failed = Callable[[str], None]

Question = TypeVar("Question")
Found = TypeVar("Found")


class EventLoop:
    """Brings calls to the event loop that all sessions and widgets belong to."""

    def __init__(self, loop: asyncio.AbstractEventLoop, fault: Callable[[Exception], None]) -> None:
        """`fault` is called there with what a call has raised: the page must go on."""
        self._loop, self._fault = loop, fault
        self._closed = False

    def post(self, act: Callable[[], object]) -> None:
        """Run `act` on the loop soon; called from any thread."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._run, act)

    def later(self, seconds: float, act: Callable[[], object]) -> asyncio.TimerHandle:
        """Run `act` after some time; called on the loop."""
        return self._loop.call_later(seconds, self._run, act)

    def close(self) -> None:
        """The page has gone."""
        self._closed = True

    def _run(self, act: Callable[[], object]) -> None:
        if self._closed:
            return
        try:
            act()
        except Exception as error:
            self._fault(error)


class Worker:
    """Runs jobs on a thread of its own. A job that waits is replaced by a newer one with the same key; keys
    take turns in the order in which they began to wait, so that nothing queues up."""

    def __init__(self) -> None:
        self._jobs: dict[Hashable, tuple[Job, Failed]] = {}
        self._wake = threading.Condition()
        self._stopped = False
        self._thread = threading.Thread(target=self._run, name="finlab-solver", daemon=True)
        self._thread.start()

    def submit(self, key: Hashable, job: Job, failed: Failed) -> None:
        """Run `job` soon on the worker's thread, instead of a job with the same key that has not begun yet;
        `failed` is called there with a sentence that says why it failed."""
        with self._wake:
            self._jobs[key] = (job, failed)
            self._wake.notify()

    def forget(self, key: Hashable) -> None:
        """Drop the waiting job of an asker that has gone."""
        with self._wake:
            self._jobs.pop(key, None)

    def stop(self) -> None:
        """Finish the running job, drop the others, end the thread."""
        with self._wake:
            self._stopped = True
            self._jobs.clear()
            self._wake.notify()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while True:
            with self._wake:
                while not (self._jobs or self._stopped):
                    self._wake.wait()
                if self._stopped:
                    return
                job, failed = self._jobs.pop(next(iter(self._jobs)))
            try:
                job()
            except FinlabError as error:
                failed(str(error))
            except Exception as error:  # one asker's fault must not silence all the others
                traceback.print_exc()
                failed(f"it failed: {error or type(error).__name__}")


@dataclass(frozen=True)
class Workers:
    """One thread for each kind of work; all pages share them."""

    answers: Worker = field(default_factory=Worker)
    """Allocations: milliseconds."""
    marks: Worker = field(default_factory=Worker)
    """Reachable ranges: tens of milliseconds, after the answer."""
    cards: Worker = field(default_factory=Worker)
    """What a layout can do: about a second."""
    swims: Worker = field(default_factory=Worker)
    """Robots that swim: all the time, in short turns."""
    searches: Worker = field(default_factory=Worker)
    """Better layouts: up to minutes."""
    readers: Worker = field(default_factory=Worker)
    """Files from browsers: milliseconds to seconds."""
    fits: Worker = field(default_factory=Worker)
    """Fins fitted to measurements, and files of swims: seconds."""

    def stop(self) -> None:
        """End all threads."""
        for worker in vars(self).values():
            worker.stop()


class Newest(Generic[Question, Found]):
    """Answers one kind of question for one page; one that waits gives way to a newer one. All methods are
    called on the event loop; only `work`, and what it reports, runs on the worker's thread."""

    def __init__(
        self,
        loop: EventLoop,
        worker: Worker,
        work: Callable[[Question], Found],
        changed: Callable[[], None],
        rest_s: float = 0.0,
    ) -> None:
        """`work` answers a question on the thread of a worker once it has not changed for `rest_s` [s];
        `changed` is called on the loop when there are findings, an error, or progress."""
        self._loop, self._worker, self._work, self._changed = loop, worker, work, changed
        self._rest_s = rest_s
        self._timer: asyncio.TimerHandle | None = None
        self._round = object()
        self.question: Question | None = None
        self.answered: Question | None = None
        """The question that findings and error belong to; it may be an earlier one."""
        self.findings: Found | None = None
        """What came of it; None where nothing did."""
        self.error: str | None = None
        self.progress: Any = None
        """How far the work is, where it reports that; None when it is done."""

    @property
    def busy(self) -> bool:
        """True while the newest question has no answer."""
        return self.answered is not self.question

    def ask(self, question: Question, at_once: bool = False) -> None:
        """Have a question answered, unless it is the one that was asked last; `at_once` without a rest."""
        if self.question is not None and question == self.question:
            return
        self.question = question
        if self._timer is not None:
            self._timer.cancel()
        if at_once or self._rest_s == 0.0:
            self._start(question)
        else:
            self._timer = self._loop.later(self._rest_s, partial(self._start, question))

    def forget(self) -> None:
        """Drop question and findings; what is still under way counts no more."""
        if self._timer is not None:
            self._timer.cancel()
        self._worker.forget(id(self))
        self._round = object()
        self.question = self.answered = self.findings = self.error = self.progress = None

    def report(self, question: Question, progress: Any) -> None:
        """How far the work on a question is; called by the work."""
        self._loop.post(partial(self._note, question, progress))

    def _note(self, question: Question, progress: Any) -> None:
        if question is self.question and self.busy:  # else nobody waits for it
            self.progress = progress
            self._changed()

    def _start(self, question: Question) -> None:
        take = partial(self._take, self._round, question)

        def job() -> None:
            findings = self._work(question)
            self._loop.post(partial(take, findings, None))

        self._worker.submit(id(self), job, lambda text: self._loop.post(partial(take, None, text)))

    def _take(self, begun: object, question: Question, findings: Found | None, error: str | None) -> None:
        if begun is self._round:
            self.answered, self.findings, self.error, self.progress = question, findings, error, None
            self._changed()


@dataclass(frozen=True)
class Context:
    """One page."""

    client: viser.ClientHandle
    session: Session
    solver: Solver
    workers: Workers
    loop: EventLoop
    do: Callable[[Callable[[], object]], None]
    changed: Callable[[], None]
    """Renders the page; called on the loop when there is something new to show."""
    notify: Callable[..., None]
    """Shows a note: title and sentence, and whether it is `calm`; called on the loop."""

    def make(self, work: Callable[[], Found], use: Callable[[Found], object], kind: Hashable) -> None:
        """Do what takes time on a thread, and use what it gives on the loop, as an intent of the user. What
        waits gives way to a newer one of its `kind`."""

        def job() -> None:
            self.loop.post(partial(self.do, partial(use, work())))

        def refused(text: str) -> None:
            self.loop.post(partial(self.notify, "Not possible", text))

        self.workers.readers.submit((id(self), kind), job, refused)
