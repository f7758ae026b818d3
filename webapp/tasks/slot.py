"""Questions that take time: asked on the event loop, answered on threads; the newest one counts.

What takes less time than to hand it to a thread is answered on the loop.

A `Slot` keeps what one page has asked of one kind, and what came of it. Nothing is locked: a
question is frozen, an answer is never changed, and all that a slot holds belongs to the event loop.
"""

import asyncio
import math
import threading
import time
import traceback
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from queue import SimpleQueue
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from finlab.errors import FinlabError

Question = TypeVar("Question")
Answer = TypeVar("Answer")
QUICK_S = 0.003
"""Processor time up to which the loop of all pages may answer a question itself [s]."""
Job = tuple["Future[Any]", Callable[[], Any]]
"""What a thread has to do: the future of its result, and the function that makes that."""


class Pool:
    """Threads that take one job after the other, in the order in which they came."""

    def __init__(self, size: int = 1) -> None:
        """Start so many threads; they do not keep the process from ending."""
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._turn = threading.Lock() if size == 1 else None
        """Held while a job of a single thread is done."""
        self._threads = [threading.Thread(target=self._run, daemon=True) for _ in range(size)]
        for thread in self._threads:
            thread.start()

    def submit(self, work: Callable[[], Answer]) -> "Future[Answer]":
        """Have a job done; one that is cancelled before it has begun is left out."""
        future: Future[Answer] = Future()
        self._jobs.put((future, work))
        return future

    def do_now(self, work: Callable[[], Answer]) -> "Future[Answer] | None":
        """Do a job on the calling thread, in place of one of the pool's; None where these have
        something to do, or a single one is at work."""
        turn = self._turn
        if not self._jobs.empty() or (turn is not None and not turn.acquire(blocking=False)):
            return None
        future: Future[Answer] = Future()
        try:
            future.set_result(work())
        except BaseException as error:  # whoever asked is told
            future.set_exception(error)
        finally:
            if turn is not None:
                turn.release()
        return future

    def stop(self) -> None:
        """End the threads after what they are at."""
        for _ in self._threads:
            self._jobs.put(None)
        for thread in self._threads:
            thread.join(timeout=5.0)

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            future, work = job
            if not future.set_running_or_notify_cancel():
                continue
            with self._turn or nullcontext():
                try:
                    future.set_result(work())
                except BaseException as error:  # whoever asked is told, and the others go on
                    future.set_exception(error)


@dataclass(frozen=True)
class Pools:
    """The threads that all pages of a server share."""

    answers: Pool = field(default_factory=Pool)
    """Allocations: milliseconds. One thread, as a solver belongs to one."""
    swims: Pool = field(default_factory=Pool)
    """Robots that swim: all the time, in short turns, with a solver of their own."""
    brief: Pool = field(default_factory=partial(Pool, 3))
    """Ranges, score cards, files: up to a second."""
    long: Pool = field(default_factory=partial(Pool, 2))
    """Searches, fits, logs: up to minutes."""

    def stop(self) -> None:
        """End all threads."""
        for pool in vars(self).values():
            pool.stop()


class Attended(Protocol):
    """What a page looks after when its bell rings for it."""

    def attend(self) -> bool:
        """Go on, on the loop; whether there is something new to show."""
        ...


class Timer(Protocol):
    """A call that is still to come, as `asyncio.TimerHandle` is."""

    def cancel(self) -> None:
        """The call is not made any more."""
        ...


class Bell:
    """Wakes the loop of one page, and says for whom."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        """A bell for a coroutine on a loop."""
        self._loop = loop
        self.rung = asyncio.Event()
        """Set while the page has still to look; it waits for this event."""
        self._waiting: dict[Attended, None] = {}
        self.call_later: Callable[[float, Callable[[], object]], Timer] = loop.call_later
        """Calls a function on the loop after some time [s], without waking the page; called on the
        loop."""

    def ring(self, *waiting: Attended) -> None:
        """Wake the page, for some that wait; called on the loop."""
        for each in waiting:
            self._waiting[each] = None
        self.rung.set()

    def ring_from_thread(self, waiting: Attended, _done: object = None) -> None:
        """The same, called from any thread."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self.ring, waiting)

    def ring_later(self, seconds: float, waiting: Attended) -> None:
        """The same after some time [s]; called on the loop."""
        self.call_later(seconds, partial(self.ring, waiting))

    def take(self) -> list[Attended]:
        """Whom it rang for, once each; from now on it is silent again."""
        self.rung.clear()
        waiting = list(self._waiting)
        self._waiting.clear()
        return waiting


