"""Sessions by key. A browser keeps keys, the server keeps what they stand for."""

import secrets
import time
from collections.abc import Callable, Iterable

from webapp.session import Session
from webapp.session.session_files import SessionFiles

MOST_WAITING, LONGEST_S = 32, 3600.0
"""Sessions that are kept in memory after their page has gone, and for how long [s]. Others are in files, if
the server keeps any."""


class SessionStore:
    """All sessions of this server, each shown in one tab at a time."""

    def __init__(self, make: Callable[[], Session], files: SessionFiles | None = None) -> None:
        """`make` gives a fresh session; `files` keep sessions beyond the life of the server."""
        self._make = make
        self._files = files
        self._kept: dict[str, object] = {}
        self._sessions: dict[str, Session] = {}
        self._open: set[str] = set()
        self._left: dict[str, float] = {}

    def enter(self, keys: Iterable[str]) -> tuple[str, Session]:
        """The session for a tab, and its key.

        Args:
            keys: what this browser remembers. Of those that no other tab shows, the one left last is taken:
                a reload finds its work again, and a second tab gets a session of its own.
        """
        keys = list(keys)
        for key in keys:
            self._resume(key)
        free = [k for k in keys if k in self._sessions and k not in self._open]
        key = max(free, key=lambda k: self._left.get(k, 0.0), default="")
        if not key:
            key = secrets.token_urlsafe(12)
            self._add(key, self._make())
        self._open.add(key)
        self._left.pop(key, None)
        return key, self._sessions[key]

    def leave(self, key: str) -> None:
        """The tab has gone; its session waits for the next one."""
        self._open.discard(key)
        self._left[key] = time.monotonic()
        self.keep()

    def _resume(self, key: str) -> None:
        """Bring a session back that an earlier server has kept."""
        if self._files is None or key in self._sessions:
            return
        session = self._make()
        if self._files.read(key, session):
            self._add(key, session)

    def keep(self) -> None:
        """Write the sessions that have changed since the last time, and forget those that nobody wants."""
        for key, session in self._sessions.items() if self._files is not None else ():
            if _mark(session) != self._kept[key]:
                self._kept[key] = _mark(session)
                self._files.write(key, session)
        self._forget()

    def _add(self, key: str, session: Session) -> None:
        """One more session, of which nothing is new yet."""
        self._sessions[key], self._kept[key] = session, _mark(session)

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
                del self._sessions[key], self._kept[key]
                self._left.pop(key, None)


def _mark(session: Session) -> object:
    """Differs whenever there is something new to keep."""
    looks = session.display, session.saved, session.pinned, session.beside
    return session.revision, *looks, session.draft, session.swim
