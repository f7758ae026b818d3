"""Sessions by key. A browser keeps keys, the server keeps what they stand for."""

import secrets
import time
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from webapp.session import Session
from webapp.session.session_files import SessionFiles, frozen

MOST_WAITING, LONGEST_S = 32, 3600.0
"""Sessions that are kept in memory after their page has gone, and for how long [s]. Others are in files, if
the server keeps any."""


class SessionStore:
    """All sessions of this server, each shown in one tab at a time.

    Belongs to the event loop, all but `read` and `write`: files take their time.
    """

    def __init__(self, make: Callable[[], Session], files: SessionFiles | None = None) -> None:
        """`make` gives a fresh session; `files` keep sessions beyond the life of the server."""
        self._make = make
        self._files = files
        self._kept: dict[str, object] = {}
        self._sessions: dict[str, Session] = {}
        self._open: set[str] = set()
        self._left: dict[str, float] = {}
        self._writing: set[str] = set()

    def absent(self, keys: Iterable[str]) -> tuple[str, ...]:
        """Those of some keys that may be in files alone."""
        return () if self._files is None else tuple(key for key in keys if key not in self._sessions)

    def read(self, keys: Iterable[str]) -> dict[str, Session]:
        """Sessions that are kept in files, of these keys. On any thread."""
        sessions = {key: self._make() for key in keys}
        files = self._files
        return {k: session for k, session in sessions.items() if files is not None and files.read(k, session)}

    def enter(
        self, keys: Iterable[str], found: Mapping[str, Session] = MappingProxyType({})
    ) -> tuple[str, Session]:
        """The session for a tab, and its key.

        Args:
            keys: what this browser remembers. Of those that no other tab shows, the one left last is taken:
                a reload finds its work again, and a second tab gets a session of its own.
            found: what `read` has found of them.
        """
        for key, session in found.items():
            if key not in self._sessions:
                self._add(key, session)
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

    def changed(self) -> dict[str, Session]:
        """Sessions that have changed since the last time, as they are now, to be written; those that nobody
        wants any more are forgotten."""
        news = (
            {}
            if self._files is None
            else {k: s for k, s in self._sessions.items() if _mark(s) != self._kept[k]}
        )
        self._kept.update((key, _mark(session)) for key, session in news.items())
        self._writing.update(news)
        self._forget()
        return {key: frozen(session) for key, session in news.items()}

    def write(self, sessions: Mapping[str, Session]) -> None:
        """Keep what `changed` has given in files. On any thread, one at a time."""
        for key, session in sessions.items():
            if self._files is not None:
                self._files.write(key, session)
        self._writing.difference_update(sessions)

    def _add(self, key: str, session: Session) -> None:
        """One more session, of which nothing is new yet."""
        self._sessions[key], self._kept[key] = session, _mark(session)

    def _forget(self) -> None:
        """Of the sessions without a page, those left longest ago are forgotten: too many, or too old."""
        now = time.monotonic()
        waiting = sorted(
            (key for key in self._sessions if key not in self._open and key not in self._writing),
            key=lambda key: self._left.get(key, now),
            reverse=True,
        )
        for place, key in enumerate(waiting):
            if place >= MOST_WAITING or now - self._left.get(key, now) > LONGEST_S:
                del self._sessions[key], self._kept[key]
                self._left.pop(key, None)


def _mark(session: Session) -> object:
    """Differs whenever there is something new to keep."""
    looks = session.display, session.saved, session.beside
    return session.revision, *looks, session.draft, session.swim
