"""The app against a real server, and a page without a browser."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import viser
from viser import _messages

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.listener import Listener
from tests.webapp.stand_in import SilentClient, load_stand_in, until
from webapp.app import App, SessionStore, _session_keys
from webapp.serving import serve
from webapp.session import Session
from webapp.tasks.solver import Solver
from webapp.view import View


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    """A real server without a page."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope="module")
def app(server: viser.ViserServer) -> Iterator[App]:
    """The app on it."""
    app = App(server, Solver(load=load_stand_in), load_layout(shipped_layouts()["ucat"]))
    yield app
    app.stop()


@pytest.fixture
def view(server: viser.ViserServer, app: App) -> Iterator[View]:
    """A page of the app without a browser."""
    client: Any = SilentClient(server)
    loop = server.get_event_loop()
    session = Session(load_layout(shipped_layouts()["ucat"]))
    view = on_loop(server, lambda: View(client, session, app._solver, app._pools, loop))
    yield view
    view.close()
    on_loop(server, lambda: (server.gui.reset(), server.scene.reset()))


def on_loop(server: viser.ViserServer, act: Callable[[], Any]) -> Any:
    """Run where views live, and wait for it."""

    async def run() -> Any:
        return act()

    return asyncio.run_coroutine_threadsafe(run(), server.get_event_loop()).result(30)


def test_newest_question_is_answered(server: viser.ViserServer, view: View) -> None:
    for k in range(60):
        on_loop(server, lambda k=k: view.do(lambda: view.session.set_target(0, 0.02 * k)))
    until(lambda: not view.busy)
    assert view.shown_allocation is not None
    assert view.shown_allocation.target[0] == pytest.approx(1.18)
    assert len(view.client.notes) == 0


def test_what_nobody_sees_is_not_asked_and_what_stays_is_not_sent(
    server: viser.ViserServer, view: View
) -> None:
    session = view.session
    jobs = view.jobs

    def do(act: Callable[[], object]) -> None:
        on_loop(server, lambda: view.do(act))
        until(lambda: on_loop(server, lambda: view.is_settled))

    do(session.fold_drawer)
    do(lambda: session.set_target(0, 0.9))
    ranges = jobs.ranging.question
    search = jobs.answering.search.question
    assert ranges is not None and ranges.target[0] == 0.9 and jobs.analyst.question is None
    assert search is not None and search.drawer == "", (
        "the answer is proved, its modes are not looked for"
    )
    do(lambda: session.show_task("Design"))
    do(lambda: session.set_target(0, 0.8))
    assert jobs.ranging.question is ranges and jobs.answering.search.question is search
    assert (
        view.shown_allocation is not None
        and view.shown_allocation.target[0] == 0.8
        and jobs.analyst.question is None
    )
    do(session.fold_drawer)
    assert jobs.analyst.answer is not None, "an opened drawer asks at once"
    listener = Listener(server)
    listener.wait()
    do(lambda: None)
    do(lambda: session.set_target(0, 0.8))
    time.sleep(0.3)
    assert listener.heard == []
    listener.close()


def test_refusals_become_notes_and_lose_nothing(server: viser.ViserServer, view: View) -> None:
    state = view.session.state
    on_loop(server, lambda: view.do(lambda: view.session.set_target(0, float("nan"))))
    on_loop(server, lambda: view.do(lambda: view.session.toggle_loss("<b>nobody</b>")))
    assert view.session.state == state
    assert len(view.client.notes) == 2
    assert "Fx" in view.client.notes[0]


def test_solver_errors_become_notes_and_the_page_goes_on(
    server: viser.ViserServer, view: View
) -> None:
    on_loop(server, lambda: view.do(lambda: view.session.set_setting("method", "ipopt")))
    until(lambda: view.jobs.answering.shown_answer().error is not None)
    assert view.client.notes == ["No answer: ipopt is out of order in this test"]
    on_loop(server, lambda: view.do(lambda: view.session.set_setting("method", "dual")))
    until(lambda: not view.busy)
    assert view.jobs.answering.shown_answer().error is None and view.shown_allocation is not None


