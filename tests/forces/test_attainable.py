"""Attainable sets; reach of robots of any actuators against linear programs over a plant written
apart."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.actuators.thrust_model import PowerLaw
from finlab.analysis import AttainableSet, attainable_set, authority, score_card
from finlab.axes import AXES as WRENCH
from finlab.errors import LayoutError
from finlab.forces.force_sets import SCALE, force_sets
from finlab.forces.reach import axis_ranges, max_wrench_along_exactly
from finlab.layout import Azimuth, Layout, Thruster, load_layout
from finlab.physics import Plant
from tests.forces.conftest import THRUST
from tests.oracle_optima import farthest
from tests.oracle_plant import OraclePlant
from tests.random_robots import load, random_flow, random_plant, random_robot
from tests.sampled_cases import sampled

Array = NDArray[np.float64]
Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""
AXES_OF_KIND = {"force": slice(0, 3), "torque": slice(3, 6)}
"""Axes of a wrench that belong to forces and to torques."""


def outside(body: AttainableSet, points: Array) -> float:
    """How far the farthest of points (P, 3) lies outside any face of a body."""
    a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    size = np.linalg.norm(normals, axis=-1)
    normals = normals[size > 1e-12] / size[size > 1e-12, None]
    a = a[size > 1e-12]
    return float(((points @ normals.T) - (a * normals).sum(-1)).max())


@pytest.mark.parametrize("kind", ["force", "torque"])
def test_sets_with_all_else_zero_hold_what_was_found_otherwise(shipped: Layouts, kind: str) -> None:
    # Sums of planar forces that leave no other wrench, made by projecting random ones and shrinking
    # them.
    layout = shipped("mixed")
    sets = force_sets(layout)
    own = AXES_OF_KIND[kind]
    other = AXES_OF_KIND["torque" if kind == "force" else "force"]
    effectiveness = sets.effectiveness[0].reshape(-1, 6)
    _, _, directions = np.linalg.svd(effectiveness[:, other].T)
    kept = directions[3:]
    drawn = np.random.default_rng(0).standard_normal((20_000, len(kept))) @ kept
    thrust = np.linalg.norm(drawn.reshape(-1, layout.n_fins, 2), axis=-1)
    drawn /= (thrust / sets.radius[0]).max(axis=-1)[:, None]
    points = (drawn @ effectiveness)[:, own] * SCALE[own]
    body = attainable_set(layout, kind)
    assert outside(body, points) <= body.gap + 1e-6
    # The draws reach most of the way in every direction.
    reach = (body.vertices @ points.T).max(axis=1) / (body.vertices**2).sum(-1)
    assert reach.min() > 0.6
    assert np.quantile(reach, 0.5) > 0.85


def test_a_pair_gives_a_disc(shipped: Layouts) -> None:
    disc = attainable_set(shipped("pair"), "force")
    assert disc.dimension == 2
    assert len(disc.faces) == 0
    assert len(disc.outline) == len(disc.vertices)
    assert np.linalg.norm(disc.vertices, axis=-1) == pytest.approx(2 * THRUST, rel=1e-4)
    assert np.abs(disc.vertices[:, 1]).max() < 1e-9


def test_no_yaw_gives_no_yaw(shipped: Layouts) -> None:
    flat = attainable_set(shipped("no_yaw"), "torque")
    assert flat.dimension == 2
    assert np.abs(flat.vertices[:, 2]).max() < 1e-9
    assert np.abs(flat.vertices[:, 0]).max() == pytest.approx(2 * 0.25 * THRUST, rel=1e-3)


def test_one_fin_alone_gives_nothing_without_torque(shipped: Layouts) -> None:
    layout = shipped("A")
    one = attainable_set(layout, "force", lost=layout.names[1:])
    assert one.dimension == 0
    assert np.abs(one.vertices).max() < 1e-4
    assert attainable_set(layout, "force", lost=layout.names).dimension == 0


def test_layout_a_looks_the_same_in_the_mirror(shipped: Layouts) -> None:
    body = attainable_set(shipped("A"), "force")
    for mirror in ([-1, 1, 1], [1, -1, 1], [1, 1, -1]):
        assert outside(body, body.vertices * mirror) <= body.gap + 1e-6


@pytest.mark.parametrize("kind", ["force", "torque"])
@pytest.mark.parametrize("name", ["A", "restricted"])
def test_losing_a_fin_never_enlarges_a_set(shipped: Layouts, name: str, kind: str) -> None:
    layout = shipped(name)
    whole = attainable_set(layout, kind, tolerance=0.05)
    left = attainable_set(layout, kind, lost=layout.names[:1], tolerance=0.05)
    assert outside(whole, left.vertices) <= whole.gap + 1e-4


def test_faces_are_seen_from_outside(shipped: Layouts) -> None:
    body = attainable_set(shipped("A"), "torque")
    a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
    assert ((np.cross(b - a, c - a) * (a + b + c)).sum(-1) > -1e-12).all()


def test_an_unknown_failed_fin_is_an_error(shipped: Layouts) -> None:
    with pytest.raises(LayoutError, match="has no fin 'nobody'"):
        attainable_set(shipped("A"), "force", lost=("nobody",))


AXIS_DIRECTIONS = np.concatenate([np.eye(6), -np.eye(6)])
"""Directions (12, 6) either way along each axis."""
FLOW_FROM_AHEAD = (1.5, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Flow of a robot that moves straight ahead: (6,) [m/s, rad/s]."""


