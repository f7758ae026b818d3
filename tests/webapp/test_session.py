"""The session: checked intents, undo by steps that make sense, nothing lost on refusal."""

import math

import numpy as np
import pytest

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.stand_in import turn_fin
from webapp.markup.answer import wrench_bars
from webapp.session import Session


@pytest.fixture
def session() -> Session:
    """A session of robot A."""
    return Session(load_layout(shipped_layouts()["A"]))


def test_a_drag_is_one_step_of_undo(session: Session) -> None:
    name = session.state.layout.names[0]
    start = session.state
    for k in range(20):
        session.drag(name, (0.2 + 0.001 * k, -0.15, 0.0))
    session.end_drag(name, (0.22, -0.15, 0.0))
    assert session.state.layout.fins[0].position[0] == pytest.approx(0.22)
    assert session.undo() == f"Move {name}"
    assert session.state == start
    assert session.redo() == f"Move {name}"
    assert session.state.layout.fins[0].position[0] == pytest.approx(0.22)


def test_slider_steps_merge_only_in_quick_succession(session: Session) -> None:
    now = 0.0
    session.history._clock = lambda: now
    session.select(session.state.layout.names[0])
    for angle in (1.0, 1.1):
        session.turn_selected(angle)
    now = 5.0
    session.turn_selected(1.2)
    session.history.end_merge()  # as before every typed value
    session.turn_selected(1.3)
    for angle in (1.2, 1.1):
        session.undo()
        assert session.state.layout.mounting_angle[0] == pytest.approx(angle)
    session.undo()
    with pytest.raises(FinlabError, match="nothing to undo"):
        session.undo()


def test_undo_takes_back_what_was_done_last_robot_or_question(session: Session) -> None:
    name = session.state.layout.names[0]
    acts = {
        "Ask for Fx": lambda: session.set_target(0, 1.5),
        f"Fail {name}": lambda: session.toggle_loss(name),
        "Ask for: Dive": lambda: session.set_preset("Dive"),
        "Policy priority": lambda: session.set_setting("policy", "priority"),
        "Method qp": lambda: session.set_setting("method", "qp"),
        "Speed through the water": lambda: session.set_speed(1.0),
        "Temperature": lambda: session.set_setting("temperature", 0.5),
    }
    states = [session.state]
    for act in acts.values():
        act()
        states.append(session.state)
    for step, before in zip(reversed(acts), reversed(states[:-1]), strict=True):
        assert session.undo() == step and session.state == before
    for step, after in zip(acts, states[1:], strict=True):
        assert session.redo() == step and session.state == after


def test_a_drag_of_a_wrench_slider_is_one_step_however_slow(session: Session) -> None:
    now = 0.0
    session.history._clock = lambda: now
    start = session.state
    for value in range(300):
        now += 3.0
        session.set_target(0, 0.01 * value)
    session.history.end_merge()  # the next drag begins
    session.set_target(0, 9.0)
    assert session.undo() == "Ask for Fx" and session.state.target[0] == 2.99
    assert session.undo() == "Ask for Fx" and session.state == start
    assert session.history.undo_name is None


def test_a_way_along_the_null_space_is_a_step(session: Session) -> None:
    session.shift(0, 1.0)
    session.shift(0, 2.0)
    session.shift(1, 0.5)
    session.set_target(0, 1.5)
    assert session.shifts == (), "another question has another null space"
    session.undo()
    assert session.shifts == (2.0, 0.5) and session.mode == 1
    assert session.undo() == "Null space 2" and session.shifts == (2.0,)
    assert session.undo() == "Null space 1" and session.shifts == () and session.mode == 0
    assert session.redo() == "Null space 1" and session.shifts == (2.0,)


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e13, "1", None, True])
def test_bad_targets_change_nothing(session: Session, value: object) -> None:
    before = session.state
    revision = session.revision
    with pytest.raises(FinlabError, match="Fx"):
        session.set_target(0, value)
    assert session.state == before and session.revision == revision


def test_bad_settings_change_nothing(session: Session) -> None:
    before = session.state
    for key, value in (("temperature", -1.0), ("method", "guess"), ("layout", 3.0)):
        with pytest.raises(FinlabError):
            session.set_setting(key, value)
    for key, value in (("drawn", "1 km"), ("frozen", math.nan)):
        with pytest.raises(FinlabError):
            session.set_display(key, value)
    with pytest.raises(FinlabError, match="no fin"):
        session.end_drag("nobody", (0.0, 0.0, 0.0))
    with pytest.raises(FinlabError, match=r"y of"):
        session.end_drag(session.state.layout.names[0], (0.0, math.nan, 0.0))
    assert session.state == before


