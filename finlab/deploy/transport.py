"""Transports the server's lines over standard input and output, until they end or a signal comes.

`serve` takes the newest request from here, and sends its answers.
"""

import fcntl
import os
import select
import signal
import struct
import termios
import time
from collections import deque
from queue import Empty, SimpleQueue
from threading import Thread
from types import FrameType
from typing import NamedTuple

from finlab.errors import FinlabError

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals that end the service; SIGHUP does not where it was ignored before, as `nohup` has it."""
MAX_LINE = 65_536
"""Longest request that is read [bytes]."""
SEND_TIMEOUT_S = 1.0
"""Time that a reader who takes nothing is waited for once the service has to stop [s]."""
CHUNK_BYTES = 65_536
"""Bytes that are read at once."""
POLL_S = 0.02
"""Period at which the input is polled [s]; after a pause of the process, what has arrived by then
counts as old as the last poll."""


class Line(NamedTuple):
    """A request."""

    text: bytes
    since: float
    """Monotonic time [s] after which its first byte has arrived."""


class Unsent(FinlabError):
    """An answer cannot be sent, and no later one either."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"standard output: {reason}; the neutral command was not sent, so rest the fins"
        )


class StandardStreams:
    """Requests from one file descriptor, answers to another; the newest request alone is kept."""

    def __init__(self) -> None:
        """Notes signals from now on."""
        self._line: deque[Line] = deque(maxlen=1)
        self._wake: SimpleQueue[None] = (
            SimpleQueue()
        )  # may be used in a signal's handler, as no lock may
        self._stopped = self._ended = self._sending = False
        self._sink = -1
        signal.signal(signal.SIGALRM, self._on_timeout)
        for number in SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._stop)

    def open(self, source: int, sink: int) -> None:
        """Reads requests from one file descriptor from now on, and sends answers to another.

        Args:
            source: descriptor of the requests.
            sink: descriptor of the answers.
        """
        self._sink = sink
        for descriptor in (source, sink):
            os.set_blocking(descriptor, True)
        Thread(target=self._read, args=(source, time.monotonic()), daemon=True).start()

    def newest(self, timeout: float | None) -> Line | None:
        """Returns the newest request that waits; None after a time without one.

        Args:
            timeout: that time [s]; None to wait for ever.

        Raises:
            EOFError: the requests have ended, or a signal asks to stop.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while not (self._stopped or self._line or self._ended):
            try:
                self._wake.get(
                    timeout=None if deadline is None else max(deadline - time.monotonic(), 0.0)
                )
            except Empty:
                return None
        if self._stopped or not self._line:
            raise EOFError
        return self._line.pop()

    def send(self, line: bytes) -> None:
        """Sends one answer.

        Raises:
            Unsent: it is not taken.
        """
        self._sending = True
        unsent = memoryview(line)
        self._limit_sending()
        try:
            while unsent:
                unsent = unsent[os.write(self._sink, unsent) :]
        except OSError as error:
            raise Unsent(str(error.strerror)) from None
        finally:
            self._sending = False
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _read(self, source: int, last_poll: float) -> None:
        """Reads until the end. Bytes that are there at a poll arrived after the poll before, and a
        line has the age of its first byte: none is ever taken for younger than it is."""
        partial = b""
        since = last_poll
        chunk = b"\n"
        ready = select.poll()
        ready.register(source, select.POLLIN)
        while chunk:
            while not ready.poll(POLL_S * 1e3):
                last_poll = time.monotonic()
            arrived_after = last_poll
            last_poll = time.monotonic()
            size = _available(source)
            try:
                chunk = os.read(source, size)
            except OSError:  # a terminal that was closed
                chunk = b""
            previous = partial
            *lines, partial = (partial + (chunk or b"\n")).split(b"\n")
            partial = partial[: MAX_LINE + 1]  # enough to refuse it
            if indices := [number for number, line in enumerate(lines) if line.strip()]:
                self._line.append(
                    Line(
                        lines[indices[-1]],
                        since if previous and indices[-1] == 0 else arrived_after,
                    )
                )
                self._notify()
            if lines or not previous:
                since = arrived_after
        self._ended = True
        self._notify()

    def _notify(self) -> None:
        """Wakes `newest`."""
        if self._wake.empty():  # one call is enough, and calls that nobody hears do not pile up
            self._wake.put(None)

    def _stop(self, number: int, frame: FrameType | None) -> None:
        self._stopped = True
        self._notify()
        self._limit_sending()

    def _limit_sending(self) -> None:
        """Starts the timeout of an answer that is being sent while the service has to stop."""
        if self._stopped and self._sending:
            signal.setitimer(signal.ITIMER_REAL, SEND_TIMEOUT_S)

    def _on_timeout(self, number: int, frame: FrameType | None) -> None:
        raise Unsent(f"its reader took nothing for {SEND_TIMEOUT_S:g} s")


def _available(source: int) -> int:
    """Number of bytes that can be read now, at most `CHUNK_BYTES` and at least one."""
    try:
        size: int = struct.unpack("i", fcntl.ioctl(source, termios.FIONREAD, bytes(4)))[0]
    except OSError:
        return CHUNK_BYTES
    return min(max(size, 1), CHUNK_BYTES)
