"""What is put in place of viser's private parts gives what viser gives; strangers stay out."""

import asyncio
import gzip
import http.client
import threading
import time
from collections.abc import Callable, Iterator
from http.client import HTTPConnection
from itertools import chain
from typing import Any
from urllib.request import Request, urlopen
from zipfile import ZipFile

import numpy as np
import pytest
import viser
from msgspec import msgpack
from viser import _icons, _messages
from viser.infra._messages import Message
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol
from zstandard import ZstdCompressor, ZstdDecompressor

from webapp import viser_internals
from webapp.guard import COOKIE, Guard, is_loopback
from webapp.viser_internals import (
    Outbox,
    _frame,
    assign,
    hold_uploads,
    icons_at_hand,
    run_script,
    start_server,
    stop_server,
)


def test_property_types_of_a_handle_are_those_of_its_class() -> None:
    server = start_server()
    box = server.scene.add_box("/box")
    sphere = server.scene.add_icosphere("/sphere")
    box.dimensions = (1.0, 2.0, 3.0)
    sphere.radius = 0.5
    assert (box.dimensions, sphere.radius) == ((1.0, 2.0, 3.0), 0.5)
    assert "dimensions" not in sphere._prop_hints and "dimensions" in box._prop_hints
    stop_server(server)


def test_the_first_page_has_our_name_and_icon() -> None:
    server = start_server()
    for encoding in ("gzip", "identity"):
        request = Request(
            f"http://127.0.0.1:{server.get_port()}/", headers={"Accept-Encoding": encoding}
        )
        with urlopen(request) as answer:
            body = answer.read()
            page = gzip.decompress(body) if answer.headers["Content-Encoding"] == "gzip" else body
        assert page.count(b"<title>") == 1 and b"<title>finlab</title>" in page
        assert page.count(b'rel="icon"') == 1
    stop_server(server)


def test_names_that_no_file_can_have_are_not_found() -> None:
    server = start_server()
    for path in ("/" + "a" * 5_000, "/a/" * 1_000 + "b" * 300, "/%00", "/" + "%C3%A4" * 200):
        connection = HTTPConnection("127.0.0.1", server.get_port(), timeout=20)
        connection.request("GET", path)
        assert 400 <= connection.getresponse().status < 500
    stop_server(server)


class Sending:
    """A page with one button, whose messages are made by hand."""

    def __init__(self, server: viser.ViserServer) -> None:
        """At most a thousand bytes are taken."""
        self.refused: list[str] = []
        self.gui = server.gui
        self.button = str(self.gui.add_upload_button("Open")._impl.uuid)
        hold_uploads(self.gui, 1_000, self.refused.append)

    def _tell(self, message: Any) -> None:
        for hear in self.gui._websock_interface._incoming_handlers[type(message)]:
            hear(0, message)  # type: ignore[arg-type, call-arg]

    def begin(self, size: Any, parts: Any, key: str = "a") -> None:
        """Announce a file."""
        self._tell(
            _messages.FileTransferStartUpload(self.button, key, "a.csv", "text/csv", parts, size)
        )

    def part(self, index: int, content: Any, key: str = "a") -> None:
        """Send a part of it."""
        self._tell(_messages.FileTransferPart(self.button, key, index, content))

    @property
    def kept(self) -> int:
        """Bytes that are held."""
        states = self.gui._current_file_upload_states.values()
        parts = chain.from_iterable(state["parts"].values() for state in states)
        return sum(map(len, parts))


def test_a_file_that_sends_more_than_it_announced_is_dropped_there(
    capsys: pytest.CaptureFixture[str],
) -> None:
    server = start_server()
    page = Sending(server)
    page.begin(10, 3)
    page.part(0, b"hello")
    assert page.kept == 5 and not page.refused
    page.part(1, b"x" * 6)
    assert page.kept == 0 and "sends more than the 10 bytes" in page.refused[0]
    page.part(2, b"x" * 6)
    assert page.kept == 0 and len(page.refused) == 1
    page.begin(10, 2, "b")
    page.part(0, "text", "b")
    assert page.kept == 0 and len(page.refused) == 2
    stop_server(server)


