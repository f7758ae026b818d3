"""What one page has read and made beside the event loop."""

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from finlab.errors import FinlabError
from webapp.tasks.background import EventLoop
from webapp.tasks.readers import Readers

MOST_WAITING = 4

Found = TypeVar("Found")
Read = Callable[[], Found]


class Reading:
    """The files of one page; what comes of them is an intent of its user."""

    def __init__(self, readers: Readers, loop: EventLoop, do: Callable[[Callable[[], object]], None]) -> None:
        """`do` carries out on the loop what is meant with what was found, and says what was refused."""
        self._readers, self._loop, self._do = readers, loop, do
        self._waiting = 0
        self._later: dict[str, Callable[[], None]] = {}

    def read(
        self, read: Read[Found], use: Callable[[Found], object], prepare: Callable[[Found], object] = bool
    ) -> None:
        """Read what a stranger has made, and use it on the loop.

        Args:
            read: can be pickled; runs in a process of its own.
            use: an intent of the user.
            prepare: done before that on a thread, with what was found; what takes time there, too.

        Raises:
            FinlabError: too much is being read for this page already.
        """

        def work() -> Found:
            found = self._readers.read(read)
            if prepare is not None:
                prepare(found)
            return found

        self.make(work, use)

    def make(self, work: Read[Found], use: Callable[[Found], object], kind: str = "") -> None:
        """Do what takes time with what is ours, on a thread, and use what it gives on the loop. What has a
        `kind` waits its turn; of each kind the newest does.

        Raises:
            FinlabError: as above, of what has none.
        """
        if self._waiting >= MOST_WAITING and kind:
            self._later[kind] = partial(self.make, work, use, kind)
            return
        if self._waiting >= MOST_WAITING:
            raise FinlabError("other files are being read; wait for them")
        self._waiting += 1

        def job() -> None:
            try:
                act: Callable[[], object] = partial(use, work())
            except Exception as error:
                act = partial(_raise, error)
            self._loop.post(partial(self._end, act))

        self._readers.pool.submit(job)

    def _end(self, act: Callable[[], object]) -> None:
        self._waiting -= 1
        if self._later:
            self._later.pop(next(iter(self._later)))()
        self._do(act)


def _raise(error: Exception) -> None:
    raise error