def test_bluerov2_heavy_reaches_what_its_sources_say() -> None:
    held = authority(load_layout("bluerov2_heavy"))
    assert held.largest == pytest.approx((129.2, 126.5, 159.6, 34.3, 18.8, 30.6), rel=0.002)
    assert held.most_negative == pytest.approx((129.2, 126.5, 205.8, 34.3, 18.8, 30.6), rel=0.002)


@pytest.mark.parametrize(
    "kind", sampled(["fins any shaft", "azimuths", "mixed", "rudders", "thrusters"], every=2)
)
def test_as_far_as_linear_programs_by_another_plant(kind: str) -> None:
    rng = np.random.default_rng(7)
    for number in range(5):
        plant = random_plant(kind, number, 3)
        flow = random_flow(kind, number, 3)
        sets = force_sets(load(random_robot(kind, number, 3)), flow=flow)
        drawn = rng.standard_normal((6, 6))
        directions = drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)
        found = max_wrench_along_exactly(sets, directions)[0][0]
        best = np.array([farthest(plant, direction * SCALE) for direction in directions])
        # Polygons of uneven fins are up to 0.2 % too wide, those of the plant 0.01 % too narrow.
        size = 1e-3 * sets.radius.max()
        assert (found >= best * 0.998 - size).all(), (number, found, best)
        assert (found <= best * 1.004 + size).all(), (number, found, best)


def test_where_the_water_pushes_harder_than_all_can_hold() -> None:
    rng = np.random.default_rng(0)
    none = 0
    for number in range(6):
        robot = random_robot("rudders", number, 21)
        flow = rng.normal(size=6) * [1.5, 1.5, 1.5, 0.3, 0.3, 0.3]
        sets = force_sets(load(robot), flow=flow)
        plant = OraclePlant(robot, flow)
        directions = rng.normal(size=(4, 6))
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        found = max_wrench_along_exactly(sets, directions)[0][0]
        best = np.array([farthest(plant, direction * SCALE) for direction in directions])
        none += int((best == 0.0).sum())
        np.testing.assert_allclose(found, best, rtol=5e-3, atol=1e-3 * sets.radius.max())
    assert none >= 4


@pytest.mark.parametrize(
    ("name", "flow"), [("turtle_hybrid", None), ("catamaran", None), ("torpedo", FLOW_FROM_AHEAD)]
)
def test_no_command_goes_beyond_and_the_best_are_as_good(
    name: str, flow: tuple[float, ...] | None
) -> None:
    layout = replace(load_layout(name), axes=WRENCH)
    plant = Plant(layout)
    sets = force_sets(layout, flow=flow)
    drawn = np.random.default_rng(2).standard_normal((30, 6))
    directions = np.concatenate(
        [AXIS_DIRECTIONS, drawn / np.linalg.norm(drawn, axis=1, keepdims=True)]
    )
    water = None if flow is None else np.array(flow)
    share = np.random.default_rng(3).uniform(-0.2, 1.2, (20_000, layout.n, 3)).clip(0.0, 1.0)
    command = layout.lower + share * (layout.upper - layout.lower)
    alone = np.full((20_000, layout.n, 3), np.nan)
    most = np.zeros(len(directions))
    for i in range(layout.n):
        alone[:] = np.nan
        alone[:, i] = command[:, i]
        most += (plant.wrench(alone, flow=water) / SCALE @ directions.T).max(axis=0)
    reach = sets.tile(len(directions)).farthest(directions)[0]
    np.testing.assert_allclose(most, reach, rtol=2e-3, atol=2e-3 * sets.radius.max())


def test_a_thruster_that_pulls_only_and_an_azimuth_that_cannot_stop() -> None:
    model = PowerLaw(1.0)
    pull = Thruster("pull", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-30.0, 0.0), model)
    tilt = Azimuth(
        "tilt", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (5.0, 20.0), model, (-0.5, 0.5)
    )
    layout = Layout("two", (pull, tilt))
    low, high = axis_ranges(layout, np.zeros(6))
    assert (low[0], high[0]) == pytest.approx((5.0 * np.cos(0.5) - 30.0, 20.0), abs=1e-3)
    assert axis_ranges(layout, np.zeros(6), lost=("pull",)).high[0] == pytest.approx(20.0, abs=1e-3)
    body = attainable_set(layout, "force")
    assert body.dimension == 2
    assert body.vertices[:, 0].max() == pytest.approx(20.0, abs=1e-3)


def test_a_torpedo_needs_speed() -> None:
    layout = replace(load_layout("torpedo"), axes=WRENCH)
    still = score_card(layout)
    ahead = score_card(layout, flow=FLOW_FROM_AHEAD)
    assert (still.authority.rank, ahead.authority.rank) == (1, 4)
    assert any("At rest rudder_top" in note for note in still.notes)
    assert not any("At rest" in note for note in ahead.notes)
    assert ahead.authority.coupled == ("sway", "heave", "pitch", "yaw")
    # Twice the speed is four times the lift.
    roll = [authority(layout, flow=[speed, 0, 0, 0, 0, 0]).largest[3] for speed in (0.5, 1.0)]
    assert roll[1] == pytest.approx(4.0 * roll[0], rel=0.02)


def test_a_lost_actuator_takes_its_drag_along() -> None:
    layout = load_layout("torpedo")
    sets = force_sets(layout, layout.names[1:], FLOW_FROM_AHEAD)
    assert sets.farthest(-np.eye(6)[:1])[0][0] == pytest.approx(104.7)
    assert score_card(layout, layout.names).authority.rank == 0
