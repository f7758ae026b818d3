"""Arrow keys move the selected actuators; a key that is held is one step of undo."""

import math

import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from webapp.panels.nudging import step_m, steps_of
from webapp.session import Session


def test_a_nudge_moves_all_selected_from_where_they_are(session: Session) -> None:
    before = session.state.layout
    session.select("front_left")
    session.select_also("back_right")
    session.nudge((0.01, 0.0, -0.02))
    for name in before.names:
        x, y, z = before.actuator(name).position
        expected = (x + 0.01, y, z - 0.02) if name in session.selection else (x, y, z)
        assert session.state.layout.actuator(name).position == pytest.approx(expected)
    assert session.history.undo_name == "Move 2 actuators"


def test_each_key_is_a_step_of_undo_and_a_held_one_is_one(session: Session) -> None:
    session.select("front_left")
    start = session.state.layout
    session.nudge((0.01, 0.0, 0.0))
    session.nudge((0.01, 0.0, 0.0), held=True)
    session.nudge((0.01, 0.0, 0.0), held=True)
    between = session.state.layout
    session.nudge((0.0, 0.01, 0.0))
    assert len(session.history.past) == 2
    session.undo()
    assert session.state.layout == between
    session.undo()
    assert session.state.layout == start


def test_a_twin_goes_along_mirrored(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    session.select("front_left")
    session.nudge((0.0, 0.02, 0.01))
    x, y, z = session.state.layout.actuator("front_left").position
    assert session.state.layout.actuator("front_right").position == pytest.approx((x, -y, z))


def test_nothing_selected_is_said(session: Session) -> None:
    with pytest.raises(FinlabError, match="no actuator is selected"):
        session.nudge((0.01, 0.0, 0.0))


def test_steps_add_up_without_rounding_errors(session: Session) -> None:
    session.select("front_left")
    x, y, z = session.state.layout.actuator("front_left").position
    for _ in range(30):
        session.nudge((0.01, 0.0, 0.0), held=True)
    assert session.state.layout.actuator("front_left").position == (round(x + 0.3, 7), y, z)


@pytest.mark.parametrize("key", ["", "1 0", "1 0 x", "1 0 0 0", "101 0 0", "1.5 0 0", "9" * 4000])
def test_what_is_no_step_is_refused(key: str) -> None:
    with pytest.raises(FinlabError, match="three numbers of steps"):
        steps_of(key)


def test_steps_fit_the_robot() -> None:
    assert steps_of("1 0 -2") == (1, 0, -2)
    assert step_m(load_layout("ucat")) == 0.01
    assert math.isclose(step_m(load_layout("catamaran")), 0.02, abs_tol=0.011)
