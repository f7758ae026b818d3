"""Files on their way from a page: what was announced is what is taken, and nothing is kept for ever."""

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest
from viser import _messages

from tests.webapp.loops import in_loop
from webapp import uploads
from webapp.uploads import Uploads

MOST = 1000
"""Largest file of these tests [bytes]."""


class Sender:
    """One page with one button, whose messages are made by hand."""

    def __init__(self) -> None:
        """Nothing has been sent."""
        self.files: list[tuple[str, bytes]] = []
        self.refused: list[str] = []
        self.acknowledged: list[Any] = []
        handlers: dict[type, list[Any]] = {}
        interface = SimpleNamespace(_incoming_handlers=handlers, queue_message=self.acknowledged.append)
        gui: Any = SimpleNamespace(_websock_interface=interface)
        self.uploads = Uploads(gui, MOST, self.refused.append)
        button: Any = SimpleNamespace(_impl=SimpleNamespace(uuid="button"))
        self.uploads.on(button, lambda name, content: self.files.append((name, content)))
        self._handlers = handlers

    def begin(self, size: Any, parts: Any, key: str = "a", button: str = "button") -> None:
        """Announce a file."""
        kind = _messages.FileTransferStartUpload
        self._handlers[kind][0](0, kind(button, key, f"{key}.csv", "text/csv", parts, size))

    def part(self, index: int, content: Any, key: str = "a") -> None:
        """Send a part of it."""
        kind = _messages.FileTransferPart
        self._handlers[kind][0](0, kind("button", key, index, content))

    @property
    def kept(self) -> int:
        """Bytes that are held for this page."""
        return sum(len(upload.content) for upload in self.uploads._own())


@in_loop
async def test_a_file_comes_in_its_parts() -> None:
    sender = Sender()
    sender.begin(10, 2)
    sender.part(0, b"hello")
    assert sender.files == [] and sender.kept == 5
    sender.part(1, b"there")
    assert sender.files == [("a.csv", b"hellothere")] and sender.kept == 0 and sender.refused == []
    assert [ack.transferred_bytes for ack in sender.acknowledged] == [5, 10]
    sender.begin(0, 0, "empty")
    assert sender.files[1:] == [("empty.csv", b"")]


@pytest.mark.parametrize("size, parts", [(MOST + 1, 1), (-1, 1), (2**70, 1), (5, 0), (0, 1), (5, 6), (5, -1)])
@in_loop
async def test_what_is_announced_wrongly_is_not_begun(size: int, parts: int) -> None:
    sender = Sender()
    sender.begin(size, parts)
    sender.part(0, b"hello")
    assert sender.files == [] and sender.kept == 0 and len(sender.refused) == 1


@in_loop
async def test_what_makes_no_sense_is_not_heard() -> None:
    sender = Sender()
    for size, parts in ((float("nan"), 1), (1.0, 1), (None, 1), ("5", 1), (5, True)):
        sender.begin(size, parts)
    sender.begin(5, 1, button="another")
    sender.part(0, b"hello")
    assert sender.files == sender.refused == [] and sender.kept == 0


@pytest.mark.parametrize(
    "parts",
    [
        [(0, b"x" * 600)],
        [(0, b"x"), (1, b"x" * 500)],
        [(1, b"x")],
        [(0, b"x"), (0, b"x")],
        [(0, b"x"), (1, b"x"), (2, b"x")],
        [(0, "text")],
        [(0, [0] * 9)],
        [(-1, b"x")],
    ],
)
@in_loop
async def test_parts_are_held_against_what_was_announced(parts: list[tuple[int, Any]]) -> None:
    sender = Sender()
    sender.begin(500, 3)
    for index, content in parts:
        sender.part(index, content)
    sender.part(1, b"more")
    assert sender.files == [] and sender.kept == 0
    assert len(sender.refused) == 1 and "otherwise than announced" in sender.refused[0]


@in_loop
async def test_a_page_sends_few_files_at_once() -> None:
    sender = Sender()
    for k in range(100):
        sender.begin(MOST, 2, f"{k}")
        sender.part(0, b"x" * 900, f"{k}")
    assert sender.kept <= uploads.MOST_AT_ONCE * MOST
    sender.uploads.close()
    assert sender.kept == 0


@in_loop
async def test_all_pages_together_hold_no_more_than_so_much(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "MOST_IN_ALL", 2500)
    senders = [Sender() for _ in range(5)]
    for sender in senders:
        sender.begin(MOST, 2)
        sender.part(0, b"x" * 900)
    assert sum(sender.kept for sender in senders) <= 2500
    assert [len(sender.refused) for sender in senders] == [1, 1, 1, 0, 0]
    senders[4].part(1, b"x" * 100)
    assert len(senders[4].files) == 1
    for sender in senders:
        sender.uploads.close()


@in_loop
async def test_a_file_that_never_comes_whole_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "SILENCE_S", 0.05)
    sender = Sender()
    sender.begin(10, 2)
    sender.part(0, b"hello")
    await asyncio.sleep(0.2)
    assert sender.kept == 0 and "never came whole" in sender.refused[0]
    sender.part(1, b"there")
    assert sender.files == []
