"""The server: one `View` for each browser that connects, and the clock that lets the fins flap."""

import asyncio
import contextlib
import json
import signal
import socket
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import viser

from finlab.assets import shipped_layouts
from finlab.deploy.graph_file import read_graph
from finlab.errors import FinlabError
from finlab.layout import Layout, load_layout
from webapp.files import GRAPH_SUFFIX
from webapp.guard import Guard
from webapp.keeping import SessionFiles
from webapp.session import Display, Session
from webapp.solver import Solver
from webapp.state import State
from webapp.store import SessionStore
from webapp.targets import FIRST
from webapp.uploads import cache_folder
from webapp.view import View
from webapp.viser_internals import disable_sharing, start_guarded, stop_server
from webapp.workers import Workers

FIRST_LAYOUT = "ucat"
"""The shipped layout that a new session opens."""
FRAME_S = 1 / 25
"""Time between two poses of the fins [s]."""
KEEP_S = 2.0
"""How often changed sessions are written to disk [s]."""
STORAGE_KEY = "finlab-sessions"
"""Where a browser keeps the keys of its sessions."""
PATIENCE_S = (0.5, 1.0, 1.5, 2.0, 4.0, 8.0, 16.0)
"""How long a page may take to say which sessions it knows [s], try by try."""
MAX_KEYS = 8
"""Sessions that one browser remembers."""


class App:
    """Connects browsers to sessions on a running viser server."""

    def __init__(
        self,
        server: viser.ViserServer,
        solver: Solver,
        layout: Layout,
        display: Display | None = None,
        folder: Path | None = None,
    ) -> None:
        """Take over a server.

        Args:
            server: where browsers connect.
            solver: answers their questions.
            layout: what a new session opens.
            display: how a new session looks.
            folder: where sessions are kept beyond the life of the server; None keeps none.
        """
        self._server = server
        self._solver = solver
        self._workers = Workers()
        self._store = SessionStore(
            lambda: Session(layout, display), None if folder is None else SessionFiles(folder)
        )
        self.views: dict[int, View] = {}
        """The pages that are open, by client."""
        self._keys: dict[int, str] = {}
        self._loop = server.get_event_loop()
        server.scene.world_axes.visible = False
        disable_sharing(server)
        server.on_client_connect(self._connected)
        server.on_client_disconnect(self._disconnected)
        self._clock = asyncio.run_coroutine_threadsafe(self._animate(), self._loop)

    def stop(self) -> None:
        """Stop the clock and the worker; the server is stopped by its owner."""
        self._clock.cancel()
        with contextlib.suppress(TimeoutError, RuntimeError):  # one turn of the loop, so that the clock ends
            asyncio.run_coroutine_threadsafe(asyncio.sleep(0.01), self._loop).result(2.0)
        self._workers.stop()
        self._store.keep()

    def _connected(self, client: viser.ClientHandle) -> None:
        # Plain `def`: viser runs it on a thread of its pool, where waiting for the page is allowed.
        try:
            remembered = _session_keys(_stored(client, PATIENCE_S))
        except (RuntimeError, TimeoutError):  # gone already, or a browser that forbids storage
            remembered = []
        for client_id, key in list(self._keys.items()):
            # A connection that broke may still count as open; its tab is perhaps the one that is coming back.
            view = self.views.get(client_id)
            if key in remembered and view is not None and not _answers(view.client):
                self._loop.call_soon_threadsafe(self._drop, client_id)
        self._loop.call_soon_threadsafe(self._open, client, remembered)

    def _open(self, client: viser.ClientHandle, remembered: list[str]) -> None:
        if client.client_id not in self._server.get_clients():
            return
        key, session = self._store.enter(remembered)
        self._keys[client.client_id] = key
        if key not in remembered:
            remembered = [key, *remembered]
        client.local_storage.set_item(STORAGE_KEY, json.dumps(remembered[:MAX_KEYS]))
        self.views[client.client_id] = View(client, session, self._solver, self._workers, self._loop)

    async def _disconnected(self, client: viser.ClientHandle) -> None:
        self._drop(client.client_id)

    def _drop(self, client_id: int) -> None:
        view = self.views.pop(client_id, None)
        if view is not None:
            view.close()
            self._store.leave(self._keys.pop(client_id))

    async def _animate(self) -> None:
        before = kept = time.monotonic()
        while True:
            await asyncio.sleep(FRAME_S)
            now = time.monotonic()
            for view in list(self.views.values()):
                # A long pause (a busy machine) must not become a leap of the fins.
                view.animate(min(now - before, 0.2))
            before = now
            if now - kept > KEEP_S:
                kept = now
                self._store.keep()


