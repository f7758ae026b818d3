"""Transport of the server's lines over standard input and output, until they end or a signal asks
to stop."""

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
"""What ends the service; SIGHUP does not where it was ignored before, as `nohup` has it."""
MAX_LINE = 65_536  # longest request that is read [bytes]
PATIENCE = (
    1.0  # how long [s] a reader that takes nothing is waited for once the service has to stop
)
CHUNK = 65_536  # bytes that are read at once
LOOK_S = 0.02
"""How often the reader looks whether something has come [s]; after a pause of the process, what had
come by then is as old as the last look."""


class Line(NamedTuple):
    """A request on its way."""

    text: bytes
    since: float  # monotonic time [s] after which its first byte has come


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
        signal.signal(signal.SIGALRM, self._late)
        for number in SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._stop)

    def open(self, source: int, sink: int) -> None:
        """Read requests from one file descriptor from now on, and send answers to the other."""
        self._sink = sink
        for end in (source, sink):
            os.set_blocking(end, True)
        Thread(target=self._read, args=(source, time.monotonic()), daemon=True).start()

    def newest(self, timeout: float | None) -> Line | None:
        """The newest request that waits; None after `timeout` seconds without one. EOFError: the
        requests have ended, or a signal asks to stop."""
        end = None if timeout is None else time.monotonic() + timeout
        while not (self._stopped or self._line or self._ended):
            try:
                self._wake.get(timeout=None if end is None else max(end - time.monotonic(), 0.0))
            except Empty:
                return None
        if self._stopped or not self._line:
            raise EOFError
        return self._line.pop()

    def send(self, line: bytes) -> None:
        """Send one answer; `Unsent` where it is not taken."""
        self._sending = True
        rest = memoryview(line)
        self._hurry()
        try:
            while rest:
                rest = rest[os.write(self._sink, rest) :]
        except OSError as error:
            raise Unsent(str(error.strerror)) from None
        finally:
            self._sending = False
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _read(self, source: int, looked: float) -> None:
        """Read until the end. Bytes that are there at a look came after the look before, and a line
        has the age of its first byte: none is ever taken for younger than it is."""
        part = b""
        since = looked
        chunk = b"\n"
        ready = select.poll()
        ready.register(source, select.POLLIN)
        while chunk:
            while not ready.poll(LOOK_S * 1e3):
                looked = time.monotonic()
            came = looked
            looked = time.monotonic()
            size = _waiting(source)
            try:
                chunk = os.read(source, size)
            except OSError:  # a terminal that was closed
                chunk = b""
            begun = part
            *lines, part = (part + (chunk or b"\n")).split(b"\n")
            part = part[: MAX_LINE + 1]  # enough to refuse it
            if places := [number for number, line in enumerate(lines) if line.strip()]:
                self._line.append(
                    Line(lines[places[-1]], since if begun and places[-1] == 0 else came)
                )
                self._call()
            if lines or not begun:
                since = came
        self._ended = True
        self._call()

    def _call(self) -> None:
        if self._wake.empty():  # one call is enough, and calls that nobody hears do not pile up
            self._wake.put(None)

    def _stop(self, number: int, frame: FrameType | None) -> None:
        self._stopped = True
        self._call()
        self._hurry()

    def _hurry(self) -> None:
        if self._stopped and self._sending:
            signal.setitimer(signal.ITIMER_REAL, PATIENCE)

    def _late(self, number: int, frame: FrameType | None) -> None:
        raise Unsent(f"its reader took nothing for {PATIENCE:g} s")


def _waiting(source: int) -> int:
    """How many bytes can be read now, at most `CHUNK` and at least one."""
    try:
        size: int = struct.unpack("i", fcntl.ioctl(source, termios.FIONREAD, bytes(4)))[0]
    except OSError:
        return CHUNK
    return min(max(size, 1), CHUNK)