def test_files_on_their_way_are_bounded_and_an_honest_one_arrives() -> None:
    server = start_server()
    page = Sending(server)
    for size, parts in ((1_001, 1), (-1, 1), (2**70, 1), (5, 6), (None, 1), (1.0, 1), (5, -1)):
        page.begin(size, parts)
        page.part(0, b"x")
        assert page.kept == 0
    assert len(page.refused) == 7
    for key in "abcd":
        page.begin(400, 2, key)
        page.part(0, b"x" * 300, key)
    assert page.kept == 600 and len(page.refused) == 9
    page.part(1, b"y" * 100)
    handle: Any = page.gui._gui_input_handle_from_uuid[page.button]
    assert handle.value.content == b"x" * 300 + b"y" * 100
    stop_server(server)


OWN_HEADERS = {"host": "localhost:8080"}
"""Headers of a page that the server itself has sent."""


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "[::1]", "127.8.8.8"])
def test_loopback_needs_no_token(host: str) -> None:
    assert is_loopback(host) and Guard.of(host).token is None


def test_foreign_origin_and_foreign_host_are_refused() -> None:
    guard = Guard.of("127.0.0.1")
    assert guard.check("/", OWN_HEADERS) is None
    assert guard.check("/", {**OWN_HEADERS, "origin": "http://localhost:8080"}) is None
    for origin in (
        "https://evil.example",
        "http://localhost:9999",
        "null",
        "http://localhost:8080.evil.example",
    ):
        refused = guard.check("/", {**OWN_HEADERS, "origin": origin})
        assert refused is not None and refused.status_code == 403
    rebound = guard.check("/", {"host": "evil.example:8080", "origin": "http://evil.example:8080"})
    assert rebound is not None and rebound.status_code == 403


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
        assert refused is not None and refused.status_code == 401
    opened = guard.check(f"/?token={guard.token}", headers)
    assert (
        opened is not None
        and opened.status_code == 303
        and guard.token in opened.headers["Set-Cookie"]
    )
    assert guard.check("/", {**headers, "cookie": f"{COOKIE}={guard.token}"}) is None


def test_real_server_refuses_before_anything_is_shown() -> None:
    server = start_server(Guard("127.0.0.1", "secret-token"), 0)
    try:
        port = server.get_port()

        def get(path: str, **headers: str) -> http.client.HTTPResponse:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            answer.close()  # a server that stops waits for pages that are open
            return answer

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


def unpacked(frame: bytes) -> tuple[list[dict[str, Any]], list[bytes]]:
    """Messages and arrays of a frame, as a page reads it."""
    head = 16
    packed = int.from_bytes(frame[8:head], "little")
    window = msgpack.decode(ZstdDecompressor().decompress(frame[head : head + packed]))
    at = head + packed
    arrays = []
    for length in window["binaryBufferLengths"]:
        at += -at % 8
        arrays.append(frame[at : at + length])
        at += length
    assert at == len(frame)
    return window["messages"], arrays


def test_messages_are_packed_as_viser_packs_them() -> None:
    array = np.arange(12.0, dtype=np.float32).reshape(2, 2, 3)
    updates: list[dict[str, Any]] = [
        {"content": "<b>ü</b>", "visible": True, "order": 1.5, "count": 3},
        {"points": array, "scale": 2.0},
        {"points": array.swapaxes(0, 2), "colors": np.zeros((1, 3), np.uint8)},
        {"scale": (1.0, 2.0, 3.0), "points": array},
        {"points": np.arange(3, dtype=np.uint8)},
        {"value": np.float64(0.5)},
        {"value": None},
    ]
    messages: list[Message] = [_messages.RunJavascriptMessage("f();")]
    for update in updates:
        messages.append(_messages.GuiUpdateMessage("widget", update))
        messages.append(_messages.SceneNodeUpdateMessage("/node", update))
    expected: list[memoryview] = []
    by_viser = [message.as_serializable_dict(expected) for message in messages]
    packed, arrays = unpacked(_frame(messages, ZstdCompressor(level=1)))
    assert packed == msgpack.decode(msgpack.encode(by_viser))
    assert arrays == [buffer.tobytes() for buffer in expected]