def test_all_may_fail_but_the_last_cannot_go(session: Session) -> None:
    for name in session.state.layout.names:
        session.toggle_loss(name)
    assert session.state.lost == session.state.layout.names
    session.toggle_loss(session.state.layout.names[3])
    for name in session.state.layout.names[:3]:
        session.select(name)
        session.delete()
    assert session.state.lost == ()
    session.select(session.state.layout.names[0])
    with pytest.raises(FinlabError, match="only actuator"):
        session.delete()


def test_mirror_duplicate_add_and_selection(session: Session) -> None:
    with pytest.raises(FinlabError, match="no actuator is selected"):
        session.mirror()
    session.add("fin")
    added = session.selected
    assert added is not None
    with pytest.raises(FinlabError, match="mirror plane"):
        session.mirror()
    session.end_drag(added, (-0.1, 0.2, 0.05))
    turn_fin(session, added, 2.0)
    session.mirror()
    twin = session.state.layout.fins[-1]
    assert twin.position == (-0.1, -0.2, 0.05) and twin.mounting_angle == pytest.approx(-2.0)
    session.duplicate()
    session.duplicate()
    assert session.state.layout.n_fins == 8
    session.undo()
    assert session.selected is None, "a fin that is gone is not selected"


def test_nothing_is_selected_of_another_robot(session: Session) -> None:
    session.select("back_left")
    session.rename("back_left", "stern")
    assert session.selected == "stern", "it is called otherwise"
    session.open_layout(load_layout("A"))
    assert session.state.layout.n == 4 and session.selected is None


def test_next_fin_goes_round(session: Session) -> None:
    seen = []
    for _ in range(5):
        session.select_next()
        seen.append(session.selected)
    assert seen == [*session.state.layout.names, session.state.layout.names[0]]


def test_starting_over_is_as_at_first_sight_and_can_be_undone(session: Session) -> None:
    first = session.state
    session.open_layout(load_layout(shipped_layouts()["B"]))
    session.start_over()
    assert session.state == first and session.saved == first.layout, (
        "nothing of it counts as edited"
    )
    session.undo()
    assert session.state.layout.name == "B"


def test_undo_to_a_robot_as_it_was_opened_is_no_edit(session: Session) -> None:
    session.new_layout("thruster")
    assert session.state.layout in session.kept
    session.rename_robot("mine")
    assert session.state.layout not in session.kept
    session.saved = session.state.layout  # what saving does
    assert session.state.layout in session.kept
    session.undo()
    assert session.state.layout in session.kept, "as it was begun"
    session.undo()
    assert session.state.layout in session.kept, "the robot before it, which nobody has touched"
    session.redo()
    session.rename_robot("another")
    assert session.state.layout not in session.kept


@pytest.mark.parametrize("value", [-1.0, float("nan"), "warm"])
def test_settings_have_the_ranges_of_their_method(value: object) -> None:
    session = Session(load_layout("A"))
    session.set_setting("method", "paper")
    with pytest.raises(FinlabError, match="temperature: expected a"):
        session.set_setting("temperature", value)
    session.set_setting("temperature", 0.5)
    assert session.state.temperature == 0.5


def test_an_axis_is_freed_and_commanded_again() -> None:
    session = Session(load_layout("bluerov2"))
    session.toggle_axis(2)
    assert session.state.layout.axes == ("Fx", "Fy", "Tx", "Tz")
    session.toggle_axis(4)
    assert session.state.layout.axes == ("Fx", "Fy", "Tx", "Ty", "Tz")
    session.undo()
    session.undo()
    assert session.state.layout == load_layout("bluerov2")
    for axis in (0, 1, 2, 3):
        session.toggle_axis(axis)
    with pytest.raises(FinlabError, match="at least one axis"):
        session.toggle_axis(5)


def test_bars_say_which_axes_are_free() -> None:
    bars = wrench_bars([1.0, 0.0, 0.0, 0.0, np.nan, 0.0], [1.0, 0.0, 0.0, 0.0, 0.3, 0.0])
    assert bars.count("free") == 1 and "nan" not in bars
