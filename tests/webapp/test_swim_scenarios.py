"""Scenarios of the swim: what is true and what is believed, for any robot, before it swims and on the way."""

import math
from typing import Any

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.evaluation.experiments.hard_days import HARD_DAYS
from finlab.layout import Layout, load_layout
from finlab.sim import Changing, FinFault, SteadyCurrent, Still, Waves
from tests.webapp.loops import page_of
from tests.webapp.test_swimming import SHORT, until
from webapp.markup.scenario import scenario_card
from webapp.session.scenarios import SCENARIOS
from webapp.session.state import State
from webapp.session.swim_plan import OWN, SwimSettings
from webapp.tasks.background import Worker
from webapp.tasks.swimming import Swimming

UCAT = load_layout("ucat")


def chosen(name: str, **then: Any) -> SwimSettings:
    settings = SwimSettings().with_value("scenario", name)
    for key, value in then.items():
        settings = settings.with_value(key, value)
    return settings


@pytest.mark.parametrize("name", list(SCENARIOS))
def test_every_scenario_plans_what_its_day_says(name: str) -> None:
    day, settings = SCENARIOS[name], chosen(name)
    plan = settings.plan(State(UCAT), None)
    assert plan.water == day.water and plan.plant == day.plant and plan.sensors == day.sensors
    assert plan.path.name == day.trajectory and plan.path.duration_s == day.path().duration_s
    assert {"buoyancy": 1.0, **day.truth} == plan.truth
    assert len(plan.losses) == day.lost and len(plan.weak) == (day.weak is not None)
    assert all(loss.time_s == 0.5 * plan.path.duration_s for loss in plan.losses)
    assert plan.announced == day.announced
    assert day.about.split(";")[0][:20] in scenario_card(settings).replace("&#x27;", "'")


def test_days_of_robots_of_their_own_are_left_out() -> None:
    left = {day.name for day in HARD_DAYS} - set(SCENARIOS)
    assert left == {"hexa", "octo", "restricted", "fins-mixed"}


@pytest.mark.parametrize("layout", ["hexa", "pair", "penta"])
def test_a_fin_is_lost_without_which_an_own_robot_can_be_steered(layout: str) -> None:
    robot: Layout = load_layout(layout)
    if layout == "pair":
        assert len(chosen("lost-one").plan(State(robot), None).losses) == 1
        with pytest.raises(FinlabError, match="lost-two takes 2 of the 2 working fins away"):
            chosen("lost-two").plan(State(robot), None)
        return
    (loss,) = chosen("lost-in-current").plan(State(robot, failed=(robot.names[0],)), None).losses
    assert loss.fin in robot.names[1:]


def test_the_user_changes_what_the_day_says() -> None:
    turning = chosen("current-turns")
    assert isinstance(turning.water, Changing) and "turns on the way" in scenario_card(turning)
    steady = turning.with_value("current_cm_s", 10.0).with_value("heading_deg", 90.0)
    assert isinstance(steady.water, SteadyCurrent)
    assert steady.water.velocity == pytest.approx((0.0, 0.1, 0.0))
    waves = steady.with_value("waves_cm", 30.0).water
    assert isinstance(waves, Waves) and waves.height_m == 0.3 and waves.current == pytest.approx((0, 0.1, 0))
    assert chosen("waves", waves_cm=0.0).water == Still()
    heavy = chosen("damping-double", buoyancy_percent=-1.5)
    assert heavy.truth == pytest.approx({"damping": 2.0, "buoyancy": 0.985})
    card = scenario_card(heavy)
    assert "1.5 % too heavy; damping × 2" in card and "Believed: the layout, in still water" in card
    assert "True: as drawn. Believed: the same. Broken fins are announced." in scenario_card(SwimSettings())
    assert "100 ms later" in scenario_card(chosen("late"))
    assert "one fin at 70 %" in scenario_card(chosen("weak"))
    assert "2 fins lost half-way" in scenario_card(chosen("lost-two"))
    own = chosen("dive", path=OWN).plan(State(UCAT), SHORT)
    assert own.path is SHORT


@pytest.mark.parametrize(
    ("key", "wrong"),
    [
        ("scenario", "hexa"),
        ("current_cm_s", 31.0),
        ("heading_deg", math.nan),
        ("waves_cm", -1.0),
        ("buoyancy_percent", 4.0),
        ("pack_wh", 0.0),
        ("electronics_w", "many"),
        ("controller", "autopilot"),
    ],
)
def test_settings_of_swims_are_checked(key: str, wrong: Any) -> None:
    with pytest.raises(FinlabError):
        SwimSettings().with_value(key, wrong)


@pytest.fixture
def swimming() -> Any:
    worker = Worker()
    swim = Swimming(page_of(worker), lambda: None)
    yield swim
    swim.stop()
    worker.stop()


def test_what_is_true_is_not_what_is_believed(swimming: Swimming) -> None:
    settings = chosen("weak", buoyancy_percent=1.0, method="analytic")
    plan = settings.plan(State(UCAT, failed=("back_right",)), SHORT)._replace(path=SHORT)
    swimming.start(plan)
    until(lambda: bool(swimming.swimmers))
    swim = swimming.swimmers[0].swim
    assert swim.vehicle.lift == pytest.approx(1.01 * swim.vehicle.weight)
    assert swim.layout == UCAT and swim.damage.failed == ("back_right",)
    (weak,) = plan.weak
    assert swim.broken[weak] == FinFault(weak, 0.0, "torn", 0.7) and weak not in swim.told
    assert swim.controller.name == "tracking"


def test_water_and_buoyancy_change_at_once(swimming: Swimming) -> None:
    swimming.meet(Still(), 1.0)  # nobody swims: nothing happens
    settings = chosen("damping-double", method="analytic")
    swimming.start(settings.plan(State(UCAT), None))
    until(lambda: bool(swimming.swimmers))
    swimming.step()
    until(lambda: swimming.time > 0.0)
    swim = swimming.swimmers[0].swim
    damping = swim.vehicle.dynamics.linear
    settings = settings.with_value("current_cm_s", 12.0).with_value("buoyancy_percent", 2.0)
    swimming.meet(settings.water, settings.truth["buoyancy"])
    until(lambda: isinstance(swim.water, Changing))
    assert swim.water == Changing(Still(), SteadyCurrent((0.12, 0.0, 0.0)), 0.1)
    assert swim.vehicle.lift == pytest.approx(1.02 * swim.vehicle.weight)
    assert swim.vehicle.dynamics.linear == damping, "what else is true of the body stays"
    swimmer = swimming.swimmers[0]
    while swim.time < 3.0:
        swimmer.step()
    assert 0.06 < swimmer.recorded().log.flow[-1, 0] < 0.12, "it is still on its way"
    swimmer.meet(settings.water, 1.0)
    assert swim.water.time_s == 0.1, "only the buoyancy has changed"
    assert swim.vehicle.lift == pytest.approx(swim.vehicle.weight)
    swimmer.meet(Still(), 1.0)
    half = swim.water.flow([0.0, 0.0, -1.0], swim.time).velocity[0]
    assert 0.06 < half < 0.12, "it goes on from there"
    while swim.time < 9.0:
        swimmer.step()
    assert np.all(swimmer.recorded().log.flow[-1] == 0.0)
    swimmer.meet(settings.water, 1.0)
    assert swim.water.before == Still()
