"""Many visitors, silent ones and hostile ones: an honest one always comes in, and nothing piles
up."""

import asyncio
import gc
import http.client
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from typing import Any

import msgspec
import pytest
import viser
import zstandard
from websockets.asyncio.client import ClientConnection, connect

from finlab.layout import load_layout
from tests.webapp.stand_in import load_stand_in, until
from webapp import app as app_module
from webapp.app import App, SessionStore
from webapp.session import Session
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server

CAMERA_FIELDS: dict[str, Any] = {
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 1.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""A message of the camera as pages send it."""


class Visitor:
    """One connection that speaks viser's protocol."""

    def __init__(self, socket: ClientConnection) -> None:
        """Take a connection over."""
        self.socket = socket
        self.stored: str | None = None
        """What the server had it keep."""

    async def send(self, kind: str, **values: Any) -> None:
        """Send one message."""
        await self.socket.send(msgspec.msgpack.encode({"type": kind, **values}))

    async def heard(self) -> AsyncIterator[dict[str, Any]]:
        """Messages of the server, one after the other."""
        async for raw in self.socket:
            assert isinstance(raw, bytes)
            size, packed = (int.from_bytes(raw[k : k + 8], "little") for k in (0, 8))
            text = zstandard.ZstdDecompressor().decompress(
                raw[16 : 16 + packed], max_output_size=size
            )
            for message in msgspec.msgpack.decode(text)["messages"]:
                yield message

    async def look(self) -> None:
        """Say where the camera is, which is a page's first message."""
        await self.send("ViewerCameraMessage", **CAMERA_FIELDS)

    async def enter(self, keys: str | None = None) -> None:
        """Answer until the server has opened a page."""
        await self.look()
        async for message in self.heard():
            if message["type"] == "LocalStorageGetItemRequestMessage":
                answer = {"value": keys, "error": None, "request_uuid": message["request_uuid"]}
                await self.send("LocalStorageGetItemResponseMessage", **answer)
            elif (
                message["type"] == "LocalStorageSetItemMessage"
                and message["key"] == "finlab-sessions"
            ):
                self.stored = message["value"]
                return
        raise AssertionError("the server has dropped this page")


@asynccontextmanager
async def visitor(port: int) -> AsyncIterator[Visitor]:
    """A connection to a server on this machine."""
    async with connect(
        f"ws://127.0.0.1:{port}/",
        subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
        max_size=None,
        compression=None,
        open_timeout=30,
    ) as socket:
        yield Visitor(socket)


async def visit(port: int, limit_s: float = 30.0) -> bool:
    """Open a page and leave; whether it came in time [s]."""
    try:
        async with visitor(port) as page:
            await asyncio.wait_for(page.enter(), limit_s)
            return True
    except (OSError, TimeoutError, AssertionError):
        return False


class Blank:
    """A page with nothing on it: what is tested here is the way to it."""

    BUILDING_S = 0.0

    def __init__(self, client: Any, *_: Any) -> None:
        """Know the browser."""
        time.sleep(self.BUILDING_S)
        self.client = client
        self.scenery: Any = self

    def animate(self, seconds: float) -> None:
        """Nothing moves."""

    def close(self) -> None:
        """Nothing is open."""


@pytest.fixture
def app(monkeypatch: pytest.MonkeyPatch) -> Iterator[App]:
    """An app whose pages show nothing."""
    monkeypatch.setattr(app_module, "View", Blank)
    server = start_server()
    app = App(server, Solver(load=load_stand_in), load_layout("A"))
    yield app
    app.stop()
    stop_server(server)


def port_of(app: App) -> int:
    """The port of an app."""
    return app._server.get_port()


@pytest.fixture
def frozen() -> Iterator[None]:
    """What other tests left is not searched for circles, as what stands before the app serves is
    not."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.mark.usefixtures("frozen")
def test_two_hundred_pages_one_after_the_other_and_at_once(
    app: App, monkeypatch: pytest.MonkeyPatch
) -> None:
    longest = 0.0

    async def beat() -> None:
        nonlocal longest
        while True:
            before = time.monotonic()
            await asyncio.sleep(0.0)
            longest = max(longest, time.monotonic() - before)

    async def come() -> tuple[list[bool], list[bool]]:
        one_by_one = [await visit(port_of(app)) for _ in range(200)]
        monkeypatch.setattr(Blank, "BUILDING_S", 0.02)
        return one_by_one, await asyncio.gather(*(visit(port_of(app), 60.0) for _ in range(200)))

    beating = asyncio.run_coroutine_threadsafe(beat(), app._loop)
    one_by_one, at_once = asyncio.run(come())
    beating.cancel()
    assert all(one_by_one) and all(at_once)
    assert longest < 200 * Blank.BUILDING_S / 4, "others are heard while pages are built"
    until(lambda: not app.views)
    assert len(app._store._sessions) <= app_module.MOST_WAITING and not app._keys


def test_no_more_sessions_than_are_kept() -> None:
    sessions = SessionStore(lambda: Session(load_layout("A")))
    for _ in range(100):
        sessions.leave(sessions.enter([])[0])
    assert len(sessions._sessions) == app_module.MOST_WAITING
    opened = [sessions.enter([])[1] for _ in range(100)]
    assert len({id(session) for session in opened}) == 100, "as many as have a page"


def test_sessions_are_forgotten_after_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    sessions = SessionStore(lambda: Session(load_layout("A")))
    key, session = sessions.enter([])
    sessions.leave(key)
    assert sessions.enter([key]) == (key, session)
    sessions.leave(key)
    monkeypatch.setattr(app_module, "LONGEST_S", 0.0)
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


def test_every_answer_carries_headers_that_keep_other_sites_out(app: App) -> None:
    for path, status in (("/", 200), ("/nothing", 404)):
        connection = http.client.HTTPConnection("127.0.0.1", port_of(app), timeout=20)
        connection.request("GET", path)
        answer = connection.getresponse()
        policy = answer.getheader("Content-Security-Policy") or ""
        assert answer.status == status
        assert (
            "frame-ancestors 'none'" in policy
            and "object-src 'none'" in policy
            and "https:" not in policy
        )
        assert answer.getheader("X-Frame-Options") == "DENY"
        assert answer.getheader("X-Content-Type-Options") == "nosniff"
        assert answer.getheader("Referrer-Policy") == "no-referrer"
