"""Meshes are closed and face outwards; reserved hues stay apart; marks of sliders do not
overlap."""

import math
import re
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from finlab.assets import shipped_layouts
from finlab.layout import Azimuth, Fin, Rudder, Thruster, load_layout
from finlab.swim.hull import Surface, hull_of
from finlab.swim.hull.mesh_file import Mesh
from tests.webapp.stand_in import Recorded
from webapp.markup.reach import reach_marks
from webapp.scene import actuator_shapes as shapes
from webapp.scene.actuator_node import TURNS_PER_S, motion, offered_mesh
from webapp.scene.actuator_shapes import CHORD, NOTHING, TURN, force_arrow, unit_arrow, unit_ring
from webapp.scene.force_nodes import WEDGES, ForceNodes, quaternion, turned_about_x, unit_wedge
from webapp.scene.wrench_nodes import about_z, along_x, on_sphere, snapped
from webapp.theme import ASKED, DELIVERED, FIN_COLORS, MISSING, Rgb, ink


def solid(mesh: Mesh) -> trimesh.Trimesh:
    """A mesh of the scene as trimesh takes it."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)


@pytest.mark.parametrize(
    "mesh",
    [
        shapes.blade(),
        shapes.shaft(),
        force_arrow(np.array([0.1, -0.2, 0.05]), np.zeros(3), 0.01),
        unit_arrow(0.01),
        unit_ring(0.07),
    ],
    ids=["blade", "shaft", "arrow", "unit arrow", "ring"],
)
def test_closed_and_outward(mesh: Mesh) -> None:
    body = solid(mesh)
    assert body.is_watertight and body.volume > 0
    assert np.isfinite(mesh.vertices).all()


def test_the_ghost_of_fins_that_are_offered_is_a_closed_mesh() -> None:
    layout = load_layout(shipped_layouts()["ucat"])
    ghost = solid(offered_mesh(layout.actuators, 1.0))
    assert ghost.is_watertight and ghost.volume > 0


def test_blade_trails_behind_its_thrust() -> None:
    # Zero direction zero pushes along +y' of the fin's frame, so the blade lies along -y'.
    blade = shapes.blade()
    assert blade.vertices[:, 1].min() < -0.15 and blade.vertices[:, 1].max() < 0.02
    extent = np.ptp(blade.vertices, axis=0)
    assert extent[:2] == pytest.approx([0.10, 0.18], abs=0.02)


@pytest.mark.parametrize("shape", ["box", "ellipsoid", "torpedo", "ucat"])
def test_hulls(shape: str) -> None:
    hull = Surface.of_shape(shape, (0.3, 0.12, 0.1), (0.02, 0.0, 0.01))
    mesh = hull.mesh
    assert solid(mesh).volume > 0
    assert mesh.vertices.max(axis=0) == pytest.approx([0.32, 0.12, 0.11], abs=0.01)
    assert hull.contains(np.array([0.02, 0.0, 0.01])) and not hull.contains(
        np.array([0.5, 0.0, 0.0])
    )
    anchor = hull.anchor(np.array([0.1, 0.4, 0.0]))
    assert 0.02 < anchor[1] < 0.13


def test_a_mesh_knows_inside_from_outside_of_a_ring() -> None:
    ring = trimesh.creation.annulus(0.1, 0.3, 0.2, sections=256)
    surface = Surface("mesh", (0.3, 0.3, 0.1), (0.0, 0.0, 0.0), Mesh(ring.vertices, ring.faces))
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (300, 3))
    radius = np.hypot(points[:, 0], points[:, 1])
    inside = (abs(radius - 0.2) < 0.1) & (abs(points[:, 2]) < 0.1)
    clear = abs(abs(radius - 0.2) - 0.1) > 1e-3  # the ring has corners, the circles have none
    assert 10 < inside.sum() < 290
    assert [surface.contains(point) for point in points[clear]] == inside[clear].tolist()


def test_every_shipped_layout_has_a_hull_near_its_fins() -> None:
    for path in shipped_layouts().values():
        layout = load_layout(path)
        hull = hull_of(layout)
        for one in layout.fins:
            gap = np.linalg.norm(np.array(one.position) - hull.anchor(np.array(one.position)))
            assert gap < 0.25, (layout.name, one.name)


def test_arrows_scale_and_vanish() -> None:
    way = np.array([0.3, 0.0, 0.0])
    assert force_arrow(way, np.zeros(3), 0.01).vertices[:, 0].max() == pytest.approx(0.3)
    assert force_arrow(0 * way, np.zeros(3), 0.01) is NOTHING


def test_unit_meshes_are_of_length_and_radius_one() -> None:
    arrow = unit_arrow(0.01).vertices
    assert (arrow[:, 0].min(), arrow[:, 0].max()) == pytest.approx((0.0, 1.0))
    assert np.hypot(arrow[:, 1], arrow[:, 2]).max() == pytest.approx(0.026)
    ring = unit_ring(0.05).vertices
    middle = ring[-2:]  # of both ends
    assert np.hypot(*middle[:, :2].T) == pytest.approx(1.0) and middle[:, 2] == pytest.approx(0.0)
    assert middle[0] == pytest.approx([1.0, 0.0, 0.0])
    assert middle[1] == pytest.approx([math.cos(TURN), math.sin(TURN), 0.0]), (
        "the head is at its end"
    )


def test_quaternions_are_those_of_scipy() -> None:
    rng = np.random.default_rng(4)
    halves = [Rotation.from_rotvec(math.pi * axis) for axis in np.eye(3)]
    for rotation in (*Rotation.random(50, random_state=4), *halves):
        known = rotation.as_quat()[[3, 0, 1, 2]]
        found = quaternion(rotation.as_matrix())
        assert abs(found @ known) == pytest.approx(1.0)
        angle = rng.uniform(-3.0, 3.0)
        both = (rotation * Rotation.from_euler("x", angle)).as_quat()[[3, 0, 1, 2]]
        assert abs(turned_about_x(found, np.array(angle)) @ both) == pytest.approx(1.0)


@pytest.mark.parametrize("turn", [along_x, about_z])
def test_directions_become_rotations(turn: Any) -> None:
    axis = 0 if turn is along_x else 2
    ways = [*np.random.default_rng(5).normal(size=(40, 3)), *np.eye(3), *-np.eye(3)]
    for way in ways:
        direction = way / np.linalg.norm(way)
        rotation = turn(direction)
        np.testing.assert_allclose(rotation[:, axis], direction, atol=1e-12)
        np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_forces_start_beside_blades_and_fans_reach_as_far_as_they_beat() -> None:
    layout = load_layout("ucat")
    scene = Recorded()
    nodes: Any = ForceNodes(scene)  # type: ignore[arg-type]
    nodes.place(layout, hull_of(layout), (1.0, 1.0))
    forces = np.array([[0.1, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 1e-6]])
    amplitude = np.array([0.5, 0.0, 0.0, 0.0])
    nodes.command(forces, amplitude, np.array([0.3, 0.0, 0.0, 0.0]))
    arrows = nodes._arrows.node
    fans = nodes._fans
    assert arrows.points.shape == (2, 2, 3) and arrows.visible and fans.visible
    np.testing.assert_allclose(arrows.points[:, 1] - arrows.points[:, 0], forces[[0, 2]], atol=1e-4)
    light = [255.0 * linear(FIN_COLORS[k]) for k in (0, 2)]
    np.testing.assert_allclose(arrows.colors, light, atol=0.5)
    wedge = unit_wedge().vertices
    angles = []
    assert fans.batched_wxyzs.shape == (WEDGES, 4)
    for wxyz, place, scale in zip(
        fans.batched_wxyzs, fans.batched_positions, fans.batched_scales, strict=True
    ):
        turned = Rotation.from_quat(wxyz[[1, 2, 3, 0]]).apply(wedge * scale) + place
        own = (turned - nodes._middles[0]) @ layout.frames[0].T
        assert own[:, 0] == pytest.approx(0.0, abs=1e-3), "all of it lies across the shaft"
        assert np.hypot(own[:, 1], own[:, 2]).max() == pytest.approx(CHORD, rel=0.05)
        angles += np.arctan2(-own[:, 2], -own[:, 1]).tolist()
    assert (min(angles), max(angles)) == pytest.approx((0.3 - 0.5, 0.3 + 0.5), abs=2e-3)
    nodes.command(0.0 * forces, 0.0 * amplitude, amplitude)
    assert not arrows.visible and not fans.visible


def test_a_direction_follows_the_hand_on_a_sphere_and_jumps_to_axes() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        eye, before, goal = rng.normal(size=(3, 3))
        eye *= 3.0 / np.linalg.norm(eye)
        goal *= 0.3 / np.linalg.norm(goal)
        found = on_sphere(eye, goal - eye, 0.3, goal)
        assert found == pytest.approx(goal / 0.3, abs=1e-9), "the point of the sphere on the ray"
        passing = on_sphere(eye, before, 0.3, before)
        assert np.linalg.norm(passing) == pytest.approx(1.0)
    assert snapped(np.array([0.05, -0.997, 0.05])) == pytest.approx([0.0, -1.0, 0.0])
    free = np.array([0.6, 0.8, 0.0])
    assert snapped(free) is free


@pytest.mark.parametrize(
    "name", ["bluerov2_heavy", "catamaran", "torpedo", "turtle_hybrid", "fish"]
)
def test_actuators_move_as_commanded_or_hang(name: str) -> None:
    for part in load_layout(shipped_layouts()[name]).actuators:
        full = motion(part, np.array(part.upper))
        back = motion(part, np.array(part.lower))
        hung = motion(part, None)
        assert hung.turns == hung.amplitude == 0.0
        if isinstance(part, (Thruster, Azimuth)):
            assert full.turns == pytest.approx(TURNS_PER_S) and full.turns * back.turns <= 0.0
        if isinstance(part, Fin):
            assert (full.amplitude, full.frequency, full.angle) == pytest.approx(part.upper)
            limp = part.frame[2][2] * math.sin(hung.angle) + part.frame[1][2] * math.cos(hung.angle)
            assert limp == pytest.approx(math.hypot(part.frame[1][2], part.frame[2][2])), (
                "its blade is low"
            )
        if isinstance(part, Rudder):
            assert full.angle == part.upper[0]


LINEAR_RGB_TO_LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
"""Matrix from linear red, green and blue to the cones of the eye (Ottosson 2020)."""
LMS_TO_OKLAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
"""Matrix from their cube roots to Oklab."""


def linear(color: Rgb) -> np.ndarray:
    """Red, green and blue as light (3,)."""
    share = np.array(color) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def oklab(color: Rgb) -> np.ndarray:
    """Lightness and two opponent axes (3,), in which distances are as the eye sees them."""
    return LMS_TO_OKLAB @ np.cbrt(LINEAR_RGB_TO_LMS @ linear(color))


def reserved() -> dict[str, Rgb]:
    """The three hues on light, and on dark as the style has them."""
    style = files("webapp.markup").joinpath("style.css").read_text("utf-8")
    dark = re.findall(r"--fl-(asked|delivered|missing): rgb\((\d+),(\d+),(\d+)\)", style)
    found = {f"{word}, dark": (int(r), int(g), int(b)) for word, r, g, b in dark}
    assert len(found) == 3
    return {"asked": ASKED, "delivered": DELIVERED, "missing": MISSING, **found}


@pytest.mark.parametrize("fin", FIN_COLORS)
def test_no_fin_comes_near_a_reserved_hue(fin: Rgb) -> None:
    seen = oklab(fin)
    for word, color in reserved().items():
        other = oklab(color)
        turn = math.degrees(math.atan2(seen[2], seen[1]) - math.atan2(other[2], other[1]))
        assert abs((turn + 180.0) % 360.0 - 180.0) > 40.0, f"hue of {fin} and {word}"
        assert np.linalg.norm(seen - other) > 0.12, f"{fin} and {word}"


def test_fins_differ_and_their_numbers_can_be_read() -> None:
    for k, fin in enumerate(FIN_COLORS):
        for other in FIN_COLORS[:k]:
            assert np.linalg.norm(oklab(fin) - oklab(other)) > 0.08
        light, number = (float(linear(c) @ (0.2126, 0.7152, 0.0722)) for c in (fin, _rgb(ink(fin))))
        bright = max(light, number) + 0.05
        dim = min(light, number) + 0.05
        assert bright / dim > 3.9, f"the number on {fin}"


LIGHT_TO_CONES = np.array(
    [[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.0299566, 0.184309, 1.46709]]
)
"""Matrix from linear red, green and blue to the answers of the three kinds of cones."""
WITHOUT_CONES = {
    "long": np.array([[0.0, 2.02344, -2.52581], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    "middle": np.array([[1.0, 0.0, 0.0], [0.494207, 0.0, 1.24827], [0.0, 0.0, 1.0]]),
}
"""What is left of the cones' answers without one kind (Viénot, Brettel and Mollon, 1999)."""


