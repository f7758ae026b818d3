"""Foreign origins and strangers stay out; a session survives the server."""

import http.client
from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from finlab.assets import shipped_layouts
from finlab.layout import load_layout
from tests.webapp.hands import move_fin
from tests.webapp.stand_in import load_stand_in
from webapp.app import App
from webapp.guard import COOKIE, Guard, is_loopback
from webapp.session import Session
from webapp.session.session_files import SessionFiles, to_dict
from webapp.session.store import SessionStore
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server

OWN = {"host": "localhost:8080"}


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "[::1]", "127.8.8.8"])
def test_loopback_needs_no_token(host: str) -> None:
    assert is_loopback(host) and Guard.of(host).token is None


def test_foreign_origin_and_foreign_host_are_refused() -> None:
    guard = Guard.of("127.0.0.1")
    assert guard.check("/", OWN) is None
    assert guard.check("/", {**OWN, "origin": "http://localhost:8080"}) is None
    for origin in (
        "https://evil.example",
        "http://localhost:9999",
        "null",
        "http://localhost:8080.evil.example",
    ):
        refused = guard.check("/", {**OWN, "origin": origin})
        assert refused is not None and refused.status in (400, 403)
    rebound = guard.check("/", {"host": "evil.example:8080", "origin": "http://evil.example:8080"})
    assert rebound is not None and rebound.status == 403


def test_token_is_asked_for_beyond_this_machine() -> None:
    guard = Guard.of("0.0.0.0")
    assert guard.token is not None and len(guard.token) >= 24
    headers = {"host": "robot.local:8080"}
    for path, cookie in (
        ("/", ""),
        ("/?token=", ""),
        ("/?token=wrong", ""),
        ("/", f"{COOKIE}=wrong"),
        ("/", "=;="),
    ):
        refused = guard.check(path, {**headers, "cookie": cookie})
        assert refused is not None and refused.status == 401
    opened = guard.check(f"/?token={guard.token}", headers)
    assert opened is not None and opened.status == 303 and guard.token in opened.headers["Set-Cookie"]
    assert guard.check("/", {**headers, "cookie": f"{COOKIE}={guard.token}"}) is None


def test_real_server_refuses_before_anything_is_shown() -> None:
    server = start_server(Guard("127.0.0.1", "secret-token"), 0)
    try:
        port = server.get_port()

        def get(path: str, **headers: str) -> http.client.HTTPResponse:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
            connection.request("GET", path, headers=headers)
            return connection.getresponse()

        assert get("/").status == 401
        opened = get("/?token=secret-token")
        assert opened.status == 303
        cookie = str(opened.getheader("Set-Cookie")).split(";")[0]
        assert get("/", Cookie=cookie).status == 200
        url = f"ws://127.0.0.1:{port}"
        for headers in ({}, {"Cookie": cookie, "Origin": "https://evil.example"}):
            with pytest.raises(InvalidStatus), connect(url, additional_headers=headers):
                pass
        with connect(url, additional_headers={"Cookie": cookie}):
            pass
    finally:
        stop_server(server)


def test_session_survives_the_server(tmp_path: Path) -> None:
    layout = load_layout(shipped_layouts()["ucat"])
    keys = []
    for life in range(2):
        server = start_server()
        app = App(server, Solver(load=load_stand_in), layout, folder=tmp_path)
        key, session = app._store.enter(keys, app._store.read(keys))
        if life == 0:
            keys.append(key)
            session.set_target(1, 0.5)
            session.toggle_failure("back_left")
            session.select("front_left")
            session.mirror_fin()
            move_fin(session, "front_left", (0.2, 0.2, 0.0))
            session.set_display("dark", True)
            session.undo()
            before = session
        else:
            assert key == keys[0] and to_dict(session) == to_dict(before)
            assert session.display.dark
        app.stop()
        stop_server(server)


def test_kept_files_are_checked(tmp_path: Path) -> None:
    files = SessionFiles(tmp_path)
    session = Session(load_layout(shipped_layouts()["A"]))

    def fresh() -> Session:
        return Session(load_layout(shipped_layouts()["ucat"]))

    files.write("../../escape", session)
    assert list(tmp_path.iterdir()) == [] and not files.read("../../etc/passwd", fresh())
    files.write("a" * 16, session)
    found = fresh()
    assert files.read("a" * 16, found) and found.state == session.state
    path = tmp_path / f"{'a' * 16}.json"
    assert path.stat().st_mode & 0o077 == 0
    for text in ("", "{", "[]", "{}", '{"layout": 1}', path.read_text().replace("dual", "<script>")):
        path.write_text(text)
        assert not files.read("a" * 16, fresh())
    store = SessionStore(lambda: Session(load_layout(shipped_layouts()["A"])), files)
    assert store.enter(["a" * 16], store.read(["a" * 16]))[1].state.layout.name == "A", (
        "a broken file costs the session, not the page"
    )
