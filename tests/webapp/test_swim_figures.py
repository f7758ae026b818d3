"""What swims come to, their logs, and the scenarios that are true and believed in them."""

import io
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.errors import FinlabError
from finlab.layout import Damage, Layout, load_layout
from finlab.research.evaluation.experiments.hard_days import HARD_DAYS
from finlab.swim.simulation import Fault, make_trajectory
from tests.webapp.stand_in import AtOnce, context_of, until
from tests.webapp.test_swimming import SHORT_PATH, now
from webapp.markup.outcomes import pace_words, swim_card
from webapp.markup.words import righting_sentences
from webapp.panels.swim_tab import swim_words
from webapp.session.state import State
from webapp.session.swim_plan import SCENARIOS, Plan, SwimSettings
from webapp.tasks.designs import Designs
from webapp.tasks.slot import Pool
from webapp.tasks.swimmer import POWER, Figures, Swimmer, closed_loop
from webapp.tasks.swimming import Swimming

UCAT = load_layout("ucat")
"""Four fins."""


class Shelf:
    """A page's tasks, and what was sent to its browser."""

    def __init__(self, worker: Pool) -> None:
        self.sent: dict[str, bytes] = {}
        client = SimpleNamespace(
            send_file_download=lambda name, data, **_: self.sent.update({name: data})
        )
        context = context_of(worker)
        self.swimming = Swimming(context)
        silent: Any = None
        self.files = Designs(client, silent, context.solver, AtOnce(), lambda *_, **__: None)

    def begun(self) -> Swimmer:
        """The swim that has begun."""
        assert self.swimming.swimmer is not None
        return self.swimming.swimmer

    def swim(self, seconds: float, method: str) -> None:
        """Swim some seconds with a method."""
        self.swimming.start(Plan(UCAT, (), make_trajectory("circle"), method))
        until(lambda: self.swimming.swimmer is not None)
        self.swimming.set_running(False)
        swimmer = self.begun()
        while swimmer.swim.time < seconds - 1e-6:
            swimmer.step()
        swimmer.visible_moment = swimmer.moment()


@pytest.fixture
def shelf(worker: Pool) -> Iterator[Shelf]:
    """Swims of one test."""
    shelf = Shelf(worker)
    yield shelf
    shelf.swimming.halt()


def test_what_a_swim_comes_to(shelf: Shelf) -> None:
    shelf.swim(10.0, "analytic")
    swimmer = shelf.begun()
    figures = swimmer.visible_moment.figures
    log = swimmer.log()
    assert isinstance(figures, Figures)
    power = log.driving_power.sum(axis=1)
    assert swimmer.moment().record[:, POWER] == pytest.approx(power)
    off = np.linalg.norm(log.position - log.reference, axis=1)
    assert figures.mean_w == pytest.approx(power.mean()) and figures.now_w == pytest.approx(
        power[-10:].mean()
    )
    assert figures.energy_wh == pytest.approx(power.sum() * 0.1 / 3600)
    assert figures.track_m == pytest.approx(np.sqrt((off**2).mean()))
    assert figures.depth_m == pytest.approx(
        np.sqrt(((log.position - log.reference)[:, 2] ** 2).mean())
    )
    swimmer.visible_moment = swimmer.visible_moment._replace(
        figures=figures._replace(mean_w=2.0, energy_wh=0.0042)
    )
    card = swim_card(*now(shelf.swimming))
    assert "<td>2.00 W</td>" in card and "<td>4.2 mWh</td>" in card


def test_the_log_is_sent_whole(shelf: Shelf) -> None:
    with pytest.raises(FinlabError, match="nothing has been swum"):
        shelf.files.swim(shelf.swimming)
    shelf.swim(2.0, "analytic")
    shelf.files.swim(shelf.swimming)
    until(lambda: bool(shelf.sent))
    ((name, content),) = shelf.sent.items()
    assert name == "ucat_analytic_nominal.npz"
    with np.load(io.BytesIO(content), allow_pickle=False) as log:
        assert len(log["time"]) == 20


def test_a_swim_that_capsizes_says_so(shelf: Shelf) -> None:
    assert UCAT.body is not None and righting_sentences(UCAT) == ()
    heavy = replace(UCAT, body=replace(UCAT.body, center_of_buoyancy_m=(0.0, 0.0, -0.05)))
    assert righting_sentences(heavy) == ("No righting moment: overturns in pitch at rest.",)
    shelf.swimming.start(Plan(heavy, (), make_trajectory("circle"), "dual"))
    until(lambda: shelf.swimming.swimmer is not None)
    shelf.swimming.set_running(False)
    swimmer = shelf.begun()
    while swimmer.moment().capsized is None:
        assert "capsized" not in pace_words(shelf.swimming)
        swimmer.step()
        swimmer.visible_moment = swimmer.moment()
    assert swimmer.log().capsized_s == swimmer.visible_moment.capsized
    assert f"capsized at {swimmer.visible_moment.capsized:.1f} s" in pace_words(shelf.swimming)


def settings_of_scenario(name: str, **then: Any) -> SwimSettings:
    """Settings of a scenario, and of then some more."""
    settings = SwimSettings().with_value("scenario", name)
    for key, value in then.items():
        settings = settings.with_value(key, value)
    return settings


@pytest.mark.parametrize("name", list(SCENARIOS))
def test_every_scenario_plans_what_its_day_says(name: str) -> None:
    day = SCENARIOS[name]
    settings = settings_of_scenario(name)
    plan = settings.plan(State(UCAT))
    assert plan.day == day
    assert plan.path.name == day.trajectory and plan.path.duration_s == day.path().duration_s
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
        assert len(settings_of_scenario("lost-one").plan(State(robot)).losses) == 1
        with pytest.raises(FinlabError, match="lost-two takes 2 of the 2 working fins away"):
            settings_of_scenario("lost-two").plan(State(robot))
        return
    (loss,) = (
        settings_of_scenario("lost-in-current")
        .plan(State(robot, damage=Damage((robot.names[0],))))
        .losses
    )
    assert loss.name in robot.names[1:]


def test_what_is_true_is_not_what_is_believed(swimming: Swimming) -> None:
    settings = settings_of_scenario("weak")
    plan = settings.plan(State(UCAT, damage=Damage(("back_right",)), method="analytic"))._replace(
        path=SHORT_PATH
    )
    swimming.start(plan)
    until(lambda: swimming.swimmer is not None)
    assert swimming.swimmer is not None
    swim = swimming.swimmer.swim
    assert swim.layout == UCAT and swim.damage.lost == ("back_right",)
    (weak,) = plan.weak
    assert swim.broken[weak] == Fault(weak, 0.0, "torn", 0.7) and weak not in swim.told
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
        moment.figures is not None
        and moment.figures.mean_w >= 0.0
        and moment.motion.shape == (layout.n, 3)
    )


def test_a_borrowed_body_is_said_before_the_swim() -> None:
    """A robot without a body swims with U-CAT's, which its designer must know."""
    settings = SwimSettings()
    assert "U-CAT" not in swim_words(settings, "dual", UCAT)
    bodiless = swim_words(settings, "dual", load_layout("hexa"))
    assert "Its body is not described: it swims with that of U-CAT, 19 kg." in bodiless
    body = UCAT.body
    assert body is not None
    undamped = replace(UCAT, body=replace(body, linear_damping=None, quadratic_damping=None))
    words = swim_words(settings, "dual", undamped)
    assert "Not said of its body: linear damping and quadratic damping." in words
