"""Scenarios of the swim: what is true and what is believed, for any robot, before it swims and on the way."""

from typing import Any

import pytest

from finlab.allocation import Allocator
from finlab.control import CONTROLLERS
from finlab.errors import FinlabError
from finlab.evaluation.experiments.hard_days import HARD_DAYS
from finlab.layout import Layout, load_layout
from finlab.sim import FinFault
from tests.webapp.loops import page_of
from tests.webapp.test_swimming import SHORT, until
from webapp.session.state import State
from webapp.session.swim_plan import SCENARIOS, SwimSettings
from webapp.tasks.background import Worker
from webapp.tasks.swimmer import Swimmer, closed_loop
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
    plan = settings.plan(State(UCAT))
    assert plan.current == day.current and plan.sensors == day.sensors
    assert plan.path.name == day.trajectory and plan.path.duration_s == day.path().duration_s
    assert plan.truth == day.truth
    assert len(plan.losses) == day.lost and len(plan.weak) == (day.weak is not None)
    assert all(loss.time_s == 0.5 * plan.path.duration_s for loss in plan.losses)
    assert plan.announced == day.announced


def test_days_of_robots_of_their_own_are_left_out() -> None:
    left = {day.name for day in HARD_DAYS} - set(SCENARIOS)
    assert {"hexa", "restricted", "fins-mixed", "heavy", "torpedo", "hybrid"} <= left


@pytest.mark.parametrize("layout", ["hexa", "pair", "penta"])
def test_a_fin_is_lost_without_which_an_own_robot_can_be_steered(layout: str) -> None:
    robot: Layout = load_layout(layout)
    if layout == "pair":
        assert len(chosen("lost-one").plan(State(robot)).losses) == 1
        with pytest.raises(FinlabError, match="lost-two takes 2 of the 2 working fins away"):
            chosen("lost-two").plan(State(robot))
        return
    (loss,) = chosen("lost-in-current").plan(State(robot, failed=(robot.names[0],))).losses
    assert loss.fin in robot.names[1:]


@pytest.mark.parametrize(
    ("key", "wrong"),
    [
        ("scenario", "hexa"),
        ("controller", "pd"),
    ],
)
def test_settings_of_swims_are_checked(key: str, wrong: Any) -> None:
    with pytest.raises(FinlabError):
        SwimSettings().with_value(key, wrong)


@pytest.fixture
def swimming() -> Any:
    worker = Worker()
    swim = Swimming(page_of(worker))
    yield swim
    swim.stop()
    worker.stop()


def test_what_is_true_is_not_what_is_believed(swimming: Swimming) -> None:
    settings = chosen("weak")
    plan = settings.plan(State(UCAT, failed=("back_right",), method="analytic"))._replace(path=SHORT)
    swimming.start(plan)
    until(lambda: swimming.swimmer is not None)
    assert swimming.swimmer is not None
    swim = swimming.swimmer.swim
    assert swim.layout == UCAT and swim.damage.failed == ("back_right",)
    (weak,) = plan.weak
    assert swim.broken[weak] == FinFault(weak, 0.0, "torn", 0.7) and weak not in swim.told
    assert swim.controller.name == "tracking"


@pytest.mark.parametrize("robot", ["bluerov2", "fish", "torpedo", "catamaran"])
def test_any_robot_has_the_scenarios_that_it_can_swim(robot: str) -> None:
    layout = load_layout(robot)
    plan = SwimSettings().with_value("scenario", "offset").plan(State(layout))
    swimmer = Swimmer(plan, closed_loop(plan, Allocator(layout)))
    for _ in range(3):
        swimmer.step()
    moment = swimmer.moment()
    assert (
        moment.figures is not None and moment.figures.mean_w >= 0.0 and moment.motion.shape == (layout.n, 3)
    )


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_swim_has_the_controller_that_is_chosen(controller: str) -> None:
    settings = SwimSettings().with_value("controller", controller)
    plan = settings.plan(State(UCAT))
    assert closed_loop(plan, Allocator(UCAT)).controller.name == controller
    if controller != "tracking":
        with pytest.raises(FinlabError, match="'torpedo' cannot give"):
            settings.plan(State(load_layout("torpedo")))
