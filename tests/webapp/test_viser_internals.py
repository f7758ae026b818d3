"""What is put in place of viser's private parts gives what viser gives; strangers stay out."""

import asyncio
import gzip
import http.client
import threading
from http.client import HTTPConnection
from itertools import chain
from typing import Any
from urllib.request import Request, urlopen
from zipfile import ZipFile

import numpy as np
import pytest
import viser
from viser import _icons, _messages
from viser.infra._async_message_buffer import AsyncMessageBuffer
from viser.infra._messages import Message
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from webapp import viser_internals
from webapp.guard import COOKIE, Guard, is_loopback
from webapp.viser_internals import assign, hold_uploads, icons_at_hand, start_server, stop_server


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


def test_updates_are_packed_as_viser_packs_them() -> None:
    server = start_server()  # from now on
    array = np.arange(12.0, dtype=np.float32).reshape(2, 2, 3)
    updates: list[dict[str, Any]] = [
        {"content": "<b>ü</b>", "visible": True, "order": 1.5, "count": 3},
        {"points": array, "scale": 2.0},
        {"points": array.swapaxes(0, 2), "colors": np.zeros((1, 3), np.uint8)},
        {"scale": (1.0, 2.0, 3.0), "points": array},
        {"value": np.float64(0.5)},
        {"value": None},
    ]
    for kind in (_messages.GuiUpdateMessage, _messages.SceneNodeUpdateMessage):
        for update in updates:
            message = kind("/node", update)
            message.redundancy_key()
            buffers: list[memoryview] = []
            expected: list[memoryview] = []
            packed = message.as_serializable_dict(buffers)
            assert packed == Message.as_serializable_dict(message, expected)
            assert [buffer.tobytes() for buffer in buffers] == [e.tobytes() for e in expected]
    stop_server(server)


def test_properties_of_a_node_are_one_message_and_what_viser_would_keep() -> None:
    server = start_server()
    arrows = server.scene.add_arrows("/arrows", np.zeros((1, 2, 3)), np.zeros((1, 3), np.uint8))
    sent: list[Any] = []
    arrows._impl.api._queue_scene_message = sent.append  # type: ignore[method-assign]
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


def test_messages_to_one_page_come_in_their_order_and_groups_stay_together() -> None:
    stop_server(start_server())  # from now on
    loop = asyncio.new_event_loop()

    async def heard() -> list[list[str]]:
        buffer = AsyncMessageBuffer(loop, persistent_messages=False, max_window_size=3)
        windows: list[list[str]] = []

        async def listen() -> None:
            async for window in buffer.window_generator(0):
                windows.append([message.source for message in window])  # type: ignore[attr-defined]

        listening = loop.create_task(listen())
        await asyncio.sleep(0.0)
        for word in "abcd":
            buffer.push(_messages.RunJavascriptMessage(word))
        await asyncio.sleep(0.01)
        buffer.atomic_start()
        buffer.push(_messages.RunJavascriptMessage("e"))
        await asyncio.sleep(0.01)
        buffer.push(_messages.RunJavascriptMessage("f"))
        buffer.atomic_end()
        await asyncio.sleep(0.01)
        thread = threading.Thread(
            target=buffer.push, args=(_messages.RunJavascriptMessage("from a thread"),)
        )
        thread.start()
        await asyncio.wait_for(loop.run_in_executor(None, thread.join), 30.0)
        await asyncio.sleep(0.01)
        buffer.set_done()
        await asyncio.wait_for(listening, 30.0)
        return windows

    windows = loop.run_until_complete(heard())
    loop.close()
    assert windows == [["a", "b", "c"], ["d"], ["e", "f"], ["from a thread"]]


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
