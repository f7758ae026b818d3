"""A method in a process of its own, asked one line at a time: it may stop answering or die without harm."""

import contextlib
import os
import queue
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Sequence
from typing import NamedTuple

from finlab.errors import DataError

MAX_LINE = 50_000_000
"""Bytes of an answer that are read."""
ENDING_S = 2.0
"""How long a process may take to end once its input has ended [s]."""
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Small products are slower when many threads wait for each other."""


class Reply(NamedTuple):
    """What came back."""

    line: bytes | None
    """The answer; empty where the process has ended, None where it is not there in time."""
    seconds: float
    """From the first byte of the question to the last of the answer."""


class Child:
    """A process that answers lines with lines."""

    def __init__(self, command: Sequence[str]) -> None:
        """Takes program and arguments; `start` starts them."""
        self.command = list(command)
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def runs(self) -> bool:
        """Whether the process is there."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Start the process, or start it again.

        Raises:
            DataError: there is no such program.
        """
        self.stop()
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115  # lives as long as the process
        try:
            self._process = subprocess.Popen(
                self.command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=ONE_THREAD | os.environ,
                start_new_session=True,
            )
        except OSError as error:
            raise DataError(f"{self.command[0]}: cannot be started: {error.strerror}") from None
        self._questions: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._replies: queue.SimpleQueue[Reply] = queue.SimpleQueue()
        talk = (self._process, self._questions, self._replies)
        threading.Thread(target=_talk, args=talk, daemon=True).start()

    def ask(self, line: str, wait_s: float) -> Reply:
        """The answer to a line; a process that is late is ended."""
        self._questions.put(line.encode())
        try:
            return self._replies.get(timeout=wait_s)
        except queue.Empty:
            self.stop(at_once=True)
            return Reply(None, wait_s)

    def last_words(self) -> str:
        """The last line that the process has written to stderr."""
        if self._errors.closed:
            return "it did not answer in time"
        self._errors.seek(max(0, self._errors.seek(0, os.SEEK_END) - 4000))
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1][:300] if lines else "no word on stderr"

    def stop(self, at_once: bool = False) -> None:
        """End the process and all that it has started."""
        if self._process is None:
            return
        process, self._process = self._process, None
        self._questions.put(None)
        if not at_once:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(ENDING_S)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        self._errors.close()


def _talk(
    process: "subprocess.Popen[bytes]",
    questions: "queue.SimpleQueue[bytes | None]",
    replies: "queue.SimpleQueue[Reply]",
) -> None:
    """Write each question and read its answer, until the input or the process ends."""
    assert process.stdin is not None and process.stdout is not None
    with contextlib.suppress(OSError, ValueError), process.stdin, process.stdout:
        while (line := questions.get()) is not None:
            begin = time.perf_counter()
            answer = b""
            with contextlib.suppress(OSError):
                process.stdin.write(line)
                process.stdin.flush()
                answer = process.stdout.readline(MAX_LINE)
            replies.put(Reply(answer, time.perf_counter() - begin))
