"""What a browser sends is read beside the event loop: no page waits for it, and it ends in time."""

import base64
import time
import zlib
from functools import partial

import pytest
import viser

from tests.webapp.test_app import app, on_loop, server, until, view
from webapp.panels.frame import View

__all__ = ["app", "server", "view"]


def link(text: str) -> str:
    """A design link that unpacks to a text."""
    return "y" + base64.urlsafe_b64encode(zlib.compress(text.encode(), 9)).decode().rstrip("=")


@pytest.mark.parametrize(
    "text",
    ["a: " + "1:" * 400_000 + "1", "[" * 100_000, "&a [*a]", "x: 1\n" * 300_000, "a: " + "9" * 900_000],
    ids=["base sixty", "deep", "circle", "repeated", "number"],
)
def test_hostile_links_leave_the_page_quick(server: viser.ViserServer, view: View, text: str) -> None:
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


def test_what_waits_gives_way_to_a_newer_one_of_its_kind(server: viser.ViserServer, view: View) -> None:
    found: list[int] = []

    def ask() -> None:
        view.do(lambda: view.context.make(partial(time.sleep, 0.05), lambda _: found.append(0), "open"))
        for count in range(1, 9):
            view.do(lambda count=count: view.context.make(lambda: count, found.append, "save"))

    on_loop(server, ask)
    until(lambda: found == [0, 8])
    assert view.client.notes == []
