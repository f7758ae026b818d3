"""Lessons: each opens unsolved, can be solved as it says, and gives back what was there before."""

from collections.abc import Callable
from dataclasses import replace
from html import unescape

import pytest

from finlab.allocation import Allocation, Allocator
from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.stand_in import turn_fin
from webapp.panels.cards import guide_card
from webapp.session import Session
from webapp.session.lessons import LESSONS, TOUR, Stop
from webapp.session.looking import DRAWERS
from webapp.session.state import State


def _answer(state: State) -> Allocation:
    """The answer to a state."""
    allocator = Allocator(state.layout, state.method)
    return allocator.allocate(state.target, lost=state.lost, policy=state.policy)


def _turn_a_shaft(session: Session) -> None:
    """Turn the first fin of a session's robot."""
    name = session.state.layout.names[0]
    turn_fin(session, name, session.state.layout.fins[0].mounting_angle + 1.2)


SOLVED: dict[str, Callable[[Session], object]] = {
    "two-ways": lambda session: session.show_mode(1),
    "refinement": lambda session: session.show_step(1, 9),
    "temperature": lambda session: session.set_setting("temperature", 2.0),
    "watts-or-effort": lambda session: session.keep_least("watts"),
    "null-space": lambda session: (session.shift(0, 3.0), session.show_mode(2)),
    "lost-fin": lambda session: session.toggle_loss("front_left"),
    "no-yaw": _turn_a_shaft,
    "out-of-reach": lambda session: session.set_setting("policy", "direction"),
    "jets": lambda session: session.set_jets(True),
    "learned-physics": lambda session: session.set_setting("method", "paper"),
}
"""What a student does."""


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.name)
def test_a_lesson_is_unsolved_until_its_exercise_is_done(lesson: Stop) -> None:
    session = Session(load_layout("penta"))
    session.guide.open(lesson.name)
    assert session.guide.stop is lesson and lesson.drawer in DRAWERS[session.desk.task]
    session.guide.take(_answer(session.state))
    assert not session.guide.solved
    SOLVED[lesson.name](session)
    session.guide.take(_answer(session.state))
    assert session.guide.solved
    session.show_mode(0)
    session.step = None
    session.guide.take(_answer(session.state))
    assert session.guide.solved, "once done, done"


def test_the_robot_that_cannot_turn_is_asked_to_turn() -> None:
    session = Session(load_layout("penta"))
    session.guide.open("no-yaw")
    answer = _answer(session.state)
    assert "Tz" in session.state.layout.axes and not answer.reachable
    _turn_a_shaft(session)
    assert _answer(session.state).reachable


def test_wrong_ways_do_not_count() -> None:
    session = Session(load_layout("penta"))
    session.guide.open("lost-fin")
    for fin in ("front_left", "back_right", "front_right"):  # one fin alone turns nothing
        session.toggle_loss(fin)
    session.guide.take(_answer(session.state))
    assert not session.guide.solved
    session.guide.open("out-of-reach")
    session.set_setting("policy", "direction")
    session.guide.take(_answer(replace(session.state, target=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))))
    assert not session.guide.solved


def test_closing_gives_back_what_was_there_and_next_goes_on_to_the_end() -> None:
    session = Session(load_layout("penta"))
    session.set_target(1, 0.5)
    session.select("bow")
    session.set_display("dark", True)
    session.show_drawer("Reach")

    def all_there_is() -> tuple[object, ...]:
        return (
            session.state,
            session.display,
            session.desk,
            session.selected,
            session.history.undo_name,
        )

    before = all_there_is()
    session.guide.open(LESSONS[0].name)
    session.set_display("dark", False)
    stops = [session.guide.stop]
    while session.guide.stop is not None:
        session.guide.go(1)
        stops.append(session.guide.stop)
    assert stops == [*LESSONS, None] and all_there_is() == before


def test_tour_and_lesson_end_each_other() -> None:
    session = Session(load_layout("penta"))
    before = session.state
    session.guide.tour()
    session.guide.open("two-ways")
    assert session.guide.stop is LESSONS[0]
    session.guide.tour()
    assert session.guide.stop is TOUR[0]
    session.guide.end()
    assert session.state == before


@pytest.mark.parametrize("start", [LESSONS[0], TOUR[0]], ids=lambda stop: stop.name)
def test_a_robot_that_was_made_meanwhile_is_there_by_undo(start: Stop) -> None:
    session = Session(load_layout("penta"))
    session.set_target(1, 0.5)
    mine = session.state
    word = "tour" if start in TOUR else "lesson"
    session.guide.open(start.name)
    session.new_layout("thruster")
    session.add("thruster")
    made = session.state
    assert start.title in session.guide.reminder and word in session.guide.reminder
    session.guide.go(1)
    assert session.state != made and session.undo().startswith("Open ")
    assert session.state == made
    session.redo()
    session.guide.go(-1)
    assert session.undo().startswith("Open ") and session.undo().startswith("Open ")
    assert session.state == made
    session.guide.end()
    assert session.state == mine and session.history.undo_name == f"Close the {word}"
    while session.state.layout != made.layout:
        session.undo()
    while session.history.undo_name != "Ask for Fy":
        session.undo()
    assert session.state == mine and session.guide.reminder == ""


def test_starting_over_in_a_lesson_keeps_the_work_before_it() -> None:
    session = Session(load_layout("penta"))
    session.set_target(1, 0.5)
    mine = session.state
    session.guide.open(LESSONS[0].name)
    session.start_over()
    assert session.undo() == "Start over" and session.state == mine


def test_unknown_lessons_are_refused() -> None:
    with pytest.raises(FinlabError, match="lesson: expected one of wrench, .*got 'sailing'"):
        Session(load_layout("A")).guide.open("sailing")


def test_the_card_says_what_to_do_and_praises_what_is_done() -> None:
    for lesson in LESSONS:
        cards = [unescape(guide_card(lesson, solved)) for solved in (False, True)]
        assert all(lesson.exercise in card for card in cards)
        assert [lesson.praise in card for card in cards] == [False, True]
    assert "Finish" in guide_card(LESSONS[-1], True)
