"""What one page has read and made beside the event loop."""

from collections.abc import Callable, Hashable
from functools import partial
from typing import TypeVar

from webapp.tasks.background import EventLoop, Worker

Found = TypeVar("Found")


class Reading:
    """The files of one page; what comes of them is an intent of its user."""

    def __init__(
        self,
        worker: Worker,
        loop: EventLoop,
        do: Callable[[Callable[[], object]], None],
        refused: Callable[[str], None],
    ) -> None:
        """`do` carries out on the loop what is meant with what was found; `refused` says why nothing was."""
        self._worker, self._loop, self._do, self._refused = worker, loop, do, refused

    def make(self, work: Callable[[], Found], use: Callable[[Found], object], kind: Hashable) -> None:
        """Do what takes time on a thread, and use what it gives on the loop, as an intent of the user. What
        waits gives way to a newer one of its `kind`."""

        def job() -> None:
            self._loop.post(partial(self._do, partial(use, work())))

        self._worker.submit((id(self), kind), job, lambda text: self._loop.post(partial(self._refused, text)))
