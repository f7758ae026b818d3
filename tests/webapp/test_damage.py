"""Weak and stuck fins: what is asked for, what comes of it, and what is kept of it."""

import math

import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.layout.damage import FAULTS, Health
from tests.webapp.stand_in import load_stand_in
from webapp.markup.answer import fin_table
from webapp.markup.words import damage_words
from webapp.panels.files_tab import command_line
from webapp.session import Session
from webapp.session.search_request import SearchRequest
from webapp.session.swim_plan import SwimSettings
from webapp.session.targets import axis_reach, full_thrust
from webapp.tasks.solver import Solver

UCAT = load_layout("ucat")


def test_a_weak_and_a_stuck_fin_keep_to_what_is_left(session: Session) -> None:
    session.damage("front_left", "weak", 0.5)
    session.damage("back_left", "stuck", math.radians(30))
    state = session.state
    reply = Solver(load=load_stand_in).reply(state)
    command = reply.answer.command
    whole = UCAT.fins[1].limits.upper
    assert command[1, 0] <= 0.5 * whole[0] + 1e-9 and command[1, 1] <= 0.5 * whole[1] + 1e-9
    assert command[2, 2] == pytest.approx(math.radians(30))
    assert (axis_reach(state.able) < axis_reach(state.layout)).any()
    assert full_thrust(state.able)[1] < full_thrust(state.layout)[1]
    table = fin_table(state.layout, state.health, reply.answer, full_thrust(state.able), None)
    assert "weak 50 %" in table and "stuck at 30°" in table
    assert damage_words(state.health, "front_right") == ""
    assert state.layout == UCAT, "the layout itself stays whole"
    line = command_line(state)
    assert "--health front_left=0.5" in line and "--stuck back_left=30" in line


def test_damage_is_mended_undone_and_goes_with_its_fin(session: Session) -> None:
    session.damage("front_left", "weak", 0.5)
    session.damage("front_left", "weak", 0.3)
    session.damage("front_left", "stuck", 1.0)
    session.toggle_failure("front_left")
    session.mend("front_left")
    assert session.state.health is None and session.state.failed == ()
    session.undo()
    session.undo()
    assert session.state.health == Health((("front_left", 0.3),), (("front_left", 1.0),))
    session.damage("front_left", "stuck", None)
    assert session.state.health == Health((("front_left", 0.3),))
    session.select("front_left")
    session.delete()
    assert session.state.health is None
    session.undo()
    session.mend_all()
    assert session.state.health is None


VALUES = {"weak": 0.5, "thrust": 0.5, "stuck": 0.3, "running": (0.3, 1.0, 0.2)}


@pytest.mark.parametrize("robot", ["ucat", "torpedo", "catamaran", "bluerov2"])
def test_every_actuator_has_the_faults_of_its_type_and_no_others(robot: str) -> None:
    session = Session(load_layout(robot))
    for part in session.state.layout.actuators:
        for kind, value in VALUES.items():
            if kind in FAULTS[part.type]:
                session.damage(part.name, kind, value)
                assert dict(getattr(session.state.health, kind))[part.name] == value
            else:
                with pytest.raises(FinlabError, match="fault of"):
                    session.damage(part.name, kind, value)
            assert session.state.able.names == session.state.layout.names
    name, known = session.state.layout.names[0], session.state.health
    session.rename(name, "other")
    assert known is not None and session.state.health is not None
    assert [n for n, _ in session.state.health.weak].count("other") == [n for n, _ in known.weak].count(name)
    session.mend_all()
    assert session.state.health is None


def test_a_fin_that_runs_on_is_not_stuck_as_well(session: Session) -> None:
    session.damage("front_left", "stuck", 0.3)
    session.damage("front_left", "running", (0.3, 1.0, 0.2))
    assert session.state.health == Health(running=(("front_left", (0.3, 1.0, 0.2)),))
    assert "--running front_left=0.3,1,11.4592" in command_line(session.state)


def test_the_page_may_send_anything(session: Session) -> None:
    before = session.state
    for share in (math.nan, 0.0, 2.0, "much", True):
        with pytest.raises(FinlabError):
            session.damage("front_left", "weak", share)
    for angle in (math.nan, math.inf, 9.0, "up"):
        with pytest.raises(FinlabError):
            session.damage("front_left", "stuck", angle)
    with pytest.raises(FinlabError, match="nobody"):
        session.damage("nobody", "weak", 0.5)
    for key, value in (
        *(("path", "nowhere"), ("scenario", "hexa"), ("announced", "no"), ("method", "nobody")),
        *(("speed", wrong) for wrong in (math.nan, 0.0, "2", 99.0)),
    ):
        with pytest.raises(FinlabError, match=key):
            session.set_swim(key, value)
    draft = session.draft
    for change in (
        lambda: draft.with_goal("<b>"),
        lambda: draft.with_way((math.nan, 0.0, 0.0, 0.0)),
        lambda: draft.with_way((0.0, 0.0, 0.0, 900.0)),
    ):
        with pytest.raises(FinlabError):
            change()
    assert session.state == before and session.draft == SearchRequest() and session.swim == SwimSettings()


def test_a_plan_is_made_of_the_settings(session: Session) -> None:
    settings = SwimSettings()
    assert settings.plan(session.state).method == "dual"
    session.damage("front_left", "stuck", 0.5)
    assert settings.plan(session.state).layout.fins[1].limits.zero_direction == (0.5, 0.5)
