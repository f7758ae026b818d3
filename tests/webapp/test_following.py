"""Pages that follow another one show what it shows, change nothing, and can be taken over."""

import asyncio
import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.stand_in import SilentClient, load_stand_in
from webapp.guard import COOKIE, Guard
from webapp.panels.following import banner, lecture_sign
from webapp.session import Display, Session
from webapp.session.following import TAKEN_OVER, Follower, Scene
from webapp.tasks.following import CODE_LENGTH, Lectures
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver
from webapp.view import View
from webapp.viser_internals import start_server, stop_server


class Room:
    """Pages of one server that can follow each other, each on a viser server of its own."""

    def __init__(self) -> None:
        self._servers: list[Any] = []
        self._pools = Pools()
        self._solver = Solver(load=load_stand_in)
        self._lectures = Lectures()
        self._first = start_server()
        self._loop = self._first.get_event_loop()
        self._servers.append(self._first)

    def page(self, name: str = "ucat", session: Session | None = None) -> View:
        """One more page."""
        server = start_server()
        self._servers.append(server)
        client: Any = SilentClient(server)
        session = session or Session(load_layout(name), Display(frozen=True))
        return self.on_loop(
            lambda: View(client, session, self._solver, self._pools, self._loop, self._lectures)
        )

    def on_loop(self, act: Callable[[], Any]) -> Any:
        """Call something on the loop of all pages."""

        async def run() -> Any:
            return act()

        return asyncio.run_coroutine_threadsafe(run(), self._loop).result(30)

    def do(self, view: View, act: Callable[[], object]) -> None:
        """What a user does on a page."""
        self.on_loop(lambda: view.do(act))

    def press(self, view: View, kind: str, key: str = "") -> None:
        """A word of the page's own markup is pressed."""
        number = self.on_loop(lambda: view.page.presses._last) + 1
        message = json.dumps([[number, kind, key, ""]])
        self.on_loop(lambda: view.page.presses.read(message))

    def settle(self, *views: View) -> None:
        """Wait until all is answered and drawn."""
        end = time.monotonic() + 60
        while not self.on_loop(lambda: all(view.is_settled for view in views)):
            assert time.monotonic() < end
            time.sleep(0.01)

    def close(self) -> None:
        """All servers stop."""
        self._pools.stop()
        for server in self._servers:
            stop_server(server)


@pytest.fixture(scope="module")
def room() -> Iterator[Room]:
    """A server for all tests here."""
    room = Room()
    yield room
    room.close()


def lecture_of(room: Room, teacher: View) -> str:
    """The code of a page that lets others follow."""
    code: str = room.on_loop(teacher.page.following.let_follow)
    assert len(code) == CODE_LENGTH
    return code


def test_a_page_shows_what_the_followed_one_shows(room: Room) -> None:
    teacher, pupil = room.page("ucat"), room.page("B")
    code = lecture_of(room, teacher)
    room.press(pupil, "follow", code.lower())
    room.settle(teacher, pupil)
    assert pupil.session.state is teacher.session.state
    session = teacher.session
    for act in (
        lambda: session.set_target(0, 2.5),
        lambda: session.toggle_loss("front_left"),
        lambda: session.show_task("Design"),
        lambda: session.select("back_right"),
        lambda: session.open_layout(load_layout("octo")),
        lambda: session.show_drawer("Null space"),
        lambda: session.undo(),
        lambda: session.guide.open("lost-fin"),
    ):
        room.do(teacher, act)
        room.settle(teacher, pupil)
        assert Scene.of(pupil.session) == Scene.of(session)
        assert pupil.shown_allocation is teacher.shown_allocation, "it is answered once"
    assert "You follow" in banner(**facts(room, pupil, "follows", "is_followed_open"))
    room.do(teacher, session.guide.end)
    room.on_loop(teacher.close)
    room.on_loop(pupil.close)


def facts(room: Room, view: View, *names: str) -> dict[str, Any]:
    """Some facts of a page."""
    known = room.on_loop(lambda: view.board.facts)
    return {name: known[name] for name in names}


def test_a_page_that_follows_changes_nothing_and_can_be_made_ones_own(room: Room) -> None:
    teacher, pupil = room.page("ucat"), room.page("B")
    own = pupil.session.state
    room.do(pupil, lambda: pupil.session.set_target(1, 0.5))
    own_work = pupil.session.state
    code = lecture_of(room, teacher)
    room.press(pupil, "follow", code)
    room.settle(teacher, pupil)
    notes: Any = pupil.client
    notes.notes.clear()
    room.do(pupil, lambda: pupil.session.set_target(0, 9.0))
    room.press(pupil, "task", "Design")
    room.settle(teacher, pupil)
    assert Scene.of(pupil.session) == Scene.of(teacher.session)
    assert notes.notes and all("Make it mine" in note for note in notes.notes)
    notes.notes.clear()
    room.press(pupil, "look", "Top")
    assert notes.notes == [], "the camera is the own one"
    taught = teacher.session.state
    room.press(pupil, "mine")
    room.settle(teacher, pupil)
    session = pupil.session
    assert session.state is taught and session.history.undo_name == TAKEN_OVER
    room.do(pupil, lambda: session.set_target(0, 9.0))
    assert teacher.session.state is taught and session.state.target[0] == 9.0
    room.do(teacher, lambda: teacher.session.set_target(0, 4.0))
    room.settle(teacher, pupil)
    assert session.state.target[0] == 9.0, "it follows no longer"
    session.undo()
    session.undo()
    assert session.state is own_work
    session.undo()
    assert session.state is own
    assert facts(room, teacher, "follower_count") == {"follower_count": 0}
    room.on_loop(teacher.close)
    room.on_loop(pupil.close)


