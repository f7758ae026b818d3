"""A search that is watched, stopped, taken or left; the analyst answers what came to rest."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from finlab.analysis import layout_bound, mirror_pairs
from finlab.analysis.improvement_text import improvement_remarks
from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import Damage, Fin, load_layout
from tests.webapp.stand_in import LoneBell, context_of, until
from webapp.markup.score_card import warnings
from webapp.session import Session
from webapp.session.looking import GOALS_BY_WORDS, SearchRequest, most_reach
from webapp.session.state import State
from webapp.tasks.analysing import Analysis, AnalysisQuestion, analyse
from webapp.tasks.improving import Clearance, Improver, Search, has_bound
from webapp.tasks.slot import Pool, Slot

NO_YAW = load_layout(shipped_layouts()["no_yaw"])
"""A robot that cannot yaw."""


def test_search_is_cancelled_and_what_it_found_is_offered(worker: Pool) -> None:
    improver = Improver(context_of(worker))
    request = SearchRequest("weakest direction")
    improver.start(State(NO_YAW), request)
    with pytest.raises(FinlabError, match="running already"):
        improver.start(State(NO_YAW), request)
    until(
        lambda: improver.progress is not None and improver.progress.best > improver.progress.before
    )
    improver.stop()
    until(lambda: improver.answer is not None)
    assert improver.answer is not None and improver.answer.cancelled and not improver.busy
    session = Session(NO_YAW)
    session.accept_layout(improver.answer.layout)
    assert session.history.undo_name == "Improve the layout"
    session.undo()
    assert session.state.layout == NO_YAW
    improver.forget()
    assert improver.answer is None and not improver.busy


def test_bad_searches_are_refused() -> None:
    request = SearchRequest()
    with pytest.raises(FinlabError, match="goal"):
        request.with_goal("gold")
    with pytest.raises(FinlabError, match="nothing may move"):
        replace(request, fixed=NO_YAW.names).bounds(NO_YAW)
    for move_range in ((float("nan"), 0.05, 0.05, 90.0), (0.05, 0.05, 0.05, 720.0)):
        with pytest.raises(FinlabError):
            request.with_move_range(move_range)


def test_fins_move_within_bounds_for_the_power_of_a_mission(worker: Pool) -> None:
    improver = Improver(context_of(worker))
    first, second = NO_YAW.names[:2]
    request = replace(SearchRequest("power for a mission"), fixed=NO_YAW.names[2:])
    request = request.with_move_range((0.04, 0.01, 0.0, 0.0))
    bounds = request.bounds(NO_YAW)
    x = NO_YAW.fins[1].position[0]
    assert bounds[second].x == pytest.approx((x - 0.04, x + 0.04))
    assert bounds[first].mounting_angle[0] == bounds[first].mounting_angle[1]
    improver.start(State(NO_YAW), request)
    until(lambda: improver.progress is not None)
    improver.stop()
    until(lambda: improver.answer is not None)
    assert improver.answer is not None and improver.answer.goal == "mission_power"
    assert improver.answer.moved == (first, second)


def test_analyst_answers_only_the_question_that_stays(worker: Pool) -> None:
    layout = load_layout(shipped_layouts()["pair"])
    asked: list[AnalysisQuestion] = []

    def answer(question: AnalysisQuestion) -> Analysis:
        asked.append(question)
        return analyse(question)

    analyst: Slot[AnalysisQuestion, Analysis] = Slot(worker, LoneBell(), answer, rest_s=0.1)
    for k in range(20):
        moved = layout.replace_actuator(layout.names[0], position=(0.01 * k, 0.2, 0.0))
        analyst.ask(AnalysisQuestion(moved, (), layout, "none"))
        time.sleep(0.01)
        analyst.attend()
    until(lambda: not analyst.busy)
    assert len(asked) < 4
    assert analyst.answer is not None
    assert analyst.answer.question.layout.fins[0].position[0] == pytest.approx(0.19)
    assert analyst.answer.before is not None


def test_what_is_proposed_can_be_built(worker: Pool) -> None:
    """Outside of the hull, apart, symmetric, in whole millimetres and degrees; with figures that
    stay."""
    ucat = load_layout(shipped_layouts()["ucat"])
    inside = replace(ucat, actuators=(*ucat.fins, Fin("tail", (-0.25753, 0.0, 0.0), math.pi)))
    assert (
        any("tail beats inside" in text for text in warnings(inside)) is False
    )  # it points out of the stern
    stuck = inside.replace_actuator("tail", position=(-0.15, 0.0, 0.0))
    assert any("tail beats inside" in text for text in warnings(stuck))
    clearance = Clearance(stuck, 0.02)
    assert clearance.violation(stuck.position[None], stuck.frames[None])[0] > 0.0
    improver = Improver(context_of(worker))
    request = SearchRequest().with_move_range((0.15, 0.05, 0.05, 60.0))
    improver.start(State(stuck), request)
    until(lambda: improver.answer is not None)
    found = improver.answer
    assert found is not None and found.improved
    layout = found.layout
    assert warnings(layout) == ()
    assert clearance.violation(layout.position[None], layout.frames[None])[0] == 0.0
    assert [set(pair) for pair in mirror_pairs(layout)] == [
        set(pair) for pair in mirror_pairs(stuck)
    ]
    tail = layout.fins[-1]
    assert tail.position[1] == 0.0 and tail.mounting_angle == math.pi
    for fin in layout.fins:
        assert fin.position == pytest.approx(np.round(fin.position, 3), abs=1e-12)
        assert math.degrees(fin.mounting_angle) == pytest.approx(
            round(math.degrees(fin.mounting_angle)), abs=1e-9
        )
    afterwards = analyse(AnalysisQuestion(layout, (), layout, "none")).card
    assert afterwards.authority.weakest == found.card_after.authority.weakest
    assert [loss.weakest for loss in afterwards.losses] == [
        loss.weakest for loss in found.card_after.losses
    ]


@pytest.mark.parametrize(
    ("robot", "lost"), [("bluerov2", 1), ("catamaran", 1), ("turtle_hybrid", 1), ("torpedo", 0)]
)
def test_any_robot_is_improved_without_what_is_lost(robot: str, lost: int, worker: Pool) -> None:
    layout = load_layout(robot)
    state = State(layout, Damage(layout.names[:lost]), speed=1.0)
    improver = Improver(context_of(worker))
    improver.start(state, SearchRequest())
    until(lambda: improver.progress is not None or improver.error is not None)
    improver.stop()
    until(lambda: not improver.busy)
    found = improver.answer
    assert found is not None, improver.error
    assert found.layout.names == layout.names and not set(found.moved) & set(state.lost)
    assert found.layout.actuators[:lost] == layout.actuators[:lost]
    clearance = Clearance(layout.without(state.lost), 0.02)
    left = found.layout.without(state.lost)
    assert clearance.violation(left.position[None], left.frames[None])[0] == 0.0
    assert mirror_pairs(left) == mirror_pairs(layout.without(state.lost))


def test_what_is_found_is_said_to_be_so_far_from_the_best(worker: Pool) -> None:
    """The bound is not below the layout that was found, nor below others within the bounds."""
    rov = load_layout("bluerov2_heavy")
    improver = Improver(context_of(worker))
    request = SearchRequest().with_move_range((0.1, 0.1, 0.02, 90.0))
    improver.start(State(rov), request)
    until(lambda: improver.progress is not None)
    improver.stop()
    until(lambda: improver.answer is not None)
    improver.ask_bound()
    question = improver.bounding.question
    improver.ask_bound()
    assert improver.bounding.question is question, "it is asked once"
    until(lambda: not improver.bounding.busy)
    found = improver.bounding.answer
    assert found is not None and found.bound is not None and found.below is not None
    assert found.value_before <= found.value_after <= found.bound.value
    assert found.below == pytest.approx(1.0 - found.value_after / found.bound.value)
    words = " ".join(remark.text for remark in improvement_remarks(found))
    assert f"At most {100.0 * found.below:.1f} % below the best possible" in words
    improver.forget()
    assert improver.bounding.answer is None and improver.bounding.question is None


@pytest.mark.parametrize(
    ("robot", "goal", "speed"),
    [
        ("ucat", "weakest direction", 0.0),
        ("bluerov2_heavy", "power for a mission", 0.0),
        ("torpedo", "weakest direction", 1.0),
    ],
)
def test_nothing_is_said_where_no_bound_holds(robot: str, goal: str, speed: float) -> None:
    state = State(load_layout(robot), speed=speed)
    assert not has_bound(Search(state, GOALS_BY_WORDS[goal], {}))


def test_a_cancelled_bound_is_valid() -> None:
    rov = load_layout("bluerov2_heavy")
    sharp = layout_bound(rov, rov.names)
    early = layout_bound(rov, rov.names, cancelled=lambda: True)
    assert early.rounds == 1 < sharp.rounds and early.value >= sharp.value


def test_the_range_grows_with_the_robot() -> None:
    request = SearchRequest()
    small = load_layout("bluerov2_heavy")
    assert request.range_of(small) == (0.05, 0.05, 0.05, 180.0) and most_reach(small) == 0.5
    ship = load_layout("drillship")
    length = float(np.ptp(ship.position[:, 0]))
    reach = request.range_of(ship)[0]
    assert 0.02 * length < reach < 0.1 * length
    assert most_reach(ship) == pytest.approx(length, rel=0.05)
    wide = request.with_move_range((20.0, 5.0, 0.0, 30.0), most_reach(ship))
    bounds = wide.bounds(ship)
    ends = bounds[ship.names[0]].x
    assert ends[1] - ends[0] == pytest.approx(40.0)
    with pytest.raises(FinlabError, match="reach along x"):
        request.with_move_range((20.0, 5.0, 0.0, 30.0), most_reach(small))
