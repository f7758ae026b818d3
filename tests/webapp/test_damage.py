"""What is said of a robot that was not drawn: weak and stuck fins, mass and damping, typed or
estimated."""

import math
from dataclasses import replace

import pytest

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import Body, load_layout
from finlab.layout.body import Hull
from finlab.layout.damage import Damage
from finlab.swim.hull import contradicts, displaced, estimated, hull_of
from finlab.swim.hull.hydrodynamics import solid_of, water_density
from finlab.swim.vehicle.fossen import GRAVITY
from tests.webapp.stand_in import load_stand_in
from webapp.markup.answer import fin_table
from webapp.markup.words import damage_words
from webapp.panels.body_inspector import hull_card
from webapp.panels.files_tab import command_line
from webapp.session import Session
from webapp.session.layout_edits import DYNAMICS, with_dynamics
from webapp.session.looking import SearchRequest
from webapp.session.swim_plan import SwimSettings
from webapp.session.targets import axis_reach, full_thrust
from webapp.tasks.solver import Solver

UCAT = load_layout("ucat")
"""Four fins."""


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
    table = fin_table(state.layout, state.damage, reply.answer, full_thrust(state.able), None)
    assert "weak 50 %" in table and "stuck at 30°" in table
    assert damage_words(state.damage, "front_right") == ""
    assert state.layout == UCAT, "the layout itself stays whole"
    line = command_line(state)
    assert "--weak front_left=0.5" in line and "--stuck back_left=30" in line


def test_damage_is_mended_undone_and_goes_with_its_fin(session: Session) -> None:
    session.damage("front_left", "weak", 0.5)
    session.damage("front_left", "weak", 0.3)
    session.damage("front_left", "stuck", 1.0)
    session.toggle_loss("front_left")
    session.mend("front_left")
    assert session.state.damage == Damage()
    session.undo()
    session.undo()
    assert session.state.damage == Damage(weak={"front_left": 0.3}, stuck={"front_left": 1.0})
    session.damage("front_left", "stuck", None)
    assert session.state.damage == Damage(weak={"front_left": 0.3})
    session.select("front_left")
    session.delete()
    assert session.state.damage == Damage()
    session.undo()
    session.mend_all()
    assert session.state.damage == Damage()


DAMAGE_VALUES = {"weak": 0.5, "torn": 0.5, "stuck": 0.3, "running": (0.3, 1.0, 0.2)}
"""Kind of damage -> a value that the page may send."""
NO_FIN = {"thruster": (0.3,), "azimuth": (0.3, 1.0), "tilt": (0.3, 1.0)}
"""What those that are no fins keep."""


@pytest.mark.parametrize("robot", ["ucat", "torpedo", "catamaran", "bluerov2"])
def test_every_actuator_has_the_faults_of_its_type_and_no_others(robot: str) -> None:
    session = Session(load_layout(robot))
    for part in session.state.layout.actuators:
        for kind, value in {
            **DAMAGE_VALUES,
            "running": NO_FIN.get(part.type, DAMAGE_VALUES["running"]),
        }.items():
            if kind in part.KIND.faults:
                session.damage(part.name, kind, value)
                assert session.state.damage.faults_of(part.name)[kind] == value
            else:
                with pytest.raises(FinlabError, match="fault of"):
                    session.damage(part.name, kind, value)
            assert session.state.able.names == session.state.layout.names
    name = session.state.layout.names[0]
    known = session.state.damage
    session.rename(name, "other")
    assert session.state.damage.faults_of("other") == known.faults_of(name)
    session.mend_all()
    assert session.state.damage == Damage()


def test_a_fin_that_runs_on_is_not_stuck_as_well(session: Session) -> None:
    session.damage("front_left", "stuck", 0.3)
    session.damage("front_left", "running", (0.3, 1.0, 0.2))
    assert session.state.damage == Damage(running={"front_left": (0.3, 1.0, 0.2)})
    assert "--running front_left=0.3,1,11.4592" in command_line(session.state)


def test_a_thruster_hangs_at_a_force_in_newtons() -> None:
    session = Session(load_layout("bluerov2"))
    first, second = session.state.layout.names[:2]
    session.damage(first, "stuck", -12.0)
    session.damage(second, "running", (7.5,))
    words = command_line(session.state)
    assert f"--stuck {first}=-12 " in words + " " and f"--running {second}=7.5 " in words + " "
    assert damage_words(session.state.damage, first, sticks_at_angle=False) == "hangs at −12 N"
    for wrong in (math.nan, "much", True, 1e4):
        with pytest.raises(FinlabError):
            session.damage(first, "stuck", wrong)
    for wrong in ((1.0, 2.0), (math.nan,), ("x",)):
        with pytest.raises(FinlabError):
            session.damage(second, "running", wrong)
    assert session.state.damage == Damage(stuck={first: -12.0}, running={second: (7.5,)})


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
        lambda: draft.with_move_range((math.nan, 0.0, 0.0, 0.0)),
        lambda: draft.with_move_range((0.0, 0.0, 0.0, 900.0)),
    ):
        with pytest.raises(FinlabError):
            change()
    assert (
        session.state == before
        and session.draft == SearchRequest()
        and session.swim == SwimSettings()
    )


def test_a_plan_is_made_of_the_settings(session: Session) -> None:
    settings = SwimSettings()
    assert settings.plan(session.state).method == "dual"
    session.damage("front_left", "stuck", 0.5)
    assert settings.plan(session.state).layout.fins[1].limits.zero_direction == (0.5, 0.5)


