"""A robot swims on the page: at the pace of the clock, never behind it by more than a moment."""

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.swim.simulation import Trajectory, make_trajectory
from tests.webapp.stand_in import LoneBell, context_of, load_stand_in, until
from webapp.markup.outcomes import findings_words, pace_words, swim_card
from webapp.panels.status import swim_corner
from webapp.scene.scenery import INITIAL_SCALE
from webapp.session.state import State
from webapp.session.swim_plan import Plan, SwimSettings
from webapp.tasks.slot import Pool
from webapp.tasks.solver import Solver
from webapp.tasks.swimmer import ERROR, FORCES, TIME
from webapp.tasks.swimming import LAG_S, Swimming

UCAT = load_layout(shipped_layouts()["ucat"])
"""Four fins."""
SHORT_PATH = Trajectory(
    "short", np.array([0.0, 2.0]), np.array([[0.0, 0.0, -1.0], [0.2, 0.0, -1.0]])
)
"""A path of two seconds."""


def now(swimming: Swimming) -> tuple[Any, ...]:
    """What its card is made of."""
    swimmer = swimming.swimmer
    moment = None if swimmer is None else swimmer.visible_moment
    return swimming.active, swimmer, moment


def begin(swimming: Swimming, **settings: Any) -> None:
    """Begin a swim along this path, and wait for it."""
    swimming.start(Plan(UCAT, (), **{"path": SHORT_PATH, "method": "analytic", **settings}))
    until(lambda: swimming.swimmer is not None)


def test_swims_to_the_end_and_tells_how(swimming: Swimming) -> None:
    assert "Start" in swim_card(*now(swimming))
    begin(swimming, method="analytic")
    while not swimming.done:
        swimming.tick(0.05)
        swimming.attend()
        time.sleep(0.002)
    assert not swimming.running and swimming.time == pytest.approx(2.0)
    first = swimming.swimmer
    assert first is not None
    record = first.visible_moment.record
    assert record.shape == (20, FORCES + 8) and np.isfinite(record).all()
    assert np.all(np.diff(record[:, TIME]) > 0) and record[0, ERROR] < 0.1
    figures = first.visible_moment.figures
    assert figures is not None and figures.track_m < 0.3
    assert "arrived" in pace_words(swimming)
    assert "arrived" in swim_corner(
        first, first.visible_moment, pace_words(swimming), INITIAL_SCALE, 1.0
    )
    swimming.set_running(True)
    assert not swimming.running, "there is no way left"


def test_a_slow_machine_drops_time_instead_of_piling_it_up(swimming: Swimming) -> None:
    begin(swimming, path=make_trajectory("circle"))
    for _ in range(100):
        swimming.tick(1.0)  # a hundred seconds pass while the first stretch is swum
    until(lambda: not swimming.busy)
    assert swimming.pace._owed <= LAG_S and swimming.time <= 3 * LAG_S


def test_pause_step_and_speed(swimming: Swimming) -> None:
    begin(swimming)
    swimming.set_running(False)
    swimming.tick(1.0)
    assert swimming.time == 0.0
    swimming.step()
    until(lambda: swimming.time == pytest.approx(0.1))
    swimming.pace.set_speed(8.0)
    assert "paused" in pace_words(swimming)


def test_fins_break_and_are_mended_while_it_swims(swimming: Swimming) -> None:
    with pytest.raises(FinlabError, match="nothing swims"):
        swimming.toggle("front_left")
    begin(swimming)
    swimming.set_running(False)
    swimming.toggle("front_left")
    until(lambda: swimming.swimmer.visible_moment.believed_lost == ("front_left",))
    swimming.step()
    until(lambda: swimming.time > 0)
    forces = swimming.swimmer.visible_moment.force
    assert forces[1].max() < 1e-6, "the fin hangs, and the robot is at rest"
    for name in ("front_right", "back_left"):
        swimming.toggle(name)
        until(lambda name=name: name in swimming.swimmer.visible_moment.believed_lost)
    assert "drift off" in swim_card(*now(swimming))
    with pytest.raises(FinlabError, match="last fin"):
        swimming.toggle("back_right")
    swimming.toggle("front_left")
    until(lambda: "front_left" not in swimming.swimmer.visible_moment.believed_lost)


def test_a_robot_that_no_fins_can_steer_is_told_with_all_its_fins(swimming: Swimming) -> None:
    aligned = replace(UCAT, actuators=tuple(replace(fin, mounting_angle=0.0) for fin in UCAT.fins))
    swimming.start(Plan(aligned, (), path=SHORT_PATH, method="analytic"))
    until(lambda: swimming.swimmer is not None)
    assert swimming.swimmer.visible_moment.believed_lost == ()
    said = swim_card(*now(swimming))
    assert "With these actuators, not all of surge, heave and yaw come apart" in said


def test_bad_plans_and_methods_out_of_order(worker: Pool) -> None:
    settings = SwimSettings()
    assert settings.plan(State(UCAT, method="qp")).method == "qp", "that of the bar"
    solver = Solver(load=lambda *_, **__: load_stand_in("ipopt"))
    refused = Swimming(context_of(worker, solver=solver))
    refused.start(Plan(UCAT, (), make_trajectory("circle"), "qp"))
    until(lambda: not refused.active)
    bell = refused._bell
    assert isinstance(bell, LoneBell) and "cannot go on: ipopt is out of order" in bell.refused[0]


def test_a_long_record_is_thinned(swimming: Swimming, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("webapp.tasks.swimmer.POINTS", 100)
    begin(swimming, path=make_trajectory("circle"))
    swimming.set_running(False)
    swimmer = swimming.swimmer
    assert swimmer is not None
    for _ in range(150):
        swimmer.step()
    assert 50 <= len(swimmer.moment().record) <= 100


def test_a_fin_that_breaks_without_a_word_is_found(swimming: Swimming) -> None:
    begin(swimming, path=make_trajectory("circle"))
    swimming.set_running(False)
    swimmer = swimming.swimmer
    assert swimmer is not None
    while swimmer.swim.time < 12.0:
        swimmer.step()
    swimming.toggle("front_left", announced=False)
    until(lambda: swimming.swimmer.visible_moment.lost == ("front_left",))
    assert swimmer.visible_moment.believed_lost == () and swimmer.visible_moment.found == ()
    assert "does not know yet" in swim_card(*now(swimming))
    while not swimmer.swim.damage.lost and swimmer.swim.time < 20.0:
        swimmer.step()
    swimmer.visible_moment = swimmer.moment()
    ((name, seconds),) = swimmer.visible_moment.found
    assert (name, swimmer.visible_moment.believed_lost) == (
        "front_left",
        ("front_left",),
    ) and 0.0 < seconds < 8.0
    assert f"found front_left lost {seconds:.1f} s after" in swim_card(*now(swimming))
    doubts = swimmer.visible_moment.record[:, FORCES + 4 :]
    assert doubts[-1, UCAT.index("front_left")] > 0.99 and doubts[0].max() < 0.1
    assert swimmer.visible_moment.doubted == ("front_left",)
    blind = swimmer.visible_moment._replace(believed_lost=(), found=())
    assert (
        "front_left is lost, and the monitor takes it for torn or stuck" in findings_words(blind)[0]
    )
    wrong = blind._replace(lost=())
    assert "The monitor takes front_left for torn or stuck" in findings_words(wrong)[0]
    swimming.toggle("front_left", announced=False)
    until(lambda: swimming.swimmer.visible_moment.lost == ())
    assert "front_left works, but the allocator takes it for lost" in swim_card(*now(swimming))
