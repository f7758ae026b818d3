"""Several fins selected and changed in one step, names, limits, models, order, locks."""

import math

import pytest

from finlab.errors import FinlabError
from finlab.layout import FinModelSpec, load_layout
from webapp.panels.actuator_list import actuator_list
from webapp.session import Session
from webapp.session.actuator_edits import modelled

FRONT = ("front_right", "front_left")


def fin(session: Session, name: str):  # type: ignore[no-untyped-def]
    layout = session.state.layout
    return layout.fins[layout.index(name)]


def choose(session: Session, *names: str) -> None:
    session.select(names[0])
    for name in names[1:]:
        session.select_also(name)


def test_selection_grows_and_shrinks(session: Session) -> None:
    choose(session, "back_left", "front_right")
    assert session.selection == ("front_right", "back_left") and session.selected == "front_right"
    session.select_also("front_left")
    assert session.selected == "front_left" and set(session.selection) == {*FRONT, "back_left"}
    session.select_also("back_left")
    assert session.selection == FRONT
    choose(session, *session.state.layout.names)
    with pytest.raises(FinlabError, match="these are all actuators"):
        session.delete()
    session.select(None)
    assert session.selection == () and session.selected is None


def test_what_changes_counts_for_all_selected_in_one_step(session: Session) -> None:
    choose(session, *FRONT)
    session.place_selected((0.2, *fin(session, "front_left").position[1:]))
    assert [fin(session, name).position for name in FRONT] == [(0.2, -0.1502, 0.0), (0.2, 0.1502, 0.0)]
    session.history.end_merge()
    session.set_value("amplitude", (0.1, 0.5))
    session.choose_model("lighthill")
    session.set_value("width", 0.12)
    session.turn_selected(math.radians(45))
    for name in FRONT:
        changed = fin(session, name)
        assert changed.limits.amplitude == (0.1, 0.5) and changed.limits.frequency == (0.1, 2.1)
        assert changed.model == FinModelSpec("lighthill", (("width", 0.12),))
        assert changed.mounting_angle == pytest.approx(math.pi / 4)
    assert fin(session, "back_left") == load_layout("ucat").fins[2]
    assert len(session.history.past) == 5
    assert (
        session.history.past[1][0] == "Amplitude of 2 actuators"
        and session.history.past[3][0] == "Width of 2 actuators"
    )
    for _ in range(5):
        session.undo()
    assert session.state.layout == load_layout("ucat")


def test_usual_values_are_not_written_and_shared_ones_stay(session: Session) -> None:
    session.select("front_right")
    session.set_value("density", 1025.0)
    session.set_value("area", 0.03)
    session.choose_model("lighthill")
    assert fin(session, "front_right").model == FinModelSpec("lighthill", (("density", 1025.0),))
    session.set_value("density", 1000.0)
    assert fin(session, "front_right").model == FinModelSpec("lighthill")
    with pytest.raises(FinlabError, match="comes from a file"):
        modelled(fin(session, "front_right"), "table")


@pytest.mark.parametrize(
    ("act", "says"),
    [
        (lambda s: s.set_value("amplitude", (0.5, 0.2)), "minimum 0.5 is above maximum 0.2"),
        (lambda s: s.set_value("frequency", (0.0, 0.0)), "maximum must be at least"),
        (lambda s: s.set_value("zero_direction", (-4.0, 4.0)), "one turn"),
        (lambda s: s.set_value("area", -0.1), "must lie within"),
        (lambda s: s.set_value("area", float("nan")), "must lie within"),
        (lambda s: s.place_selected((55.0, 0.0, 0.0)), "x of front_right"),
        (lambda s: s.rename("front_right", "front_left"), "there is an actuator 'front_left' already"),
        (lambda s: s.rename("front_right", "  "), "name"),
        (lambda s: s.rename("front_right", "x" * 65), "name"),
        (lambda s: s.rename("nobody", "x"), "has no fin"),
    ],
)
def test_what_makes_no_sense_is_refused_and_changes_nothing(session: Session, act, says: str) -> None:  # type: ignore[no-untyped-def]
    session.select("front_right")
    before = session.state
    with pytest.raises(FinlabError, match=says):
        act(session)
    assert session.state == before


def test_a_renamed_fin_keeps_its_damage_link_and_selection(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    session.select("front_left")
    session.toggle_failure("front_left")
    session.rename("front_left", " bow <b> ")
    state = session.state
    assert state.failed == ("bow <b>",) and ("bow <b>", "front_right") in state.links
    assert session.selected == "bow <b>"
    assert "<b>" not in actuator_list(state, session.selection).split("<table>")[1].split("bow")[1][:12]
    session.undo()
    assert session.selected == "front_left" and session.state.failed == ("front_left",)


def test_linked_fins_that_are_both_selected_move_once(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    choose(session, *FRONT)
    session.place_selected((0.2, 0.2, 0.0))
    assert fin(session, "front_left").position == (0.2, 0.2, 0.0)
    assert fin(session, "front_right").position == (0.2, -0.2, 0.0)