def test_a_teacher_who_leaves_is_told_and_found_again(room: Room) -> None:
    teacher, pupil = room.page("ucat"), room.page("B")
    code = lecture_of(room, teacher)
    room.press(pupil, "follow", code)
    room.settle(teacher, pupil)
    assert facts(room, teacher, "lecture_code", "follower_count") == {
        "lecture_code": code,
        "follower_count": 1,
    }
    room.on_loop(teacher.close)
    room.settle(pupil)
    words = banner(**facts(room, pupil, "follows", "is_followed_open"))
    assert "has left" in words and "Make it mine" in words
    again = room.page(session=teacher.session)
    room.do(again, lambda: again.session.set_target(2, 1.0))
    room.settle(again, pupil)
    assert pupil.session.state is again.session.state
    assert "You follow" in banner(**facts(room, pupil, "follows", "is_followed_open"))
    room.press(again, "end-lecture")
    room.settle(again, pupil)
    assert "has left" in banner(**facts(room, pupil, "follows", "is_followed_open"))
    assert lecture_sign(**facts(room, again, "lecture_code", "follower_count")) == ""
    room.on_loop(again.close)
    room.on_loop(pupil.close)


def test_a_page_that_goes_while_it_follows_keeps_its_own_work(room: Room) -> None:
    teacher, pupil = room.page("ucat"), room.page("B")
    own = pupil.session.state
    room.press(pupil, "follow", lecture_of(room, teacher))
    room.settle(teacher, pupil)
    assert pupil.session.state is not own
    room.on_loop(pupil.close)
    assert pupil.session.state is own and not pupil.session.history.past
    room.on_loop(teacher.close)


def test_a_code_that_nobody_has_and_the_own_one_are_refused(room: Room) -> None:
    teacher = room.page("ucat")
    client: Any = teacher.client
    client.notes.clear()
    room.press(teacher, "follow", "NOBODY")
    assert "no page to follow with the code 'NOBODY'" in client.notes[-1]
    room.press(teacher, "follow", lecture_of(room, teacher))
    assert "this is the page with that code" in client.notes[-1]
    room.do(teacher, lambda: teacher.session.set_target(0, 3.0))
    assert teacher.session.state.target[0] == 3.0, "it is not locked"
    room.on_loop(teacher.close)


def test_a_follower_puts_everything_back() -> None:
    session = Session(load_layout("ucat"))
    session.select("front_left")
    session.show_drawer("Reach")
    session.set_display("drawn", "forces")
    before = {key: getattr(session, key) for key in ("state", "desk", "display", "saved")}
    other = Session(load_layout("bluerov2_heavy"))
    other.set_display("frozen", True)
    follower = Follower(session)
    follower.show(Scene.of(other))
    assert session.state is other.state and session.display.frozen and session.selection == ()
    follower.end()
    assert {key: getattr(session, key) for key in before} == before
    assert session.selection == ("front_left",) and not session.history.past


def test_codes_are_kept_and_unlike() -> None:
    lectures = Lectures()
    sessions = [Session(load_layout("pair")) for _ in range(5)]
    codes = [lectures.begin(session).code for session in sessions]
    assert len(set(codes)) == 5
    assert lectures.begin(sessions[2]).code == codes[2]
    assert lectures.find(f" {codes[3].lower()} ").session is sessions[3]
    lectures.end(lectures.find(codes[3]))
    with pytest.raises(FinlabError, match="no page to follow"):
        lectures.find(codes[3])


def test_the_token_is_taken_from_an_address_and_the_code_is_kept() -> None:
    guard = Guard("0.0.0.0", "secret")
    headers = {"host": "robot:8080"}
    sent = guard.check("/?token=secret&follow=ABC234", headers)
    assert sent is not None and sent.headers["Location"] == "/?follow=ABC234"
    assert COOKIE in sent.headers["Set-Cookie"]
    plain = guard.check("/?token=secret", headers)
    assert plain is not None and plain.headers["Location"] == "/"
    odd = guard.check("/?token=secret&follow=%0d%0aSet-Cookie:x=1", headers)
    assert odd is not None and "\n" not in odd.headers["Location"]