@pytest.mark.parametrize("missing", WITHOUT_CONES)
def test_thirty_fins_differ_for_eyes_without_one_kind_of_cones(missing: str) -> None:
    to_light = np.linalg.inv(LIGHT_TO_CONES)
    seen = []
    for fin in FIN_COLORS:
        light = np.clip(to_light @ WITHOUT_CONES[missing] @ LIGHT_TO_CONES @ linear(fin), 0.0, 1.0)
        seen.append(LMS_TO_OKLAB @ np.cbrt(LINEAR_RGB_TO_LMS @ light))
    assert len(seen) >= 30
    for k, fin in enumerate(seen):
        for other in seen[:k]:
            assert np.linalg.norm(fin - other) > 0.05


def _rgb(color: str) -> Rgb:
    """Red, green and blue of a grey such as "#ccc"."""
    digit = int(color[1], 16) * 17
    return digit, digit, digit


@pytest.mark.parametrize(
    ("low", "high", "marks"),
    [
        (-12.04, 11.0, ((-12.04, "−12"), (11.0, "11"))),
        (-1.9, 1.9, ((-1.9, ""), (1.9, "±1.9"))),
        (3.1234, 5.0, ((3.123, ""), (5.0, "3.1 … 5.0"))),
        (-0.04, 2.0, ((-0.04, ""), (2.0, "0 … 2.0"))),
        (2.0, 2.0, ((2.0, "2.0"),)),
        (math.nan, math.nan, ()),
    ],
)
def test_marks_of_a_slider_that_is_forty_long(
    low: float, high: float, marks: tuple[tuple[float, str], ...]
) -> None:
    assert reach_marks(low, high, 40.0) == marks


def test_marks_of_a_short_slider_have_more_digits() -> None:
    assert reach_marks(-0.04, 0.06, 0.15) == ((-0.04, "−0.040"), (0.06, "0.060"))