class Work(Generic[Question]):
    """A question on its way through a thread."""

    def __init__(self, question: Question, tell: Callable[[], None]) -> None:
        """`tell` says, from any thread, that there is progress."""
        self.question = question
        self.cancelled = threading.Event()
        """Set when nobody waits for the answer any more, or for no more of it."""
        self.progress: Any = None
        self.future: Future[Any] | None = None
        self.took_s = math.inf
        """Processor time that the answer took [s]; infinite until it is there."""
        self._tell = tell

    def report(self, progress: Any) -> None:
        """How far it is; called by whoever works on it."""
        self.progress = progress
        self._tell()


class Slot(Generic[Question, Answer]):
    """What one page has asked of one kind, and what came of it."""

    def __init__(
        self,
        pool: Pool,
        bell: Bell,
        solve: Callable[..., Answer],
        *,
        rest_s: float = 0.0,
        live: bool = False,
        watched: bool = False,
        stage: str | None = None,
        title: str = "",
        alike: Callable[[Question, Question], bool] | None = None,
    ) -> None:
        """An empty slot.

        Args:
            pool: threads that answer.
            bell: rung for this slot when there is an answer, or progress.
            solve: gives the answer to a question, on a thread; what it raises is the slot's
                `error`.
            rest_s: how long a question must not change before it is worked on [s].
            live: whether what is under way is finished when the question changes, so that a page
                follows a dragged slider; else it is cancelled.
            watched: whether `solve` also gets the `Work`: to report, and to see that it is
                cancelled.
            stage: progress of work that has reported nothing yet.
            title: heading of the note that tells of an error; empty where the page says it
                elsewhere.
            alike: whether two questions take about as long. Where the last one was answered within
                `QUICK_S`, one like it is answered on the loop: to hand it to a thread takes longer.
        """
        self._pool = pool
        self._bell = bell
        self._solve = solve
        self._rest_s = rest_s
        self._live = live
        self._watched = watched
        self._stage = stage
        self.title = title
        self._alike = alike
        self._took_s = math.inf
        """Processor time that the last answer took [s]."""
        self._work: Work[Question] | None = None
        self._rest: Timer | None = None
        """Begins to work on the question when it has not changed for some time."""
        self.question: Question | None = None
        """The newest one."""
        self.busy = False
        """Whether the newest question has no answer yet."""
        self.progress: Any = None
        """How far the work on the question is, where that is reported; None while there is
        none."""
        self.answered: Question | None = None
        """The one that answer and error belong to; it may be an earlier one."""
        self.answer: Answer | None = None
        self.error: str | None = None
        self.is_error_new = False
        """Whether the answer before had no such error."""

    def ask(self, question: Question, at_once: bool = False) -> None:
        """Have a question answered, unless it is the one that was asked last; `at_once` without a
        rest."""
        if self.question is not None and question == self.question:
            return
        self.question = question
        self.busy = True
        if self._work is not None:
            if self._live:  # the newest comes next
                return
            self._cancel()
        if self._rest is not None:
            self._rest.cancel()
            self._rest = None
        if at_once or self._rest_s == 0.0:
            self._begin()
        else:
            self._rest = self._bell.call_later(self._rest_s, partial(self._begin, is_late=True))

    def attend(self) -> bool:
        """Take an answer that has come."""
        work = self._work
        if work is None:
            return False
        future = work.future
        if future is None or not future.done():
            self.progress = work.progress
            return self.progress is not None
        self._work = None
        self.progress = None
        self.answered = work.question
        error_before = self.error
        self.answer = self.error = None
        self._took_s = work.took_s
        try:
            self.answer = future.result()
        except FinlabError as error:
            self.error = str(error)
        except Exception as error:  # one asker's fault must not silence all the others
            traceback.print_exception(error)
            self.error = f"it failed: {error or type(error).__name__}"
        self.is_error_new = self.error is not None and self.error != error_before
        self.busy = self.answered is not self.question
        if self.busy and self._rest is None:
            self._begin()
        return True

    def stop(self) -> None:
        """Answer soon, with what is known by then."""
        if self._work is not None:
            self._work.cancelled.set()

    def forget(self) -> None:
        """Drop question and answer; what is under way counts no more."""
        self._cancel()
        if self._rest is not None:
            self._rest.cancel()
            self._rest = None
        self.busy = False
        self.question = self.answered = self.answer = self.error = None

    def _begin(self, is_late: bool = False) -> None:
        """Gives the newest question to a thread, or answers it here where that is quicker; the page
        is told where it does not ask just now (`is_late`)."""
        assert self.question is not None
        self._rest = None
        ring = partial(self._bell.ring_from_thread, self)
        work = Work(self.question, ring)
        answer = partial(self._answer, work)
        is_quick = (
            self._took_s <= QUICK_S
            and self._alike is not None
            and self.answered is not None
            and self._alike(self.answered, self.question)
        )
        if is_quick:
            work.future = self._pool.do_now(answer)
        self._work = work
        if work.future is not None and not is_late and work.future.exception() is None:
            self.attend()
            return
        if work.future is None:
            work.future = self._pool.submit(answer)
            work.future.add_done_callback(ring)
        else:  # it is answered already, here on the loop
            self._bell.ring(self)
        self.progress = self._stage

    def _answer(self, work: Work[Question]) -> Answer:
        """The answer to a question, on any thread."""
        watch = (work,) if self._watched else ()
        start = time.thread_time()
        answer = self._solve(work.question, *watch)
        work.took_s = time.thread_time() - start
        return answer

    def _cancel(self) -> None:
        """Gives up the work that is under way."""
        work = self._work
        self._work = None
        self.progress = None
        if work is not None:
            work.cancelled.set()
            if work.future is not None:
                work.future.cancel()