def _answers(client: viser.ClientHandle) -> bool:
    """Whether a page is still there. Waits for it, so not to be called on the event loop."""
    try:
        _stored(client, (1.0, 1.0))
    except (RuntimeError, TimeoutError):
        return False
    return True


def _stored(client: viser.ClientHandle, patience: Sequence[float]) -> str | None:
    """What the browser keeps for us. A page that is just reconnecting may drop the question, so it is asked
    again; one on a slow machine takes its time, so each time we wait longer [s]."""
    for seconds in patience[:-1]:
        with contextlib.suppress(TimeoutError):
            return client.local_storage.get_item(STORAGE_KEY, timeout=seconds)
    return client.local_storage.get_item(STORAGE_KEY, timeout=patience[-1])


def serve(
    host: str = "127.0.0.1", port: int = 8080, layout: str | None = None, checkpoint: str | Path | None = None
) -> None:
    """Serve the app until SIGTERM or Ctrl-C.

    Args:
        host: address to listen on. Only this machine can reach the default; for any other one the printed
            address carries a token, without which nothing is shown.
        port: port to listen on; 0 takes a free one.
        layout: file, or name of a shipped layout, that a new session opens; None for the U-CAT.
        checkpoint: folder or name of a checkpoint; None for the shipped one.

    Raises:
        FinlabError: the port is taken, or layout or checkpoint cannot be read.
    """
    first = _first_layout(layout or FIRST_LAYOUT)
    _check_port(host, port)
    solver = Solver(checkpoint)
    # A missing checkpoint is reported now, not in the browser; and the first page finds a warm solver.
    _ = solver.solve(State(first, target=FIRST)).samples
    guard = Guard.of(host)
    server = start_guarded(guard, port)
    app = App(server, solver, first, folder=cache_folder() / "sessions")
    try:
        if port not in (0, server.get_port()):
            raise FinlabError(f"port {port} was taken while the app started; choose another --port")
        secret = "" if guard.token is None else f"/?token={guard.token}"
        print(f"finlab app: http://{host}:{server.get_port()}{secret}  (Ctrl-C stops it)", flush=True)
        _wait_for_signal()
    finally:
        app.stop()
        stop_server(server)


def _first_layout(text: str) -> Layout:
    shipped = shipped_layouts()
    if text in shipped and not Path(text).exists():
        return load_layout(shipped[text])
    return read_graph(text).layout if text.endswith(GRAPH_SUFFIX) else load_layout(text)


def _check_port(host: str, port: int) -> None:
    """Viser moves to the next port by itself when one is taken; the user would look at the wrong page."""
    if not 0 <= port <= 65535:
        raise FinlabError(f"port: expected a number from 0 to 65535, got {port}")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        reason = error.strerror or str(error)
        raise FinlabError(
            f"cannot listen on {host}:{port}: {reason}; choose another --port or --host"
        ) from None


def _session_keys(text: str | None) -> list[str]:
    """The keys in a browser's storage, which may hold anything."""
    try:
        keys = json.loads(text or "[]")
    except ValueError:
        return []
    return [key for key in keys if isinstance(key, str)][:MAX_KEYS] if isinstance(keys, list) else []


def _wait_for_signal() -> None:
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    while not stop.wait(0.5):  # a plain wait would keep Python from seeing the signal
        pass
