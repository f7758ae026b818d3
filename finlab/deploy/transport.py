"""How the server's lines travel: over standard input and output.

Lines, signals and the reader of answers are waited for at once, in one thread.
"""

import os
import select
import time

from finlab.deploy.request import MAX_LINE
from finlab.deploy.stopping import StopSignals
from finlab.errors import FinlabError

PATIENCE = 1.0
"""How long [s] a reader that takes nothing is waited for once the service has to stop."""
CHUNK = 65_536
"""Bytes that are read at once."""
BURST = 16
"""Chunks that are read before the newest line in them is answered, however fast more come."""


class Unsent(FinlabError):
    """An answer cannot be sent, and no later one either."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"standard output: {reason}; the neutral command was not sent, so rest the fins")


class StandardStreams:
    """Requests from one file descriptor, answers to another; the newest request wins."""

    def __init__(self, source: int, sink: int, stop: StopSignals) -> None:
        self._source, self._sink, self._stop = source, sink, stop
        self._line: bytes | None = None  # the newest request that waits
        self._part = b""  # the beginning of the next one
        self._ended = False

    def newest(self, timeout: float | None) -> bytes | None:
        """The newest request that waits; None after `timeout` seconds without one.

        Raises:
            EOFError: the requests have ended, or a signal asks to stop.
            Unsent: answers are no longer read.
        """
        end = None if timeout is None else time.monotonic() + timeout
        for _ in range(BURST):
            if not self._wait(0, 0.0):
                break
        while not self._stop.came:
            line, self._line = self._line, None
            if line is not None:
                return line
            if self._ended:  # the end waits until the last request is answered
                break
            left = None if end is None else end - time.monotonic()
            if left is not None and left <= 0.0:
                return None
            self._wait(0, left)
        raise EOFError

    def send(self, line: bytes) -> None:
        """Send one answer; `Unsent` where it is not taken."""
        rest, end = memoryview(line), None
        while rest:
            if self._stop.came:
                end = end or time.monotonic() + PATIENCE
                if time.monotonic() > end:
                    raise Unsent(f"its reader took nothing for {PATIENCE:g} s")
            if self._wait(select.POLLOUT, PATIENCE) & select.POLLOUT:
                try:
                    rest = rest[os.write(self._sink, rest[: select.PIPE_BUF]) :]
                except BlockingIOError:
                    continue
                except OSError as error:
                    raise Unsent(str(error.strerror)) from None

    def _wait(self, wanted: int, timeout: float | None) -> int:
        """Wait for a request, a signal or what is `wanted` of the sink; what came of it, 0 if nothing."""
        poll = select.poll()
        poll.register(self._sink, wanted)
        poll.register(self._stop, select.POLLIN)
        if not self._ended:
            poll.register(self._source, select.POLLIN)
        events = dict(poll.poll(None if timeout is None else 1e3 * timeout))
        if self._stop.fileno() in events:
            os.read(self._stop.fileno(), CHUNK)
        if self._source in events:
            self._read()
        sink = events.get(self._sink, 0)
        if sink & ~wanted:
            raise Unsent("nobody reads it any more")
        return sink or bool(events)

    def _read(self) -> None:
        try:
            chunk = os.read(self._source, CHUNK)
        except BlockingIOError:
            return
        except OSError:  # a terminal that was closed
            chunk = b""
        self._ended = not chunk
        *lines, part = (self._part + (chunk or b"\n")).split(b"\n")
        self._part = part[: MAX_LINE + 1]  # enough to refuse it
        self._line = next((line for line in reversed(lines) if line.strip()), self._line)
