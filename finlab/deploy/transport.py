"""How the server's lines travel: over standard input and output, until they end or a signal asks to stop."""

import os
import signal
from queue import Empty, SimpleQueue
from threading import Thread
from types import FrameType

from finlab.errors import FinlabError

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""What ends the service; SIGHUP does not where it was ignored before, as `nohup` has it."""
MAX_LINE = 65_536
"""Longest request that is read [bytes]."""
PATIENCE = 1.0
"""How long [s] a reader that takes nothing is waited for once the service has to stop."""
CHUNK = 65_536
"""Bytes that are read at once."""


class Unsent(FinlabError):
    """An answer cannot be sent, and no later one either."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"standard output: {reason}; the neutral command was not sent, so rest the fins")


class StandardStreams:
    """Requests from one file descriptor, answers to another; the newest request wins."""

    def __init__(self) -> None:
        """Notes signals from now on."""
        self._lines: SimpleQueue[bytes | None] = SimpleQueue()  # None wakes up who waits
        self._stopped = self._ended = self._sending = False
        self._sink = -1
        signal.signal(signal.SIGALRM, self._late)
        for number in SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._stop)

    def open(self, source: int, sink: int) -> None:
        """Read requests from one file descriptor from now on, and send answers to the other."""
        self._sink = sink
        for end in (source, sink):
            os.set_blocking(end, True)
        Thread(target=self._read, args=(source,), daemon=True).start()

    def newest(self, timeout: float | None) -> bytes | None:
        """The newest request that waits; None after `timeout` seconds without one.

        Raises:
            EOFError: the requests have ended, or a signal asks to stop.
        """
        line: bytes | None = None
        try:
            while not (self._stopped or self._ended):
                told = self._lines.get(timeout=0.0 if line else timeout)
                line, self._ended = told or line, told is None
        except Empty:
            pass
        if self._stopped or (self._ended and line is None):
            raise EOFError
        return line

    def send(self, line: bytes) -> None:
        """Send one answer; `Unsent` where it is not taken."""
        self._sending, rest = True, memoryview(line)
        self._hurry()
        try:
            while rest:
                rest = rest[os.write(self._sink, rest) :]
        except OSError as error:
            raise Unsent(str(error.strerror)) from None
        finally:
            self._sending = False
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _read(self, source: int) -> None:
        part, chunk = b"", b"\n"
        while chunk:
            try:
                chunk = os.read(source, CHUNK)
            except OSError:  # a terminal that was closed
                chunk = b""
            *lines, part = (part + (chunk or b"\n")).split(b"\n")
            part = part[: MAX_LINE + 1]  # enough to refuse it
            if told := [line for line in lines if line.strip()]:
                self._lines.put(told[-1])
        self._lines.put(None)

    def _stop(self, number: int, frame: FrameType | None) -> None:
        self._stopped = True
        self._lines.put(None)
        self._hurry()

    def _hurry(self) -> None:
        if self._stopped and self._sending:
            signal.setitimer(signal.ITIMER_REAL, PATIENCE)

    def _late(self, number: int, frame: FrameType | None) -> None:
        raise Unsent(f"its reader took nothing for {PATIENCE:g} s")