class DeferredWork(NamedTuple):
    """Work that waits for others of its kind."""

    work: Callable[[], Any]
    """Takes time; called on a thread."""
    use: Callable[[Any], object]
    """Uses its result; called on the loop."""


class BegunWork(NamedTuple):
    """Work that a thread does."""

    future: "Future[Any]"
    """Of its result."""
    use: Callable[[Any], object]
    """Uses the result; called on the loop."""


class Deferred:
    """Work of one page that a user has asked for, and what is done with its result."""

    def __init__(self, pool: Pool, bell: Bell, do: Callable[[Callable[[], object]], None]) -> None:
        """`do` carries out an intent of the user: what is done with a result, or a refusal."""
        self._pool = pool
        self._bell = bell
        self._do = do
        self._begun: dict[Hashable, BegunWork] = {}
        self._next: dict[Hashable, DeferredWork] = {}

    def make(
        self, work: Callable[[], Answer], use: Callable[[Answer], object], kind: Hashable
    ) -> None:
        """Do what takes time on a thread, and use what it gives on the loop. What waits for one of
        its `kind` to end gives way to a newer one."""
        self._next[kind] = DeferredWork(work, use)
        self._begin(kind)

    def attend(self) -> bool:
        """Use what has come, and begin what waited for it."""
        done = [kind for kind, begun in self._begun.items() if begun.future.done()]
        for kind in done:
            begun = self._begun.pop(kind)
            self._do(partial(_use, begun))
            self._begin(kind)
        return bool(done)

    def forget(self) -> None:
        """The page has gone."""
        self._next.clear()
        self._begun.clear()

    def _begin(self, kind: Hashable) -> None:
        """Starts what waits of a kind, unless a thread is at work of that kind."""
        if kind in self._begun or kind not in self._next:
            return
        deferred = self._next.pop(kind)
        future = self._pool.submit(deferred.work)
        self._begun[kind] = BegunWork(future, deferred.use)
        future.add_done_callback(partial(self._bell.ring_from_thread, self))


def _use(begun: BegunWork) -> None:
    """Uses the result of work that is done, or raises what it raised."""
    begun.use(begun.future.result())
