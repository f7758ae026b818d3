"""Markup is made in one way: what is put into it is escaped once, and nothing of our own is."""

import re
from dataclasses import replace
from typing import Any

import viser

from finlab.layout import load_layout
from tests.webapp.test_app import app, on_loop, server, until, view
from webapp.handles import put
from webapp.markup.html import html
from webapp.panels.frame import View
from webapp.session.looking import DRAWERS

__all__ = ["app", "server", "view"]

EVIL = "<img src=x onerror=alert(1)>'\"&amp;"
ESCAPED = re.compile(r"&(lt|amp);")


def contents(server: viser.ViserServer) -> list[str]:
    """All markup on the page."""
    containers = server.gui._container_handle_from_uuid.values()
    handles = [handle for container in containers for handle in container._children.values()]
    return [handle.content for handle in handles if isinstance(handle, viser.GuiHtmlHandle)]


def test_what_is_put_into_markup_is_escaped_once() -> None:
    inner = html("<b title='{}'>{:.1f}</b>", EVIL, 2.345)
    whole = str(html("<p>{}{}{}</p>", inner, EVIL, [inner, EVIL]))
    assert whole.count("<b title=") == 2 and "<img" not in whole and "2.3</b>" in whole
    assert whole.count("&lt;img") == 4 and "&amp;lt;" not in whole


def test_text_that_is_not_marked_is_shown_as_text() -> None:
    handle: Any = type("Handle", (), {"content": ""})()
    put(handle, content=EVIL)
    assert handle.content.startswith("&lt;img") and type(handle.content) is str
    put(handle, content=html("<b>{}</b>", 1))
    assert handle.content == "<b>1</b>" and type(handle.content) is str


def test_no_page_shows_markup_of_ours_as_text(server: viser.ViserServer, view: View) -> None:
    for task in DRAWERS:
        on_loop(server, lambda task=task: view.do(lambda: view.session.show_task(task)))
        on_loop(server, lambda: view.do(lambda: view.session.select("front_left")))
        until(lambda: not view.busy and not view.jobs.analyst.busy)
        found = [ESCAPED.finditer(text) for text in contents(server)]
        wrong = {text.string[max(0, text.start() - 60) : text.end() + 30] for part in found for text in part}
        assert wrong == set(), task


def test_no_page_takes_names_for_markup(server: viser.ViserServer, view: View) -> None:
    layout = view.session.state.layout.replace_actuator("front_left", name=EVIL[:40])
    evil = replace(layout, name=EVIL[:40], description=EVIL)
    for task in DRAWERS:
        on_loop(server, lambda: view.do(lambda: view.session.open_layout(evil)))
        on_loop(server, lambda task=task: view.do(lambda: view.session.show_task(task)))
        for chosen in (EVIL[:40], None):
            on_loop(server, lambda chosen=chosen: view.do(lambda: view.session.select(chosen)))
            until(lambda: not view.busy and not view.jobs.analyst.busy)
            texts = contents(server)
            assert any("&lt;img" in text for text in texts)
            assert not any("<img" in text or "&amp;lt;" in text for text in texts)
    assert load_layout("ucat").names != evil.names
