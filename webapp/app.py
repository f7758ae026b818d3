"""The server: sessions by key, one `View` for each browser, and the clock of robots that swim."""

import asyncio
import contextlib
import ctypes
import gc
import json
import secrets
import time
from collections.abc import Callable, Iterable

import viser

from finlab.layout import Layout
from webapp.session import Display, Session
from webapp.session.looking import DARK
from webapp.tasks.following import Lectures
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver
from webapp.view import View
from webapp.viser_internals import disable_sharing, icons_at_hand, stored

FRAME_S = 1 / 25
"""Time between two poses of robots that swim [s]."""
LOOK_S = 0.25
"""Time between two looks whether a robot has begun to swim [s]."""
STORAGE_KEY = "finlab-sessions"
SCHEME_KEY = "finlab-scheme"
"""Where a page keeps the colour scheme of its system, `dark` or `light`."""
PATIENCE_S = (0.5, 1.0, 1.5, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0)
"""How long a page may take to say which sessions it knows [s], try by try."""
REST_S = 3.0
"""How long after a page has gone its memory is given back [s]; once for all that go in that
time."""
PRESENT_S = (1.0, 1.0)
"""The same for a page whose work another one asks for: it may be gone without a word."""
MAX_KEYS = 8
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
        """The session for a tab, and its key. Of the `keys` that this browser remembers, and that
        no other tab shows, the one left last is taken: a reload finds its work again, a second tab
        gets its own."""
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
        """Of the sessions without a page, those left longest ago are forgotten: too many, or too
        old."""
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


class App:
    """Connects browsers to sessions on a running viser server."""

    def __init__(
        self,
        server: viser.ViserServer,
        solver: Solver,
        layout: Layout,
        display: Display | None = None,
    ) -> None:
        """Take over a server; a new session opens a `layout`, and looks as `display` says."""
        self._server = server
        self._solver = solver
        self._pools = Pools()
        self._lectures = Lectures()
        self._store = SessionStore(lambda: Session(layout, display))
        self.views: dict[int, View] = {}
        self._keys: dict[int, str] = {}
        self._loop = server.get_event_loop()
        self._door = asyncio.Lock()
        self._giving: asyncio.TimerHandle | None = None
        server.scene.world_axes.visible = False
        # With the first words to a browser: it would else draw its own light and shadows before
        # ours.
        server.scene.configure_environment_map(None)
        server.scene.configure_default_lights(cast_shadow=False)
        disable_sharing(server)
        server.on_client_connect(self._connected)
        server.on_client_disconnect(self._disconnected)
        self._clock = asyncio.run_coroutine_threadsafe(self._animate(), self._loop)

    def stop(self) -> None:
        """Stop clock and threads; the server is stopped by its owner."""
        self._clock.cancel()
        with contextlib.suppress(
            TimeoutError, RuntimeError
        ):  # one turn of the loop, so that it ends
            asyncio.run_coroutine_threadsafe(asyncio.sleep(0.01), self._loop).result(2.0)
        self._pools.stop()

    async def _connected(self, client: viser.ClientHandle) -> None:
        """Wait for the page to say which sessions it knows; one that says nothing is dropped in
        time."""
        try:
            keys, scheme = await asyncio.gather(
                stored(client, STORAGE_KEY, PATIENCE_S), stored(client, SCHEME_KEY, PATIENCE_S)
            )
            remembered = _session_keys(keys)
        except TimeoutError:
            return
        except RuntimeError:  # a browser that forbids storage
            remembered = []
            scheme = None
        # A connection that broke may still count as open; its tab is perhaps the one that is coming
        # back.
        rivals = [known for known, key in self._keys.items() if key in remembered]
        await asyncio.gather(*(self._drop_if_gone(rival) for rival in rivals))
        async with (
            self._door
        ):  # one at a time: a page takes its time, and all others are heard in between
            if client.client_id in self._server.get_clients():
                self._open(client, remembered, scheme == DARK)
            await asyncio.sleep(0.0)

    def _open(self, client: viser.ClientHandle, remembered: list[str], is_dark: bool) -> None:
        key, session = self._store.enter(remembered)
        session.follow_system(is_dark)
        self._keys[client.client_id] = key
        if key not in remembered:
            remembered = [key, *remembered]
        client.local_storage.set_item(STORAGE_KEY, json.dumps(remembered[:MAX_KEYS]))
        with icons_at_hand():
            view = View(client, session, self._solver, self._pools, self._loop, self._lectures)
        self.views[client.client_id] = view

    async def _drop_if_gone(self, client_id: int) -> None:
        try:
            await stored(self.views[client_id].client, STORAGE_KEY, PRESENT_S)
        except TimeoutError:
            self._drop(client_id)
        except (KeyError, RuntimeError):  # being built, or there
            return

    async def _disconnected(self, client: viser.ClientHandle) -> None:
        self._drop(client.client_id)

    def _drop(self, client_id: int) -> None:
        view = self.views.pop(client_id, None)
        key = self._keys.pop(client_id, None)
        if view is not None:
            view.close()
        if key is not None:
            self._store.leave(key)
        if self._giving is None:
            self._giving = self._loop.call_later(REST_S, self._give_back)

    def _give_back(self) -> None:
        """A page is full of references in circles, and what it took would else stay with the
        process."""
        self._giving = None
        gc.collect()
        with contextlib.suppress(AttributeError, OSError):  # glibc alone has it
            ctypes.CDLL(None).malloc_trim(0)

    async def _animate(self) -> None:
        before = time.monotonic()
        while True:
            swims = any(view.jobs.swimming.active for view in self.views.values())
            await asyncio.sleep(FRAME_S if swims else LOOK_S)
            now = time.monotonic()
            for view in list(self.views.values()):
                # A long pause (a busy machine) must not become a leap of the robots.
                view.animate(min(now - before, 0.2))
            before = now


def _session_keys(text: str | None) -> list[str]:
    """The keys in a browser's storage, which may hold anything."""
    try:
        keys = json.loads(text or "[]")
    except (ValueError, RecursionError):
        return []
    return (
        [key for key in keys if isinstance(key, str)][:MAX_KEYS] if isinstance(keys, list) else []
    )
