"""Largest wrenches: in closed form, against linear programmes, against the plant."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import linprog

from finlab.analysis import authority
from finlab.forces.force_sets import SCALE, ForceSets, convex_parts, force_sets
from finlab.forces.reach import (
    axis_ranges,
    largest_along_rays,
    max_wrench_along,
    max_wrench_along_exactly,
)
from finlab.layout import Layout
from finlab.physics import Plant
from tests.forces.conftest import THRUST, largest_by_polygons
from tests.forces.test_force_sets import HALF_ANGLES, sectors
from tests.sampled_cases import crossed

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""
AXIS_DIRECTIONS = np.concatenate([np.eye(6), -np.eye(6)])
"""Directions (12, 6) either way along each axis."""


def test_layout_b_in_closed_form(shipped: Layouts) -> None:
    # Fins at the ends of a cross with arms d push forward in twos, up in fours, and all around for
    # yaw.
    layout = shipped("B")
    arm = max(np.linalg.norm(fin.position) for fin in layout.fins)
    held = authority(layout)
    expected = np.array([2, 2, 4, 2 * arm, 2 * arm, 4 * arm]) * THRUST
    assert held.largest == pytest.approx(expected, rel=1e-4)
    assert held.most_negative == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("name", ["A", "D", "no_yaw", "restricted", "mixed", "octo"])
def test_bracketed_by_linear_programmes(shipped: Layouts, name: str) -> None:
    sets = force_sets(shipped(name))
    mixture = np.random.default_rng(0).standard_normal((3, 6))
    directions = np.concatenate(
        [AXIS_DIRECTIONS[::3], mixture / np.linalg.norm(mixture, axis=1, keepdims=True)]
    )
    found, gap = max_wrench_along_exactly(sets, directions)
    assert gap < 2e-5
    for direction, value in zip(directions, found[0], strict=True):
        inside = largest_by_polygons(sets, direction, 180, outer=False)
        outside = largest_by_polygons(sets, direction, 180, outer=True)
        assert inside - 1e-6 <= value <= outside + gap + 1e-6


def test_wide_arcs_count_piece_by_piece(wide: Layout) -> None:
    sets = force_sets(wide)
    size = max_wrench_along_exactly(sets, AXIS_DIRECTIONS)[0][0]
    parts = convex_parts(sets)
    assert len(parts.radius) == 4
    by_piece = np.array(
        [
            [
                largest_by_polygons(part, direction, 180, outer=False)
                for direction in AXIS_DIRECTIONS
            ]
            for part in (parts.take(np.array([k])) for k in range(4))
        ]
    )
    assert size == pytest.approx(by_piece.max(axis=0), rel=1e-3, abs=1e-4)
    hull = max_wrench_along(sets.tile(12), AXIS_DIRECTIONS).size
    assert (hull >= size - 1e-4).all()
    assert (hull > size + 1e-3).any()


def test_the_plant_gives_the_largest_wrench(shipped: Layouts) -> None:
    layout = shipped("mixed")
    sets = force_sets(layout)
    for direction in AXIS_DIRECTIONS:
        found = max_wrench_along(sets, direction[None])
        force = found.force[0]
        thrust = np.hypot(*force.T)
        angle = np.arctan2(force[:, 1], force[:, 0])
        wrench = Plant(layout).wrench(_commands(layout, thrust, angle))
        assert wrench / SCALE == pytest.approx(found.size[0] * direction, abs=1e-3)


def _commands(layout: Layout, thrust: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Commands at full amplitude whose frequency gives the thrusts; both laws grow with its
    square."""
    upper = layout.upper
    full = np.linalg.norm(
        Plant(layout).body_forces(np.where([True, True, False], upper, 0.0)), axis=-1
    )
    return np.stack([upper[:, 0], upper[:, 1] * np.sqrt(thrust / full), angle], axis=-1)


@pytest.mark.parametrize("name", ["A", "restricted", "mixed"])
def test_no_sampled_command_goes_beyond(shipped: Layouts, name: str) -> None:
    layout = shipped(name)
    rng = np.random.default_rng(2)
    lower = layout.lower
    upper = layout.upper
    wrench = Plant(layout).wrench(rng.uniform(lower, upper, (4_000, layout.n_fins, 3))) / SCALE
    size, _ = force_sets(layout).tile(12).farthest(AXIS_DIRECTIONS)
    assert ((wrench @ AXIS_DIRECTIONS.T).max(axis=0) <= size + 1e-3).all()


@pytest.mark.parametrize("name", ["A", "restricted", "mixed"])
def test_the_plant_reaches_as_far_as_it_is_said_to(shipped: Layouts, name: str) -> None:
    # What fins do adds up, so the best of each fin's commands, all tried, make up the best of all
    # of them.
    layout = shipped(name)
    plant = Plant(layout)
    drawn = np.random.default_rng(3).standard_normal((30, 6))
    directions = np.concatenate(
        [AXIS_DIRECTIONS, drawn / np.linalg.norm(drawn, axis=1, keepdims=True)]
    )
    best = np.zeros(len(directions))
    for i, fin in enumerate(layout.fins):
        command = np.full((2_000, layout.n_fins, 3), np.nan)
        command[:, i, :2] = fin.limits.upper[:2]
        command[:, i, 2] = np.linspace(*fin.limits.zero_direction, 2_000)
        best += np.maximum((plant.wrench(command) / SCALE @ directions.T).max(axis=0), 0.0)
    size, _ = force_sets(layout).tile(len(directions)).farthest(directions)
    assert size == pytest.approx(best, rel=1e-5, abs=1e-9)


