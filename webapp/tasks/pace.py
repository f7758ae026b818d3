"""How fast a swim may go, and does."""

import time
from collections import deque

LAG_S = 0.25
"""What the swim may be behind the clock [s]; what is more is dropped, so that nothing piles up."""
WINDOW_S = 2.0
"""Time over which the true speed is measured [s]."""


class Pace:
    """Counts what is owed to the clock, and measures what is paid."""

    def __init__(self) -> None:
        """At real time, with nothing owed."""
        self.speed = 1.0
        """Simulated time per time on the wall that is asked for."""
        self._owed = 0.0
        self._past: deque[tuple[float, float]] = deque()

    def set_speed(self, speed: float) -> None:
        """Another speed; the true one is measured again."""
        self.speed = speed
        self._past.clear()

    def start_anew(self) -> None:
        """The clock begins to run, or is held: nothing is owed, nothing is known of the true speed."""
        self._owed = 0.0
        self._past.clear()

    def due(self, elapsed: float, period_s: float) -> int:
        """Steps of a period [s] that are due after more time on the wall [s]."""
        self._owed = min(self._owed + elapsed * self.speed, LAG_S * max(self.speed, 1.0))
        return int(self._owed / period_s)

    def paid(self, simulated_s: float, now_s: float) -> None:
        """Some time has been simulated [s], and the swim stands at a time [s]."""
        self._owed = max(self._owed - simulated_s, 0.0)
        now = time.monotonic()
        self._past.append((now, now_s))
        while now - self._past[0][0] > WINDOW_S:
            self._past.popleft()

    @property
    def rate(self) -> float | None:
        """Simulated time per time on the wall over the last moments; None before it is known."""
        if len(self._past) < 2:
            return None
        (wall, start), (now, end) = self._past[0], self._past[-1]
        return (end - start) / (now - wall) if now - wall > 0.5 else None
