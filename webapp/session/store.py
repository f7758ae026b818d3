"""Sessions by key. A browser keeps keys, the server keeps what they stand for."""

import secrets
import time
from collections.abc import Callable, Iterable

from webapp.session import Session

MOST_WAITING, LONGEST_S = 32, 3600.0
"""Sessions that are kept after their page has gone, and for how long [s]."""


class SessionStore:
    """All sessions of this server, each shown in one tab at a time. Belongs to the event loop."""

    def __init__(self, make: Callable[[], Session]) -> None:
        """`make` gives a fresh session."""
        self._make = make
        self._sessions: dict[str, Session] = {}
        self._open: set[str] = set()
        self._left: dict[str, float] = {}

    def enter(self, keys: Iterable[str]) -> tuple[str, Session]:
        """The session for a tab, and its key.

        Of the `keys` that this browser remembers, and that no other tab shows, the one left last is taken: a
        reload finds its work again, and a second tab gets a session of its own.
        """
        self._forget()
        free = [k for k in keys if k in self._sessions and k not in self._open]
        key = max(free, key=lambda k: self._left.get(k, 0.0), default="")
        if not key:
            key = secrets.token_urlsafe(12)
            self._sessions[key] = self._make()
        self._open.add(key)
        self._left.pop(key, None)
        return key, self._sessions[key]

    def leave(self, key: str) -> None:
        """The tab has gone; its session waits for the next one."""
        self._open.discard(key)
        self._left[key] = time.monotonic()
        self._forget()

    def _forget(self) -> None:
        """Of the sessions without a page, those left longest ago are forgotten: too many, or too old."""
        now = time.monotonic()
        waiting = sorted(
            (key for key in self._sessions if key not in self._open),
            key=lambda key: self._left.get(key, now),
            reverse=True,
        )
        for place, key in enumerate(waiting):
            if place >= MOST_WAITING or now - self._left.get(key, now) > LONGEST_S:
                del self._sessions[key]
                self._left.pop(key, None)
