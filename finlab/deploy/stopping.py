"""Signals that ask a service to end, noted and left to its loop."""

import os
import signal
from types import FrameType

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""What ends a service; SIGHUP does not where it was ignored before, as `nohup` has it."""


class StopSignals:
    """Notes signals from now on; readable, for `select` and `poll`, once one has come."""

    def __init__(self) -> None:
        self.came = False
        self._woken, self._wake = os.pipe()
        os.set_blocking(self._woken, False)
        os.set_blocking(self._wake, False)
        signal.set_wakeup_fd(self._wake, warn_on_full_buffer=False)
        for number in SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._note)

    def fileno(self) -> int:
        """What becomes readable."""
        return self._woken

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.came = True
