"""What a browser sends is read beside the event loop: no page waits for it, and it ends in time."""

import base64
import time
import zlib
from collections.abc import Iterator
from functools import partial

import pytest
import viser

from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.test_app import app, on_loop, server, until, view
from webapp.panels.frame import View
from webapp.session.files import packed
from webapp.tasks import readers as readers_module
from webapp.tasks import reading
from webapp.tasks.readers import Readers

__all__ = ["app", "server", "view"]


@pytest.fixture(scope="module")
def readers() -> Iterator[Readers]:
    readers = Readers()
    readers.read(int)
    yield readers
    readers.stop()


def link(text: str) -> str:
    """A design link that unpacks to a text."""
    return "y" + base64.urlsafe_b64encode(zlib.compress(text.encode(), 9)).decode().rstrip("=")


def test_what_takes_too_long_is_ended(readers: Readers, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(readers_module, "READ_S", 0.5)
    begin = time.monotonic()
    with pytest.raises(FinlabError, match=r"more than 0\.5 s, and was ended"):
        readers.read(partial(time.sleep, 60.0))
    assert time.monotonic() - begin < 10.0


def test_what_takes_too_much_memory_is_refused(readers: Readers) -> None:
    with pytest.raises(FinlabError, match="too much memory"):
        readers.read(partial(bytearray, 10**11))


def test_what_ends_the_process_is_refused(readers: Readers) -> None:
    import os

    with pytest.raises(FinlabError, match="reading failed"):
        readers.read(partial(os._exit, 1))


def test_a_fault_of_ours_is_told_as_such(readers: Readers) -> None:
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        readers.read(partial(divmod, 1, 0))


@pytest.mark.parametrize(
    "text",
    ["a: " + "1:" * 400_000 + "1", "[" * 100_000, "&a [*a]", "x: 1\n" * 300_000, "a: " + "9" * 900_000],
    ids=["base sixty", "deep", "circle", "repeated", "number"],
)
def test_hostile_links_leave_the_page_quick(
    server: viser.ViserServer, view: View, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(readers_module, "READ_S", 5.0)
    before = view.session.state.layout
    on_loop(server, lambda: view.do(partial(view.designs.open_link, link(text))))
    slowest, end = 0.0, time.monotonic() + 30.0
    while not view.client.notes and time.monotonic() < end:
        begin = time.monotonic()
        on_loop(server, lambda: None)
        slowest = max(slowest, time.monotonic() - begin)
        time.sleep(0.01)
    assert len(view.client.notes) == 1 and view.client.notes[0].startswith("Not possible: ")
    assert view.session.state.layout == before and slowest < 1.0


def test_an_honest_link_opens_beside_hostile_ones(server: viser.ViserServer, view: View) -> None:
    for _ in range(reading.MOST_WAITING - 1):
        on_loop(server, lambda: view.do(partial(view.designs.open_link, link("[" * 50_000))))
    on_loop(server, lambda: view.do(partial(view.designs.open_link, packed(load_layout("octo")))))
    until(lambda: view.session.state.layout.name == "octo")


def test_a_page_has_few_files_read_at_once(server: viser.ViserServer, view: View) -> None:
    found: list[int] = []

    def ask() -> None:
        for _ in range(reading.MOST_WAITING + 3):
            view.do(lambda: view.reading.read(int, found.append))

    on_loop(server, ask)
    assert sum("being read; wait" in note for note in view.client.notes) == 3
    until(lambda: view.reading._waiting == 0)
    assert found == [0] * reading.MOST_WAITING and len(view.client.notes) == 3


def test_what_has_a_kind_waits_its_turn(server: viser.ViserServer, view: View) -> None:
    found: list[int] = []

    def ask() -> None:
        for _ in range(reading.MOST_WAITING):
            view.do(lambda: view.reading.make(partial(time.sleep, 0.05), lambda _: found.append(0)))
        for count in range(1, 9):
            view.do(lambda count=count: view.reading.make(lambda: count, found.append, "save"))

    on_loop(server, ask)
    until(lambda: sorted(found) == [0] * reading.MOST_WAITING + [8])  # of the saves the newest
    assert view.client.notes == []
