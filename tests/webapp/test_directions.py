"""Robots of any actuators are edited: places, shafts, axes and arcs turn and mirror together."""

from itertools import pairwise

import numpy as np
import pytest

from finlab.actuators.kinds import KINDS
from finlab.arrays import Array
from finlab.axes import rotation
from finlab.errors import FinlabError
from finlab.layout import Fin, Layout, load_layout
from finlab.physics import plant_of
from tests.webapp.test_other_robots import FISH
from webapp.session import Session

ROBOTS = ("ucat", "bluerov2", "torpedo", "catamaran", "fish", "turtle_hybrid")
"""Shipped robots of all kinds of actuator."""
FLOW = np.array([1.2, 0.1, -0.2, 0.0, 0.0, 0.0])
"""A flow that is not straight (6,) [m/s, rad/s]."""
POLAR_MIRROR = np.array([1.0, -1.0, 1.0])
"""Signs of forces and velocities in a mirror at the plane of x and z."""
AXIAL_MIRROR = np.array([-1.0, 1.0, -1.0])
"""The same of torques and angular velocities."""
WRENCH_MIRROR = np.concatenate([POLAR_MIRROR, AXIAL_MIRROR])
"""The same of wrenches and flows."""


def wrenches(layout: Layout, names: tuple[str, ...], flow: Array) -> Array:
    """What an actuator can do at a few hundred commands, sorted so that their order does not
    count."""
    plant = plant_of(Layout("part", tuple(layout.actuator(name) for name in names)))
    share = np.stack(np.meshgrid(*[np.linspace(0, 1, 5)] * 3, indexing="ij"), -1).reshape(-1, 1, 3)
    return np.asarray(plant.wrench(plant.lower + share * plant.width, flow=flow))


def same(a: Array, b: Array) -> bool:
    """Whether two sets of wrenches (K, 6) are the same, in any order."""
    apart = np.linalg.norm(a[:, None] - b[None], axis=-1)
    return bool(max(apart.min(0).max(), apart.min(1).max()) < 1e-6 * max(1.0, np.abs(a).max()))


@pytest.mark.parametrize("robot", ROBOTS)
def test_copies_around_an_axis_do_what_the_first_does_turned(robot: str) -> None:
    for axis, letter in zip(np.eye(3), "xyz", strict=True):
        session = Session(load_layout(robot))
        for name in session.state.layout.names:
            layout = session.state.layout
            session.select(name)
            if np.linalg.norm(np.cross(axis, layout.actuator(name).position)) < 1e-3:
                with pytest.raises(FinlabError, match="stands on the"):
                    session.ring(3, letter)
                continue
            session.ring(3, letter)
            new = session.state.layout.names[-2:]
            for k, copy in enumerate(new):
                turn = rotation(axis, 2.0 * np.pi * (k + 1) / 3.0)
                both = np.kron(np.eye(2), turn)
                first = wrenches(layout, (name,), both.T @ FLOW) @ both.T
                assert same(first, wrenches(session.state.layout, (copy,), FLOW)), (name, letter)
            session.undo()
            assert session.state.layout == layout


@pytest.mark.parametrize(
    "layout", [FISH, *map(load_layout, ROBOTS)], ids=lambda layout: layout.name
)
def test_the_image_does_the_mirrored_thing(layout: Layout) -> None:
    for part in layout.actuators:
        other = Layout("image", (part.image(),))
        flow = FLOW * WRENCH_MIRROR
        first = wrenches(layout, (part.name,), FLOW) * WRENCH_MIRROR
        assert same(first, wrenches(other, (part.name,), flow)), part.name
        again = part.image().image()
        np.testing.assert_allclose(again.frame, part.frame, atol=1e-9)
        np.testing.assert_allclose([again.lower, again.upper], [part.lower, part.upper], atol=1e-9)


def test_a_twin_follows_in_place_and_direction() -> None:
    session = Session(load_layout("bluerov2"))
    session.select("front_left")
    session.mirror()
    assert session.selected == "front_right" and session.state.layout.n == 6
    session.point("front_left", (0.0, 3.0, 4.0))
    left, right = (session.state.layout.actuator(name) for name in ("front_left", "front_right"))
    assert left.frame[0] == pytest.approx((0.0, 0.6, 0.8)) and right.frame[0] == pytest.approx(
        (0.0, -0.6, 0.8)
    )
    assert session.undo() == "Point front_left"


def test_what_rounding_has_left_of_a_direction_counts_as_none() -> None:
    session = Session(load_layout("octo"))
    name = session.state.layout.names[0]
    session.point(name, (3e-7, 0.0, 1.0))
    assert session.state.layout.actuator(name).direction == (0.0, 0.0, 1.0)
    session.point(name, (3e-5, 0.0, 1.0))
    assert session.state.layout.actuator(name).direction[0] == pytest.approx(3e-5)
    with pytest.raises(FinlabError, match="expected a vector with a length"):
        session.point(name, (0.0, 0.0, 0.0))


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_added_points_where_it_is_told_with_the_rest_across(kind: str) -> None:
    session = Session(load_layout("fish"))
    session.add(kind)
    name = session.selected
    assert name == kind and session.state.layout.n == 4
    ways = [*np.eye(3), *-np.eye(3), np.array([0.3, -0.5, 0.2])]
    for way in ways + ways[::-1]:
        session.point(name, tuple(way.tolist()))
        part = session.state.layout.actuator(name)
        assert part.direction == pytest.approx(tuple(way / np.linalg.norm(way)))
        np.testing.assert_allclose(
            np.array(part.frame) @ np.array(part.frame).T, np.eye(3), atol=1e-9
        )
        if isinstance(part, Fin):
            assert (part.mounting_angle is not None) == (way[2] == 0.0), (
                "horizontal ones keep their angle"
            )
    with pytest.raises(FinlabError, match="expected a vector with a length"):
        session.point(name, (0.0, 0.0, 0.0))


def test_a_tail_begins_with_its_thrust_ahead_and_keeps_an_arc_it_has() -> None:
    session = Session(load_layout("ucat"))
    session.add("fin")
    session.point("fin", (0.0, 0.0, 1.0))
    tail = session.state.layout.actuator("fin")
    assert tail.frame[1] == pytest.approx((1.0, 0.0, 0.0))
    session.set_value("zero_direction", (-1.0, 1.0))
    turns = [session.state.layout]
    for way in ((0.0, 1.0, 1.0), (0.0, 1.0, 0.0)):
        session.point("fin", way)
        turns.append(session.state.layout)
    for before, after in pairwise(turns):
        assert after.actuator("fin").frame[1] == pytest.approx(before.actuator("fin").frame[1])
    session.turn_about((0.0, 0.0, 5.0))
    assert session.state.layout.actuator("fin").frame[1] == pytest.approx((0.0, 0.0, 1.0))


def test_a_drag_of_the_direction_is_one_step() -> None:
    session = Session(load_layout("torpedo"))
    for k in range(5):
        session.point("rudder_top", (0.1 * k, 0.1, 1.0), held=True)
    session.history.end_merge()
    session.point("rudder_top", (0.0, 1.0, 1.0))
    session.undo()
    session.undo()
    assert session.state.layout == load_layout("torpedo")