def test_a_fault_of_a_swim_is_told_and_the_next_one_swims(
    server: viser.ViserServer, app: App, view: View, monkeypatch: pytest.MonkeyPatch
) -> None:
    swimming = view.jobs.swimming
    session = view.session

    def start() -> None:
        on_loop(server, lambda: swimming.start(session.swim.plan(session.state)))

    def fall(_elapsed: float) -> None:
        raise RuntimeError("a node is gone")

    monkeypatch.setattr(app, "views", {1: view})
    start()
    with monkeypatch.context() as patch:
        patch.setattr(view.scenery, "animate", fall)
        until(lambda: len(view.client.notes) == 1)
    assert "a node is gone" in view.client.notes[0]
    assert not swimming.active
    start()
    until(lambda: swimming.time > 0.3)


def test_nodes_and_widgets_do_not_grow(server: viser.ViserServer, view: View) -> None:
    layouts = [load_layout(shipped_layouts()[name]) for name in ("pair", "octo", "ucat")]

    def count() -> tuple[int, int]:
        return len(server.scene._handle_from_node_name), len(server.gui._gui_input_handle_from_uuid)

    def round_trip() -> None:
        for layout in layouts:
            view.do(lambda layout=layout: view.session.open_layout(layout))

    on_loop(server, round_trip)
    until(lambda: on_loop(server, lambda: view.is_settled))  # answered, and drawn
    before = count()
    for _ in range(10):
        on_loop(server, round_trip)
    until(lambda: on_loop(server, lambda: view.is_settled))  # answered, and drawn
    assert count() == before


def test_a_bundle_that_cannot_be_made_is_told(server: viser.ViserServer, view: View) -> None:
    until(lambda: not view.busy)
    on_loop(server, lambda: view.do(view.designs.bundle))
    until(lambda: "ucat_bundle.zip" in view.client.files)
    on_loop(server, lambda: view.do(lambda: view.session.set_setting("method", "sqp")))
    on_loop(server, lambda: view.do(view.designs.bundle))
    until(lambda: any("Not possible" in note for note in view.client.notes))
    assert "cannot be exported" in view.client.notes[-1]


def test_sharing_is_off(server: viser.ViserServer, app: App) -> None:
    handlers = server._websock_server._incoming_handlers
    assert (
        _messages.ShareUrlRequest not in handlers and _messages.ShareUrlDisconnect not in handlers
    )


def test_store_keeps_tabs_apart_and_finds_work_again() -> None:
    store = SessionStore(lambda: Session(load_layout(shipped_layouts()["A"])))
    key, session = store.enter([])
    other_key, other = store.enter([key])
    assert other is not session
    store.leave(key)
    assert store.enter([other_key, key]) == (key, session)
    assert store.enter(["made up"])[1] not in (session, other)


@pytest.mark.parametrize("text", [None, "", "{", "3", '{"a": 1}', "[1, null]", '"key"'])
def test_storage_may_hold_anything(text: str | None) -> None:
    assert _session_keys(text) == []


def test_taken_port_and_bad_port_are_refused() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(FinlabError, match=f"{port}.*--port"):
            serve(port=port)
    with pytest.raises(FinlabError, match="65535"):
        serve(port=70000)
    with pytest.raises(FinlabError, match="no_such"):
        serve(layout="no_such.yaml")


def test_serves_until_sigterm() -> None:
    code = (
        "import sys; from webapp import serving; from webapp.tasks import solver\n"
        "from tests.webapp.stand_in import load_stand_in\n"
        "serving.Solver = lambda checkpoint: solver.Solver(load=load_stand_in)\n"
        "serving.serve(port=0)"
    )
    root = str(shipped_layouts()["A"].parent.parent)
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=root,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": root},
    )
    stop = threading.Timer(60, process.kill)
    stop.start()
    try:
        assert process.stdout is not None
        line = next(line for line in process.stdout if line.startswith("finlab app"))
        url = line.split()[2]
        assert url.startswith("http://127.0.0.1:")
        assert urllib.request.urlopen(url, timeout=20).status == 200
        process.send_signal(signal.SIGTERM)
        assert process.wait(20) == 0
    finally:
        stop.cancel()
        process.kill()