@pytest.fixture
def hulled() -> Session:
    """A robot of which only an ellipsoid of 60 x 40 x 20 cm is known."""
    layout = load_layout(shipped_layouts()["ucat"])
    hull = Hull(shape="ellipsoid", size_m=(0.6, 0.4, 0.2), center_m=(0.0, 0.0, 0.02))
    return Session(replace(layout, body=Body(hull=hull)))


def body(hulled: Session) -> Body:
    """The body of a session's robot."""
    found = hulled.state.layout.body
    assert found is not None
    return found


def test_a_made_up_hull_is_not_held_against_the_body(hulled: Session) -> None:
    """A file of another program has mass and buoyancy, and no hull that is read."""
    hulled.estimate()
    layout = hulled.state.layout
    heavy = replace(body(hulled), mass_kg=99.0, buoyancy_n=None)
    said = hull_card(replace(layout, body=heavy))
    assert "The hull encloses" in said and "that of 99 kg" in said.replace("99.0", "99")
    said = hull_card(replace(layout, body=replace(heavy, hull=None)))
    assert "made to fit its actuators" in said and "buoyancy is that of" not in said


def test_all_is_estimated_in_one_step_and_is_neutral(hulled: Session) -> None:
    hulled.estimate()
    found = body(hulled)
    volume = 4 / 3 * math.pi * 0.3 * 0.2 * 0.1
    assert found.mass_kg == pytest.approx(1000 * volume, rel=0.01) and found.buoyancy_n is None
    assert found.inertia_kgm2 is not None and found.added_mass is not None
    assert found.inertia_kgm2[0] == pytest.approx(found.mass_kg / 5 * (0.2**2 + 0.1**2), rel=0.02)
    assert found.center_of_buoyancy_m == pytest.approx((0.0, 0.0, 0.02), abs=1e-3)
    assert found.added_mass[2] > found.added_mass[1] > found.added_mass[0] > 0
    assert len(hulled.history.past) == 1
    hulled.undo()
    assert body(hulled).mass_kg is None


def test_a_given_mass_stays_and_buoyancy_tells_the_volume(hulled: Session) -> None:
    hulled.set_dynamics("mass_kg", 12.0)
    hulled.estimate()
    found = body(hulled)
    assert found.mass_kg == 12.0 and found.inertia_kgm2 is not None
    displaced = 1000 * solid_of(hull_of(hulled.state.layout)).volume
    assert found.buoyancy_n == pytest.approx(GRAVITY * displaced, rel=1e-3)
    assert hulled.history.past[0][0] == "Mass of the robot"


def test_the_inertia_of_ucats_hull_is_near_that_of_its_drawings_and_a_bare_hull_drags_less() -> (
    None
):
    layout = load_layout("ucat")
    known = layout.body
    found = estimated(layout).body
    assert known is not None and found is not None
    assert found.inertia_kgm2 == pytest.approx(known.inertia_kgm2, rel=0.2)
    # What was identified has fins, wires and ports on it.
    for key in ("added_mass", "quadratic_damping"):
        assert all(a < b for a, b in zip(getattr(found, key), getattr(known, key), strict=True))


def test_the_water_is_that_of_the_fins(hulled: Session) -> None:
    assert water_density(hulled.state.layout) == 1000.0
    for name in hulled.state.layout.names:
        hulled.select_also(name)
    hulled.set_value("density", 1025.0)
    assert water_density(hulled.state.layout) == 1025.0
    hulled.estimate()
    assert body(hulled).mass_kg == pytest.approx(1025 * 4 / 3 * math.pi * 0.006, rel=0.01)


def test_forgetting_leaves_the_hull(hulled: Session) -> None:
    hulled.estimate()
    hulled.forget_dynamics()
    assert (
        all(getattr(body(hulled), key) is None for key in DYNAMICS)
        and body(hulled).hull is not None
    )


@pytest.mark.parametrize(
    ("key", "value"),
    [("mass_kg", -1.0), ("hull", None), ("added_mass", (1.0,) * 5), ("buoyancy_n", math.nan)],
)
def test_what_makes_no_sense_is_refused(hulled: Session, key: str, value: object) -> None:
    with pytest.raises(FinlabError):
        with_dynamics(hulled.state.layout, **{key: value})


def test_the_robot_is_renamed_and_described(hulled: Session) -> None:
    hulled.rename_robot(" Manta <i> ")
    hulled.describe_robot("Two lines:\nof text.")
    assert (hulled.state.layout.name, hulled.state.layout.description) == (
        "Manta <i>",
        "Two lines:\nof text.",
    )
    for bad in ("", "x" * 65, "a\nb"):
        with pytest.raises(FinlabError):
            hulled.rename_robot(bad)
    with pytest.raises(FinlabError):
        hulled.describe_robot("x" * 4001)


def test_a_hull_that_contradicts_the_body_can_be_estimated_anew() -> None:
    hulled = Session(load_layout("ucat"))
    hulled.set_hull("box", (0.5, 0.3, 0.2))
    layout = hulled.state.layout
    water = displaced(layout)
    assert water > 25.0 and contradicts(layout)
    hulled.estimate()
    layout = hulled.state.layout
    assert layout.body is not None and layout.body.mass_kg == 19.0 and not contradicts(layout)
    hulled.estimate(with_mass=True)
    layout = hulled.state.layout
    assert layout.body is not None and layout.body.mass_kg == pytest.approx(water, rel=0.001)
    assert layout.body.center_of_buoyancy_m is not None and not contradicts(layout)
    hulled.undo()
    hulled.forget_dynamics()
    assert not contradicts(hulled.state.layout), "nothing is said that could"