def random_sectors(half: float, scale: float) -> ForceSets:
    """Sets of 40 robots of five actuators, with sectors of one half angle [rad]."""
    rng = np.random.default_rng(5)
    effectiveness = scale * rng.standard_normal((40, 5, 2, 6))
    return sectors(
        effectiveness, rng.uniform(0.5, 3.0, (40, 5)), rng.uniform(-3.0, 3.0, (40, 5)), half
    )


@pytest.mark.parametrize(("half", "scale"), crossed(HALF_ANGLES, [1e-3, 1.0, 1e3], every=2))
def test_a_plane_and_forces_prove_each_size(half: float, scale: float) -> None:
    sets = random_sectors(half, scale)
    rng = np.random.default_rng(6)
    ray = rng.standard_normal((40, 6))
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    inside = sets.farthest(rng.standard_normal((40, 6)))[1]
    origin = 0.5 * sets.wrench(inside)
    found = largest_along_rays(sets, ray, origin)
    end = origin + found.size[:, None] * ray
    normal = found.normal / np.linalg.norm(found.normal, axis=-1, keepdims=True)
    small = 1e-7 * float(sets.unit.max())
    assert (normal * end).sum(-1) == pytest.approx(sets.farthest(normal)[0], rel=1e-9, abs=small)
    assert sets.wrench(found.force) == pytest.approx(end, abs=small)
    assert found.gap.max() < small
    assert (np.linalg.norm(found.force, axis=-1) <= sets.radius * (1.0 + 1e-9)).all()
    if half <= np.pi / 2:
        angle = np.arctan2(found.force[..., 1], found.force[..., 0]) - sets.sector_center
        assert (np.cos(angle) >= np.cos(half) - 1e-6)[
            np.linalg.norm(found.force, axis=-1) > 1e-3
        ].all()


@pytest.mark.filterwarnings("error")
def test_robots_without_anything_to_push_with() -> None:
    sets = random_sectors(1.0, 1.0)
    ray = np.tile(np.eye(6)[0], (40, 1))
    for dead in (
        sets._replace(radius=np.zeros((40, 5))),
        sets._replace(effectiveness=np.zeros((40, 5, 2, 6))),
        sets._replace(effectiveness=np.repeat(sets.effectiveness[:, :1], 5, axis=1)),
    ):
        found = max_wrench_along(dead, ray)
        assert (
            found.size == pytest.approx(np.zeros(40), abs=1e-6) and np.isfinite(found.normal).all()
        )
        assert (
            largest_along_rays(dead, ray, np.tile(100.0 * np.eye(6)[1], (40, 1))).size.max()
            == -np.inf
        )


N_CORNERS = 96
"""Corners of the polygon by which a sector is bracketed."""


def ranges_by_polygons(layout: Layout, wrench: list[float], lost: tuple[str, ...]) -> np.ndarray:
    """Ranges (6, 2) [N, N m] with each fin's disc as a polygon within it; NaN where there are
    none."""
    sets = force_sets(layout, lost)
    n = sets.radius.shape[1]
    turn = sets.sector_center[0, :, None] + sets.sector_half_angle[0, :, None] * np.linspace(
        -1, 1, N_CORNERS
    )
    force = sets.radius[0, :, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    corners = np.einsum("npc,nck->npk", force, sets.effectiveness[0]).reshape(-1, 6)
    share = np.kron(np.eye(n), np.ones(N_CORNERS))
    found = np.full((6, 2), np.nan)
    for k in range(6):
        held = [j for j in range(6) if j != k]
        for column, sign in enumerate((-1.0, 1.0)):
            result = linprog(
                -sign * corners[:, k],
                A_ub=share,
                b_ub=np.ones(n),
                A_eq=corners[:, held].T,
                b_eq=(np.array(wrench) / SCALE)[held],
            )
            if result.status == 0:
                found[k, column] = -sign * result.fun * SCALE[k]
    return found


@pytest.mark.parametrize(
    ("name", "wrench", "lost"),
    [
        ("ucat", [1.2, 0, 0, 0, 0, 0.25], ()),
        ("ucat", [1.2, 0, 0, 0, 0, 0.25], ("front_left",)),
        ("penta", [5, 1, -3, 0.1, 0.2, 0.3], ()),
        ("restricted", [0, 0, 0, 0, 0, 0], ()),
        ("no_yaw", [1.2, 0, 0, 0, 0, 0.25], ()),
        ("A", [1, 0.5, -4, 0.5, 0.8, 0.3], ("front_right",)),
        ("restricted", [1, 1, 5, 0.5, 0.2, -1], ("front_right",)),
    ],
)
def test_ranges_are_those_of_linear_programmes(
    shipped: Layouts, name: str, wrench: list[float], lost: tuple[str, ...]
) -> None:
    layout = shipped(name)
    low, high = axis_ranges(layout, wrench, lost)
    expected = ranges_by_polygons(layout, wrench, lost)
    assert low == pytest.approx(expected[:, 0], rel=2e-3, abs=2e-3, nan_ok=True)
    assert high == pytest.approx(expected[:, 1], rel=2e-3, abs=2e-3, nan_ok=True)