def test_properties_of_a_node_are_one_message_and_what_viser_would_keep() -> None:
    server = start_server()
    arrows = server.scene.add_arrows("/arrows", np.zeros((1, 2, 3)), np.zeros((1, 3), np.uint8))
    sent: list[Any] = []
    interface: Any = server._websock_server
    interface.queue_message = sent.append
    points = np.ones((2, 2, 3), np.float32)
    colors = np.full((2, 3), 7, np.uint8)
    assign(arrows, {"points": points, "colors": colors, "scale": (1.0, 2.0, 3.0)})
    assert len(sent) == 1 and list(sent[0].updates) == ["points", "colors", "scale"]
    assert arrows.scale == (1.0, 2.0, 3.0) and (arrows.colors == colors).all()
    # What viser would cast, or has elsewhere, goes its way.
    assign(arrows, {"points": np.zeros((1, 2, 3)), "visible": False, "position": np.ones(3)})
    assert arrows.points.dtype == np.float32 and arrows.points.shape == (1, 2, 3)
    assert not arrows.visible and (arrows.position == 1.0).all() and len(sent) == 4
    stop_server(server)


class Heard:
    """A page that notes the scripts of each frame that comes."""

    def __init__(self, server: viser.ViserServer) -> None:
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        url = f"ws://127.0.0.1:{server.get_port()}"
        self._socket = connect(url, subprotocols=[protocol], max_size=None)
        self._frames: list[list[str]] = []
        camera = {"wxyz": (1.0, 0.0, 0.0, 0.0), "position": (1.0, 1.0, 1.0), "fov": 1.0}
        size = {"near": 0.1, "far": 9.0, "image_height": 60, "image_width": 80}
        ways = {"look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 0.0, 1.0)}
        message = {"type": "ViewerCameraMessage", **camera, **size, **ways}
        self._socket.send(msgpack.encode(message))
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        for frame in self._socket:
            assert isinstance(frame, bytes)
            sources = [message.get("source") for message in unpacked(frame)[0]]
            self._frames.append([source for source in sources if source is not None])

    def frames(self, last: str) -> list[list[str]]:
        """The scripts of each frame with some, until one came with this script."""
        end_s = time.monotonic() + 30.0
        while time.monotonic() < end_s:
            frames = [frame for frame in self._frames if frame]
            if frames and last in frames[-1]:
                self._frames.clear()
                return frames
            time.sleep(0.02)
        raise AssertionError(f"{last} did not come")

    def close(self) -> None:
        """Leave."""
        self._socket.close()


@pytest.fixture
def page() -> Iterator[tuple[viser.ViserServer, viser.ClientHandle, Heard]]:
    """A server, one of its pages, and what that hears."""
    server = start_server()
    came = threading.Event()

    async def note(_client: viser.ClientHandle) -> None:
        came.set()

    server.on_client_connect(note)
    heard = Heard(server)
    assert came.wait(30.0)
    yield server, next(iter(server.get_clients().values())), heard
    heard.close()
    stop_server(server)


def on_loop(server: viser.ViserServer, act: Callable[[], None]) -> None:
    """Call a function on the loop of a server."""

    async def run() -> None:
        act()

    asyncio.run_coroutine_threadsafe(run(), server.get_event_loop()).result(30.0)


@pytest.mark.parametrize("is_busy", [False, True])
def test_groups_come_in_their_order_and_stay_together(
    page: tuple[viser.ViserServer, viser.ClientHandle, Heard], is_busy: bool
) -> None:
    server, client, heard = page
    outbox = Outbox(client)
    transport = outbox._websocket.transport
    waiting = transport.get_write_buffer_size
    written: list[bytes] = []
    write = transport.write

    def noted(data: bytes) -> None:
        written.append(data)
        write(data)

    def tell() -> None:
        transport.write = noted
        if is_busy:
            transport.get_write_buffer_size = lambda: 1
        run_script(client.gui, "before")
        with outbox:
            run_script(client.gui, "a")
            client.gui._websock_interface.queue_message(_messages.RunJavascriptMessage("by viser"))
            run_script(client.gui, "b")
        with outbox:
            run_script(client.gui, "c")
        with outbox:
            pass
        assert len(written) == 0, "nothing is written before all groups are told"
        outbox.send()
        assert len(written) == (not is_busy)
        transport.get_write_buffer_size = waiting

    on_loop(server, tell)
    frames = heard.frames("c")
    told = ["before", "a", "by viser", "b"]
    assert frames == ([[*told, "c"]] if is_busy else [told, ["c"]])
    # What is told from another thread, or beside groups, comes as well.
    threading.Thread(target=run_script, args=(client.gui, "thread")).start()
    assert heard.frames("thread") == [["thread"]]
    on_loop(server, lambda: run_script(client.gui, "alone"))
    assert heard.frames("alone") == [["alone"]]


def test_a_group_is_told_as_far_as_it_came_where_that_failed(
    page: tuple[viser.ViserServer, viser.ClientHandle, Heard],
) -> None:
    server, client, heard = page
    outbox = Outbox(client)

    def tell() -> None:
        with pytest.raises(ZeroDivisionError), outbox:
            run_script(client.gui, "a")
            raise ZeroDivisionError
        outbox.send()
        run_script(client.gui, "b")

    on_loop(server, tell)
    assert list(chain(*heard.frames("b"))) == ["a", "b"]


def test_inputs_are_heard_at_once_and_a_bad_one_ends_nothing(
    page: tuple[viser.ViserServer, viser.ClientHandle, Heard],
) -> None:
    server, client, heard = page
    outbox = Outbox(client)
    slider = client.gui.add_slider("force", 0.0, 10.0, 0.1, 1.0)
    values: list[float] = []
    faults: list[Any] = []
    server.get_event_loop().set_exception_handler(lambda _loop, about: faults.append(about))

    @slider.on_update
    async def changed(event: Any) -> None:
        values.append(event.target.value)

    assert outbox._websocket.finlab_client is client
    for value in (2.0, "no number", 3):
        heard._socket.send(
            msgpack.encode(
                {"type": "GuiUpdateMessage", "uuid": slider._impl.uuid, "updates": {"value": value}}
            )
        )
    on_loop(server, lambda: run_script(client.gui, "heard"))
    heard.frames("heard")
    end_s = time.monotonic() + 30.0
    while len(values) < 2 and time.monotonic() < end_s:
        time.sleep(0.02)
    assert values == [2.0, 3.0] and len(faults) == 1


def test_a_loop_wakes_itself_for_other_threads_alone() -> None:
    server = start_server()
    loop: Any = server.get_event_loop()
    woken: list[int] = []
    wake = loop._write_to_self
    loop._write_to_self = lambda: (woken.append(threading.get_ident()), wake())
    called = threading.Event()

    async def call_itself() -> int:
        before = len(woken)
        loop.call_soon_threadsafe(called.set)
        return len(woken) - before

    assert asyncio.run_coroutine_threadsafe(call_itself(), loop).result(30.0) == 0
    assert called.wait(30.0) and woken == [threading.get_ident()]
    stop_server(server)


def test_icons_of_a_page_are_viser_s_own_from_one_archive(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Any] = []

    class Counted(ZipFile):
        def __init__(self, path: Any) -> None:
            opened.append(path)
            super().__init__(path)

    monkeypatch.setattr(viser_internals, "ZipFile", Counted)
    names: list[Any] = ["anchor", "fish", "ripple"]
    icon = _icons.svg_from_icon.__wrapped__
    expected = [icon(name) for name in names]
    with icons_at_hand():
        assert [icon(name) for name in names] == expected
    assert len(opened) == 1 and all("<svg" in text for text in expected)
