"""The app as a process: a port is opened, the solver warmed up, and pages served until it is
stopped."""

import gc
import signal
import socket
import threading
from pathlib import Path

from finlab.errors import FinlabError
from finlab.files.worker import in_worker, prepare
from finlab.layout import load_layout
from webapp.app import App
from webapp.guard import Guard
from webapp.session.state import State
from webapp.session.targets import FIRST_TARGET
from webapp.start_page import start_page
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server

FIRST_LAYOUT = "ucat"


def serve(
    host: str = "127.0.0.1",
    port: int = 8080,
    layout: str | None = None,
    checkpoint: str | Path | None = None,
) -> None:
    """Serve the app until SIGTERM or Ctrl-C; other hosts than this machine get an address with a
    token, port 0 is a free one, None the U-CAT and the shipped checkpoint. Raises FinlabError: the
    port is taken, or layout or checkpoint cannot be read."""
    prepare(["webapp.session.files", "webapp.tasks.fitting"])
    first = in_worker(load_layout, layout or FIRST_LAYOUT)
    _check_port(host, port)
    solver = Solver(checkpoint)
    # A missing checkpoint is reported now, not in the browser; and the first page finds a warm
    # solver.
    solver.solve(State(first, target=FIRST_TARGET))
    guard = Guard.of(host)
    # Whoever names a robot has come for that one.
    server = start_server(guard, port, start_page() if layout is None else b"")
    app = App(server, solver, first)
    try:
        if port not in (0, server.get_port()):
            raise FinlabError(f"port {port} was taken while the app started; choose another --port")
        gc.freeze()  # what is there now stays: pages that go are found in less time
        stop = threading.Event()
        for number in (signal.SIGTERM, signal.SIGINT):  # whoever knows the address may send one
            signal.signal(number, lambda *_: stop.set())
        secret = "" if guard.token is None else f"/?token={guard.token}"
        print(
            f"finlab app: http://{host}:{server.get_port()}{secret}  (Ctrl-C stops it)", flush=True
        )
        while not stop.wait(0.5):  # a plain wait would keep Python from seeing the signal
            pass
    finally:
        app.stop()
        stop_server(server)


def _check_port(host: str, port: int) -> None:
    """Viser moves to the next port by itself when one is taken; the user would look at the wrong
    page."""
    if not 0 <= port <= 65535:
        raise FinlabError(f"port: expected a number from 0 to 65535, got {port}")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM
        )[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        reason = error.strerror or str(error)
        raise FinlabError(
            f"cannot listen on {host}:{port}: {reason}; choose another --port or --host"
        ) from None
