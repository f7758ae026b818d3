"""Pages, files and names that no honest page would send: nothing breaks, all is refused or
escaped."""

import asyncio
import base64
import math
import re
import time
import types
import zlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import chain
from types import SimpleNamespace
from typing import Any

import pytest
import viser

from finlab.errors import FinlabError
from tests.webapp.test_app import app, on_loop, server, until, view
from webapp.handles import set_properties
from webapp.markup.words import html
from webapp.session import files
from webapp.session.looking import DRAWERS
from webapp.tasks.designs import Opening
from webapp.view import View

__all__ = ["app", "server", "view"]

GARBAGE: tuple[Any, ...] = (
    math.nan,
    math.inf,
    None,
    [],
    {},
    "<script>alert(1)</script>",
    2**63,
    -1e308,
    (math.nan,) * 3,
    (1e308,) * 3,
    (math.inf, math.nan),
    (1,),
    (),
    ("a", "b", "c"),
    True,
    b"\xff",
    "x" * 100_000,
    [math.nan] * 3,
    {"a": 1},
)
"""Values that no widget sends."""


def taken(handle: Any, value: Any) -> bool:
    """Put a value into an input as viser does with one from a page: cast to its type, if it can
    be."""
    now = handle._impl.value
    try:
        if isinstance(now, tuple):
            handle._impl.value = (
                tuple(type(now[0])(part) for part in value) if now else tuple(value)
            )
        else:
            handle._impl.value = type(now)(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


def test_garbage_from_the_page_changes_nothing_but_raises_no_fault(
    server: viser.ViserServer, view: View, capsys: pytest.CaptureFixture[str]
) -> None:
    view.session.select("front_left")
    before = view.session.state.layout
    containers = server.gui._container_handle_from_uuid.values()
    handles = list(chain.from_iterable(container._children.values() for container in containers))
    heard = 0
    for handle in handles:
        if isinstance(handle, viser.GuiUploadButtonHandle):
            continue  # viser makes these values itself
        for listen in getattr(handle._impl, "update_cb", ()):
            for value in GARBAGE:
                if not taken(handle, value):
                    continue
                event = types.SimpleNamespace(client=view.client, target=handle)
                asyncio.run_coroutine_threadsafe(listen(event), server.get_event_loop()).result(30)
                heard += 1
    assert heard > 500
    session = view.session
    kept = repr((session.state, session.display, session.draft, session.swim))
    assert "alert" not in kept and "xxx" not in kept and "=nan" not in kept
    states = [step.state for step in view.session.history.past]
    assert any(set(before.names) <= set(state.layout.names) for state in states), (
        "buttons may well add fins"
    )
    assert "Traceback" not in capsys.readouterr().err
    assert not any("fault" in note for note in view.client.notes)
    # A budget that was set is refused where actuators act on each other, and that is said.
    on_loop(server, lambda: view.do(lambda: view.session.set_power(None)))
    on_loop(server, lambda: view.do(lambda: view.session.set_target(0, 0.7)))
    until(lambda: not view.busy)
    assert view.shown_allocation is not None and view.shown_allocation.target[0] == 0.7


def link(text: str) -> str:
    """A design link that unpacks to a text."""
    return "y" + base64.urlsafe_b64encode(zlib.compress(text.encode(), 9)).decode().rstrip("=")


@pytest.mark.parametrize(
    "text",
    [
        "a: " + "1:" * 400_000 + "1",
        "[" * 100_000,
        "&a [*a]",
        "x: 1\n" * 300_000,
        "a: " + "9" * 900_000,
    ],
    ids=["base sixty", "deep", "circle", "repeated", "number"],
)
def test_hostile_links_leave_the_page_quick(
    server: viser.ViserServer, view: View, text: str
) -> None:
    before = view.session.state.layout
    on_loop(server, lambda: view.do(partial(view.designs.open_link, link(text))))
    slowest = 0.0
    end = time.monotonic() + 30.0
    while not view.client.notes and time.monotonic() < end:
        begin = time.monotonic()
        on_loop(server, lambda: None)
        slowest = max(slowest, time.monotonic() - begin)
        time.sleep(0.01)
    assert len(view.client.notes) == 1 and view.client.notes[0].startswith("Not possible: ")
    assert view.session.state.layout == before and slowest < 1.0


def test_what_waits_gives_way_to_a_newer_one_of_its_kind(
    server: viser.ViserServer, view: View
) -> None:
    found: list[int] = []

    def ask() -> None:
        view.do(
            lambda: view.deferred.make(partial(time.sleep, 0.05), lambda _: found.append(0), "open")
        )
        for count in range(1, 9):
            view.do(lambda count=count: view.deferred.make(lambda: count, found.append, "save"))

    on_loop(server, ask)
    until(lambda: sorted(found) == [0, 1, 8])
    assert view.client.notes == []


class Taken:
    """What came to whom."""

    def __init__(self) -> None:
        """Two takers."""
        self.files: list[tuple[str, str, bytes]] = []
        self.heard: dict[str, Callable[[str, str], object]] = {}
        presses: Any = SimpleNamespace(on=lambda kind, act: self.heard.update({kind: act}))
        self.opening = Opening(presses)
        self.opening.add(".csv,.txt", self._taker("fin"))
        self.opening.add(".yaml,.zip", self._taker("design"))

    def _taker(self, who: str) -> Callable[[str, bytes], object]:
        return lambda name, content: self.files.append((who, name, content))


def test_each_file_goes_to_whom_it_is_for() -> None:
    taken = Taken()
    for name, content in (("A.YAML", b"a"), ("cell.csv", b"A,f,phi,Fx\n")):
        taken.opening.open(name, content)
    assert [who for who, *_ in taken.files] == ["design", "fin"]
    assert taken.opening.suffixes == ".csv,.txt,.yaml,.zip"


@pytest.mark.parametrize("name", ["notes.docx", "robot", ".yaml", "robot.yaml.exe", ""])
def test_what_cannot_be_opened_is_told_with_what_can(name: str) -> None:
    with pytest.raises(
        FinlabError, match=r"cannot be opened; expected a design \(YAML, JSON, ZIP\)"
    ):
        Taken().opening.open(name, b"")


def test_several_files_at_once_are_refused() -> None:
    with pytest.raises(FinlabError, match="one ZIP archive"):
        Taken().heard["dropped"]("", "")


HOSTILE_TEXT = "<img src=x onerror=alert(1)>'\"&amp;"
"""A text that would run as a script where it is not escaped."""
ESCAPED = re.compile(r"&(lt|amp);")
"""A character that was escaped."""


def contents(server: viser.ViserServer) -> list[str]:
    """All markup on the page."""
    containers = server.gui._container_handle_from_uuid.values()
    handles = chain.from_iterable(container._children.values() for container in containers)
    return [handle.content for handle in handles if isinstance(handle, viser.GuiHtmlHandle)]


def test_what_is_put_into_markup_is_escaped_once() -> None:
    inner = html("<b title='{}'>{:.1f}</b>", HOSTILE_TEXT, 2.345)
    whole = str(html("<p>{}{}{}</p>", inner, HOSTILE_TEXT, [inner, HOSTILE_TEXT]))
    assert whole.count("<b title=") == 2 and "<img" not in whole and "2.3</b>" in whole
    assert whole.count("&lt;img") == 4 and "&amp;lt;" not in whole


def test_text_that_is_not_marked_is_shown_as_text() -> None:
    handle: Any = type("Handle", (), {"content": ""})()
    set_properties(handle, content=HOSTILE_TEXT)
    assert handle.content.startswith("&lt;img") and type(handle.content) is str
    set_properties(handle, content=html("<b>{}</b>", 1))
    assert handle.content == "<b>1</b>" and type(handle.content) is str


def test_no_page_shows_markup_of_ours_as_text(server: viser.ViserServer, view: View) -> None:
    for task in DRAWERS:
        on_loop(server, lambda task=task: view.do(lambda: view.session.show_task(task)))
        on_loop(server, lambda: view.do(lambda: view.session.select("front_left")))
        until(lambda: not view.busy and not view.jobs.analyst.busy)
        wrong = set[str]()
        for text in contents(server):
            for match in ESCAPED.finditer(text):
                wrong.add(text[max(0, match.start() - 60) : match.end() + 30])
        assert wrong == set(), task


def test_no_page_takes_names_for_markup(server: viser.ViserServer, view: View) -> None:
    layout = view.session.state.layout.replace_actuator("front_left", name=HOSTILE_TEXT[:40])
    evil = replace(
        layout, name=HOSTILE_TEXT[:40], description=f"{HOSTILE_TEXT}<script>alert(2)</script>"
    )
    evil = files.read_layout("robot.yaml", files.layout_file(evil)[1]).layout
    for task in DRAWERS:
        on_loop(server, lambda: view.do(lambda: view.session.open_layout(evil)))
        on_loop(server, lambda task=task: view.do(lambda: view.session.show_task(task)))
        for chosen in (HOSTILE_TEXT[:40], None):
            on_loop(server, lambda chosen=chosen: view.do(lambda: view.session.select(chosen)))
            until(lambda: not view.busy and not view.jobs.analyst.busy)
            texts = contents(server)
            assert any("&lt;img" in text for text in texts)
            assert not any(re.search("<img|<script|&amp;lt;", text) for text in texts)
    on_loop(server, lambda: view.do(lambda: view.session.toggle_loss(HOSTILE_TEXT[:40])))
    assert view.session.state.lost == (HOSTILE_TEXT[:40],)
