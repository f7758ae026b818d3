"""The robot's name, mass and damping: typed, or estimated from its hull."""

import math
from dataclasses import replace

import pytest

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.hull import contradicts, displaced, estimated, hull_of
from finlab.hull.hydrodynamics import solid_of, water_density
from finlab.layout import Body, load_layout
from finlab.layout.body import Hull
from finlab.vehicle.fossen import GRAVITY
from webapp.session import Session
from webapp.session.layout_edits import DYNAMICS, with_dynamics


@pytest.fixture
def session() -> Session:
    """A robot of which only an ellipsoid of 60 x 40 x 20 cm is known."""
    layout = load_layout(shipped_layouts()["ucat"])
    hull = Hull(shape="ellipsoid", size_m=(0.6, 0.4, 0.2), center_m=(0.0, 0.0, 0.02))
    return Session(replace(layout, body=Body(hull=hull)))


def body(session: Session) -> Body:
    found = session.state.layout.body
    assert found is not None
    return found


def test_all_is_estimated_in_one_step_and_is_neutral(session: Session) -> None:
    session.estimate()
    found = body(session)
    volume = 4 / 3 * math.pi * 0.3 * 0.2 * 0.1
    assert found.mass_kg == pytest.approx(1000 * volume, rel=0.01) and found.buoyancy_n is None
    assert found.inertia_kgm2 is not None and found.added_mass is not None
    assert found.inertia_kgm2[0] == pytest.approx(found.mass_kg / 5 * (0.2**2 + 0.1**2), rel=0.02)
    assert found.center_of_buoyancy_m == pytest.approx((0.0, 0.0, 0.02), abs=1e-3)
    assert found.added_mass[2] > found.added_mass[1] > found.added_mass[0] > 0
    assert len(session.history.past) == 1
    session.undo()
    assert body(session).mass_kg is None


def test_a_given_mass_stays_and_buoyancy_tells_the_volume(session: Session) -> None:
    session.set_dynamics("mass_kg", 12.0)
    session.estimate()
    found = body(session)
    assert found.mass_kg == 12.0 and found.inertia_kgm2 is not None
    displaced = 1000 * solid_of(hull_of(session.state.layout)).volume
    assert found.buoyancy_n == pytest.approx(GRAVITY * displaced, rel=1e-3)
    assert session.history.past[0][0] == "Mass of the robot"


def test_the_inertia_of_ucats_hull_is_near_that_of_its_drawings_and_a_bare_hull_drags_less() -> None:
    layout = load_layout("ucat")
    known = layout.body
    found = estimated(layout).body
    assert known is not None and found is not None
    assert found.inertia_kgm2 == pytest.approx(known.inertia_kgm2, rel=0.2)
    # What was identified has fins, wires and ports on it.
    for key in ("added_mass", "quadratic_damping"):
        assert all(a < b for a, b in zip(getattr(found, key), getattr(known, key), strict=True))


def test_the_water_is_that_of_the_fins(session: Session) -> None:
    assert water_density(session.state.layout) == 1000.0
    for name in session.state.layout.names:
        session.select_also(name)
    session.set_value("density", 1025.0)
    assert water_density(session.state.layout) == 1025.0
    session.estimate()
    assert body(session).mass_kg == pytest.approx(1025 * 4 / 3 * math.pi * 0.006, rel=0.01)


def test_forgetting_leaves_the_hull(session: Session) -> None:
    session.estimate()
    session.forget_dynamics()
    assert all(getattr(body(session), key) is None for key in DYNAMICS) and body(session).hull is not None


@pytest.mark.parametrize(
    ("key", "value"),
    [("mass_kg", -1.0), ("hull", None), ("added_mass", (1.0,) * 5), ("buoyancy_n", math.nan)],
)
def test_what_makes_no_sense_is_refused(session: Session, key: str, value: object) -> None:
    with pytest.raises(FinlabError):
        with_dynamics(session.state.layout, **{key: value})


def test_the_robot_is_renamed_and_described(session: Session) -> None:
    session.rename_robot(" Manta <i> ")
    session.describe_robot("Two lines:\nof text.")
    assert (session.state.layout.name, session.state.layout.description) == (
        "Manta <i>",
        "Two lines:\nof text.",
    )
    for bad in ("", "x" * 65, "a\nb"):
        with pytest.raises(FinlabError):
            session.rename_robot(bad)
    with pytest.raises(FinlabError):
        session.describe_robot("x" * 4001)


def test_a_hull_that_contradicts_the_body_can_be_estimated_anew() -> None:
    session = Session(load_layout("ucat"))
    session.set_hull("box", (0.5, 0.3, 0.2))
    layout = session.state.layout
    water = displaced(layout)
    assert water > 25.0 and contradicts(layout)
    session.estimate()
    layout = session.state.layout
    assert layout.body is not None and layout.body.mass_kg == 19.0 and not contradicts(layout)
    session.estimate(anew=True)
    layout = session.state.layout
    assert layout.body is not None and layout.body.mass_kg == pytest.approx(water, rel=0.001)
    assert layout.body.center_of_buoyancy_m is not None and not contradicts(layout)
    session.undo()
    session.forget_dynamics()
    assert not contradicts(session.state.layout), "nothing is said that could"
