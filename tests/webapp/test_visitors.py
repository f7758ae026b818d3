"""Many visitors, silent ones and hostile ones: an honest one always comes in, and nothing piles up."""

import asyncio
import http.client
import socket
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import pytest

from finlab.layout import load_layout
from tests.webapp.stand_in import load_stand_in
from tests.webapp.visitor import Visitor, visit, visitor
from webapp import app as app_module
from webapp import connections
from webapp.app import App
from webapp.session import Session, store
from webapp.session.store import SessionStore
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server


class Blank:
    """A page with nothing on it: what is tested here is the way to it."""

    def __init__(self, client: Any, *_: Any) -> None:
        """Know the browser."""
        self.client = client
        self.scenery: Any = self

    def animate(self, seconds: float) -> None:
        """Nothing moves."""

    def close(self) -> None:
        """Nothing is open."""


@pytest.fixture
def app(monkeypatch: pytest.MonkeyPatch) -> Iterator[App]:
    monkeypatch.setattr(app_module, "View", Blank)
    server = start_server()
    app = App(server, Solver(load=load_stand_in), load_layout("A"))
    yield app
    app.stop()
    stop_server(server)


def port_of(app: App) -> int:
    return app._server.get_port()


def until(condition: Callable[[], bool], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_hundred_pages_one_after_the_other_and_eighty_at_once(app: App) -> None:
    async def come() -> tuple[list[bool], list[bool]]:
        one_by_one = [await visit(port_of(app)) for _ in range(100)]
        return one_by_one, await asyncio.gather(*(visit(port_of(app)) for _ in range(80)))

    one_by_one, at_once = asyncio.run(come())
    assert all(one_by_one) and all(at_once)
    until(lambda: not app.views)
    assert len(app._store._sessions) <= store.MOST_WAITING and not app._keys


def test_no_more_sessions_than_are_kept() -> None:
    sessions = SessionStore(lambda: Session(load_layout("A")))
    for _ in range(100):
        sessions.leave(sessions.enter([])[0])
    assert len(sessions._sessions) == store.MOST_WAITING
    opened = [sessions.enter([])[1] for _ in range(100)]
    assert len({id(session) for session in opened}) == 100, "as many as have a page"


def test_sessions_are_forgotten_after_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    sessions = SessionStore(lambda: Session(load_layout("A")))
    key, session = sessions.enter([])
    sessions.leave(key)
    assert sessions.enter([key]) == (key, session)
    sessions.leave(key)
    monkeypatch.setattr(store, "LONGEST_S", 0.0)
    time.sleep(0.01)
    assert sessions.enter([key])[1] is not session


async def _silent_request(port: int) -> None:
    """Half a request, and then nothing."""
    _, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ")
    await writer.drain()
    await asyncio.sleep(60)


async def _silent_socket(port: int) -> None:
    """A page that never says anything."""
    async with visitor(port):
        await asyncio.sleep(60)


async def _silent_answer(port: int) -> None:
    """A page that tells where it looks, and never what it has kept."""
    async with visitor(port) as page:
        await page.look()
        await asyncio.sleep(60)


@pytest.mark.parametrize("silent", [_silent_request, _silent_socket, _silent_answer])
def test_honest_visitor_comes_in_beside_many_that_say_nothing(
    app: App, silent: Callable[[int], Awaitable[None]]
) -> None:
    async def come() -> float:
        crowd = [asyncio.ensure_future(silent(port_of(app))) for _ in range(250)]
        await asyncio.sleep(1.0)
        begin = time.monotonic()
        assert await visit(port_of(app), 10.0)
        took = time.monotonic() - begin
        for member in crowd:
            member.cancel()
        await asyncio.gather(*crowd, return_exceptions=True)
        return took

    assert asyncio.run(come()) < 5.0


def test_silent_connections_are_few_and_are_dropped(app: App, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "PATIENCE_S", 0.5)
    with socket.create_connection(("127.0.0.1", port_of(app))) as half:
        half.sendall(b"GET / HTTP/1.1\r\n")
        half.settimeout(10.0)
        assert not _received(half)


def _received(half: socket.socket) -> bytes:
    """What came before the end of a connection."""
    parts = []
    try:
        while part := half.recv(65536):
            parts.append(part)
    except ConnectionResetError:
        pass
    return b"".join(parts)


def test_pages_beyond_the_limit_take_the_place_of_idle_ones(
    app: App, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "MOST_PAGES", 3)

    async def come() -> int:
        pages = [visitor(port_of(app)) for _ in range(5)]
        entered: list[Visitor] = [await page.__aenter__() for page in pages]
        for page in entered:
            await asyncio.wait_for(page.enter(), 10)
        await asyncio.sleep(0.5)
        opened = len(app.views)
        for page in pages:
            await page.__aexit__(None, None, None)
        return opened

    assert asyncio.run(come()) == 3


def raw(app: App, request: bytes) -> bytes:
    """Answer to a request as it stands."""
    with socket.create_connection(("127.0.0.1", port_of(app))) as connection:
        connection.settimeout(10.0)
        connection.sendall(request)
        return _received(connection)


GOOD = b"Host: localhost\r\n"
WRONG: dict[str, bytes] = {
    "no host": b"GET / HTTP/1.1\r\n\r\n",
    "host [": b"GET / HTTP/1.1\r\nHost: [\r\n\r\n",
    "host of words": b"GET / HTTP/1.1\r\nHost: a b\r\n\r\n",
    "host twice": b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n",
    "host port": b"GET / HTTP/1.1\r\nHost: localhost:99999999\r\n\r\n",
    "host not ASCII": "GET / HTTP/1.1\r\nHost: löcalhost\r\n\r\n".encode(),
    "origin [": b"GET / HTTP/1.1\r\n" + GOOD + b"Origin: http://[\r\n\r\n",
    "origin without scheme": b"GET / HTTP/1.1\r\n" + GOOD + b"Origin: localhost\r\n\r\n",
    "origin not ASCII": b"GET / HTTP/1.1\r\n" + GOOD + b"Origin: http://\xff\xfe\r\n\r\n",
    "path of 5,000": b"GET /" + b"a" * 5000 + b" HTTP/1.1\r\n" + GOOD + b"\r\n",
    "path of 150": b"GET /" + b"a" * 150 + b" HTTP/1.1\r\n" + GOOD + b"\r\n",
    "query of 5,000": b"GET /?" + b"a" * 5000 + b" HTTP/1.1\r\n" + GOOD + b"\r\n",
    "percent": b"GET /%zz HTTP/1.1\r\n" + GOOD + b"\r\n",
    "percent at the end": b"GET /% HTTP/1.1\r\n" + GOOD + b"\r\n",
    "NUL": b"GET /%00 HTTP/1.1\r\n" + GOOD + b"\r\n",
    "raw NUL": b"GET /\x00 HTTP/1.1\r\n" + GOOD + b"\r\n",
    "dots": b"GET /../../etc/passwd HTTP/1.1\r\n" + GOOD + b"\r\n",
    "hidden dots": b"GET /%2e%2e/%2e%2e/etc/passwd HTTP/1.1\r\n" + GOOD + b"\r\n",
    "hidden letters": b"GET /%ff%fe HTTP/1.1\r\n" + GOOD + b"\r\n",
    "path not ASCII": "GET /ö HTTP/1.1\r\n".encode() + GOOD + b"\r\n",
    "no slash": b"GET x HTTP/1.1\r\n" + GOOD + b"\r\n",
    "two slashes": b"GET //[ HTTP/1.1\r\n" + GOOD + b"\r\n",
    "POST": b"POST / HTTP/1.1\r\n" + GOOD + b"Content-Length: 3\r\n\r\nabc",
    "HEAD": b"HEAD / HTTP/1.1\r\n" + GOOD + b"\r\n",
    "unknown method": b"FETCH / HTTP/1.1\r\n" + GOOD + b"\r\n",
    "body": b"GET / HTTP/1.1\r\n" + GOOD + b"Content-Length: 3\r\n\r\nabc",
    "length of words": b"GET / HTTP/1.1\r\n" + GOOD + b"Content-Length: x\r\n\r\n",
    "chunks": b"GET / HTTP/1.1\r\n" + GOOD + b"Transfer-Encoding: chunked\r\n\r\n",
    "HTTP/1.0": b"GET / HTTP/1.0\r\n" + GOOD + b"\r\n",
    "no HTTP": b"hello\r\n\r\n",
    "TLS": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n",
    "line ends": b"GET / HTTP/1.1\nHost: localhost\n\n",
    "header without colon": b"GET / HTTP/1.1\r\n" + GOOD + b"nothing\r\n\r\n",
    "header name": b"GET / HTTP/1.1\r\n" + GOOD + b"a b: c\r\n\r\n",
    "long header": b"GET / HTTP/1.1\r\n" + GOOD + b"X: " + b"a" * 9000 + b"\r\n\r\n",
    "many headers": b"GET / HTTP/1.1\r\n" + GOOD + b"X: a\r\n" * 200 + b"\r\n",
    "no websocket": b"GET / HTTP/1.1\r\n" + GOOD + b"Upgrade: websocket\r\n\r\n",
    "websocket of old": b"GET / HTTP/1.1\r\n"
    + GOOD
    + b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 1\r\n\r\n",
}


def test_wrong_requests_get_a_plain_line(app: App, capfd: pytest.CaptureFixture[str]) -> None:
    for name, request in WRONG.items():
        answer = raw(app, request)
        head, _, body = answer.partition(b"\r\n\r\n")
        status = head.split(b"\r\n")[0]
        assert status.startswith(b"HTTP/1.1 4"), (name, answer[:200])
        assert 0 < len(body) < 300 and b"Traceback" not in body, name
        assert b"nosniff" in head and b"frame-ancestors" in head, name
    assert "Traceback" not in capfd.readouterr().err


def test_every_answer_carries_headers_that_keep_other_sites_out(app: App) -> None:
    for path, status in (("/", 200), ("/nothing", 404)):
        connection = http.client.HTTPConnection("127.0.0.1", port_of(app), timeout=20)
        connection.request("GET", path)
        answer = connection.getresponse()
        policy = answer.getheader("Content-Security-Policy") or ""
        assert answer.status == status
        assert "frame-ancestors 'none'" in policy and "object-src 'none'" in policy and "https:" not in policy
        assert answer.getheader("X-Frame-Options") == "DENY"
        assert answer.getheader("X-Content-Type-Options") == "nosniff"
        assert answer.getheader("Referrer-Policy") == "no-referrer"
