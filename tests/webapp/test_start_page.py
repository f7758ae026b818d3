"""The start page: what it holds, what its choices do, and where it stays away."""

import gzip
import re
from collections.abc import Callable
from typing import Any
from urllib.request import Request, urlopen

import pytest
import viser

from finlab.allocation import Allocator
from finlab.cli import main
from finlab.errors import FinlabError
from tests.webapp.stand_in import until
from tests.webapp.test_app import app, on_loop, server, view
from webapp.panels.commands import page_commands
from webapp.panels.menu import menu
from webapp.session import Session
from webapp.session.files import shipped
from webapp.session.lessons import LESSONS, TOUR
from webapp.session.state import FIRST_POLICY, State
from webapp.start_page import DOORS, ROBOTS, SENTENCE, start_page
from webapp.tasks.designs import changed_words
from webapp.view import View
from webapp.viser_internals import start_server, stop_server

__all__ = ["app", "server", "view"]

LARGEST = 120_000
"""Bytes that the start page may add to the page at most."""


def test_it_has_a_sentence_three_doors_and_six_pictures_and_is_small() -> None:
    page = start_page().decode()
    assert SENTENCE in page and len(re.findall(r"[.?!](?:\s|$)", SENTENCE)) == 1
    assert [door.title for door in DOORS] == ["Design mine", "Show me", "Open a file or log"]
    sizes = re.findall(
        r"<img src='data:image/webp;base64,[^']+' width='(\d+)' height='(\d+)'", page
    )
    assert len(sizes) == 6 and set(sizes) == {("320", "200")}, "no picture moves what stands below"
    assert len(page) < LARGEST


@pytest.mark.parametrize("name", ROBOTS)
def test_each_robot_gives_what_it_is_asked_for_at_first(name: str) -> None:
    example = ROBOTS[name]
    state = State(shipped()[name], target=example.target, speed=example.speed)
    flow = {} if state.flow is None else {"flow": state.flow}
    assert Allocator(state.layout).allocate(state.target, **flow).reachable


@pytest.mark.parametrize("encoding", ["gzip", "identity"])
def test_it_comes_before_the_script_of_the_viewer(encoding: str) -> None:
    server = start_server(start_page=start_page())
    request = Request(
        f"http://127.0.0.1:{server.get_port()}/", headers={"Accept-Encoding": encoding}
    )
    with urlopen(request) as answer:
        body = answer.read()
        page = gzip.decompress(body) if answer.headers["Content-Encoding"] == "gzip" else body
    stop_server(server)
    assert page.count(b"id='fl-start'") == 1
    assert page.index(b"id='fl-start'") < page.index(b"<script data-p") < page.index(b'id="root"')


def test_its_choices_do_what_they_say(server: viser.ViserServer, view: View) -> None:
    session = view.session
    start, _ = view.page.presses._acts["start"]

    def choose(key: str) -> None:
        on_loop(server, lambda: view.do(lambda: start(key, "")))
        until(lambda: on_loop(server, lambda: view.is_settled))

    choose("robot ucat")
    assert session.has_started and session.history.undo_name is None, "it is there already"
    for name, example in ROBOTS.items():
        choose(f"robot {name}")
        assert session.state.layout == session.saved == shipped()[name]
        assert session.state.target == example.target and session.state.speed == example.speed
    choose("tour")
    assert session.guide.stop == TOUR[0]
    session.guide.end()
    assert session.state.layout == shipped()["torpedo"], "the robot from before"
    with pytest.raises(FinlabError, match="start page: expected one of"):
        start("robot <b>", "")


def test_a_link_to_a_robot_opens_it_once(server: viser.ViserServer, view: View) -> None:
    linked, _ = view.page.presses._acts["robot-link"]
    on_loop(server, lambda: view.do(lambda: linked("fish", "")))
    assert view.session.state.layout.name == "fish"
    on_loop(server, lambda: view.do(view.session.undo))
    on_loop(server, lambda: view.do(lambda: linked("fish", "")))
    assert view.session.state.layout.name == "ucat", "a reload goes on with the work"


def test_commands_and_menu_reach_lessons_tour_and_start_page(view: View) -> None:
    labels = [command.label for command in page_commands(view.page)]
    markup = menu("Duplicate", None, shipped()["ucat"], "dual")
    assert "Start page" in labels and "Start page" in markup
    for stop in (*LESSONS, *TOUR):
        assert any(stop.title in label for label in labels) and f"{stop.title}<" in markup
    for word in ("New", "Open", "Save", "Share", "Undo: Duplicate", "Redo", "Method: dual"):
        assert f"{word}<" in markup
    assert "px4" not in markup, "a method that does not take fins"


def test_escape_lets_go_of_the_selection_and_then_closes_the_tour(
    server: viser.ViserServer, view: View
) -> None:
    session = view.session
    escape: Callable[[], object] = next(
        command.act for command in page_commands(view.page) if command.key == "escape"
    )
    on_loop(server, session.guide.tour)
    session.select("front_left")
    on_loop(server, escape)
    assert session.selected is None and session.guide.stop is not None
    on_loop(server, escape)
    assert session.guide.stop is None


def test_the_theme_follows_the_system_until_one_is_chosen(session: Session) -> None:
    session.follow_system(True)
    assert session.display.dark
    session.follow_system(False)
    assert not session.display.dark
    session.toggle("dark")
    session.follow_system(False)
    assert session.display.dark, "what the user has chosen stays"


def test_another_robot_begins_with_the_first_policy_and_a_method_that_takes_it(
    session: Session,
) -> None:
    session.set_setting("policy", "priority")
    session.set_setting("method", "mdn")
    before = session.state
    session.open_layout(shipped()["bluerov2"])
    assert (session.state.policy, session.state.method) == (FIRST_POLICY, "dual")
    words = changed_words(before, session.state)
    assert "mdn" in words and "priority" in words
    session.set_setting("method", "px4")
    before = session.state
    session.open_layout(shipped()["bluerov2_heavy"])
    assert session.state.method == "px4" and changed_words(before, session.state) == ""
    session.undo()
    assert session.state.layout == shipped()["bluerov2"]


def test_the_length_of_arrows_is_held_to_its_range(session: Session) -> None:
    session.set_display("arrow_length", 2)
    assert session.display.arrow_length == 2.0
    for wrong in (0.0, 100.0, float("nan"), "long"):
        with pytest.raises(FinlabError, match="arrow length"):
            session.set_display("arrow_length", wrong)


@pytest.mark.parametrize("words", [[], ["--layout", "A"]])
def test_the_command_opens_the_start_page_unless_a_robot_is_named(
    words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    served: dict[str, Any] = {}
    monkeypatch.setattr("webapp.serving.serve", lambda **asked: served.update(asked))
    main(["app", *words])
    assert served["layout"] == (words[1] if words else None)
