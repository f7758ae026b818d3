"""Meshes are closed and face outwards; the blade trails behind its thrust."""

import math

import numpy as np
import pytest
import trimesh

from finlab.assets import shipped_layouts
from finlab.hull import Surface, hull_of
from finlab.hull.mesh import Mesh
from finlab.layout import Azimuth, Fin, Rudder, Thruster, load_layout
from webapp.scene import actuator_shapes as shapes
from webapp.scene.actuator_node import TURNS_PER_S, motion
from webapp.scene.arrows import NOTHING, force_arrow, torque_ring
from webapp.scene.direction_handle import on_sphere, snapped


def solid(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)


@pytest.mark.parametrize(
    "mesh",
    [
        shapes.blade(),
        shapes.shaft(),
        force_arrow(np.array([0.1, -0.2, 0.05]), np.zeros(3), 0.01),
        torque_ring(np.array([0.0, 0.1, 0.3]), np.zeros(3), 0.01),
    ],
    ids=["blade", "shaft", "arrow", "ring"],
)
def test_closed_and_outward(mesh: Mesh) -> None:
    body = solid(mesh)
    assert body.is_watertight and body.volume > 0
    assert np.isfinite(mesh.vertices).all()


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
    assert hull.contains(np.array([0.02, 0.0, 0.01])) and not hull.contains(np.array([0.5, 0.0, 0.0]))
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
    assert torque_ring(np.zeros(3), np.zeros(3), 0.01) is NOTHING


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


@pytest.mark.parametrize("name", ["bluerov2_heavy", "catamaran", "torpedo", "turtle_hybrid", "fish"])
def test_actuators_move_as_commanded_or_hang(name: str) -> None:
    for part in load_layout(shipped_layouts()[name]).actuators:
        full, back = motion(part, np.array(part.upper)), motion(part, np.array(part.lower))
        hung = motion(part, None)
        assert hung.turns == hung.amplitude == 0.0
        if isinstance(part, (Thruster, Azimuth)):
            assert full.turns == pytest.approx(TURNS_PER_S) and full.turns * back.turns <= 0.0
        if isinstance(part, Fin):
            assert (full.amplitude, full.frequency, full.angle) == pytest.approx(part.upper)
            limp = part.frame[2][2] * math.sin(hung.angle) + part.frame[1][2] * math.cos(hung.angle)
            assert limp == pytest.approx(math.hypot(part.frame[1][2], part.frame[2][2])), "its blade is low"
        if isinstance(part, Rudder):
            assert full.angle == part.upper[0]
