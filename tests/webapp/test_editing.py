"""Links, rings, sticking to the hull, hulls from numbers and from files."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.layout.body import Hull
from webapp.scene.meshes.hull import hull_of
from webapp.scene.meshes.mesh_hull import MAX_BYTES, read_mesh
from webapp.session import Session, layout_edits
from webapp.session.files import stored_hull
from webapp.session.targets import axis_reach


@pytest.fixture
def session() -> Session:
    return Session(load_layout(shipped_layouts()["ucat"]))


def test_linked_twins_move_together_until_unlinked(session: Session) -> None:
    session.select("front_left")
    session.mirror_fin()
    assert session.state.layout.n_fins == 4, "its image stands there already"
    assert session.state.links == (("front_left", "front_right"),) and session.selected == "front_right"
    session.move_fin("front_left", (0.2, 0.18, 0.01))
    session.turn_fin("front_left", 0.5)
    twin = session.state.layout.fins[0]
    assert twin.position == (0.2, -0.18, 0.01) and twin.mounting_angle == pytest.approx(-0.5)
    session.undo()
    session.undo()
    assert session.state.layout == load_layout(shipped_layouts()["ucat"])
    session.unlink_fin()
    session.move_fin("front_left", (0.1, 0.2, 0.0))
    assert session.state.layout.fins[0].position[0] == pytest.approx(0.25753)
    with pytest.raises(FinlabError, match="not linked"):
        session.unlink_fin()


def test_link_goes_with_its_fin(session: Session) -> None:
    session.select("front_left")
    session.mirror_fin()
    session.delete_fin()
    assert session.state.links == ()


def test_ring_around_the_vertical_axis(session: Session) -> None:
    session.open_layout(load_layout(shipped_layouts()["pair"]))
    first = session.state.layout.fins[0]
    session.select(first.name)
    session.ring_of_fins(4)
    assert session.state.layout.n_fins == 5
    radius = math.hypot(*first.position[:2])
    new = session.state.layout.fins[2:]
    assert all(math.hypot(*fin.position[:2]) == pytest.approx(radius) for fin in new)
    turned = new[0].mounting_angle - first.mounting_angle
    assert math.cos(turned) == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(FinlabError, match="at most 8"):
        session.ring_of_fins(8)
    assert session.state.layout.n_fins == 5


def test_stuck_fin_stands_off_the_surface_along_its_normal(session: Session) -> None:
    session.set_display("stick", True)
    session.move_fin("front_left", (0.1, 0.4, 0.0))
    fin = session.state.layout.fins[1]
    point, normal = hull_of(session.state.layout).nearest(np.array(fin.position))
    assert np.linalg.norm(np.subtract(fin.position, point)) == pytest.approx(0.02, abs=2e-3)
    assert normal[1] > 0.9 and fin.mounting_angle == pytest.approx(math.pi / 2, abs=0.2)


def test_hull_by_numbers_and_centre_of_gravity(session: Session) -> None:
    session.set_hull("torpedo", (0.9, 0.2, 0.2))
    layout = session.state.layout
    assert layout.body is not None and layout.body.hull is not None and layout.body.mass_kg == 19.0
    assert hull_of(layout).half == (0.45, 0.1, 0.1)
    reach = axis_reach(layout)
    session.set_center_of_gravity((0.05, 0.0, -0.02))
    moved = session.state.layout
    assert layout_edits.center_of_gravity(moved) == pytest.approx((0.05, 0.0, -0.02))
    assert moved.fins[0].position == pytest.approx((0.20753, -0.1502, 0.02))
    assert axis_reach(moved)[:3] == pytest.approx(reach[:3]) and axis_reach(moved)[3] > reach[3]
    for bad in ((math.nan, 0.1, 0.1), (0.0, 0.1, 0.1)):
        with pytest.raises(FinlabError, match="length of the hull"):
            session.set_hull("box", bad)


@pytest.mark.parametrize("kind", ["stl", "obj", "glb"])
def test_mesh_hull_in_millimetres(
    session: Session, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    box = trimesh.creation.box((600, 200, 100))
    box.update_faces(np.arange(12) != 3)  # a hole, to be mended
    content = box.export(file_type=kind)
    content = content.encode() if isinstance(content, str) else content
    session.import_hull(stored_hull(f"my hull.{kind}", content, "mm"))
    hull = hull_of(session.state.layout)
    assert hull.shape == "mesh" and hull.half == pytest.approx((0.3, 0.1, 0.05))
    inside = hull.contains(np.array([[0.0, 0.0, 0.0], [0.29, 0.09, 0.04], [0.31, 0.0, 0.0]]))
    assert inside.tolist() == [True, True, False]
    point, normal = hull.nearest(np.array([0.1, 0.5, 0.0]))
    assert point == pytest.approx((0.1, 0.1, 0.0)) and normal == pytest.approx((0.0, 1.0, 0.0))
    assert hull.anchor(np.array([0.1, 0.5, 0.0])) == pytest.approx((0.1, 0.1, 0.0))
    assert len(hull.mesh().faces) >= 12


def test_bad_meshes_are_refused_in_words() -> None:
    box = trimesh.creation.box((600, 200, 100)).export(file_type="stl")
    for name, content, scale, said in (
        ("x.stl", box, 1.0, "another unit"),
        ("x.exe", box, 1.0, "ending in"),
        ("x.stl", b"", 1.0, "x.stl"),
        ("x.glb", b"glTF nonsense", 1.0, "GLB"),
        ("x.obj", b"v 0 0 nan\n", 1.0, "x.obj"),
        ("x.stl", bytes(MAX_BYTES + 1), 1.0, "at most"),
    ):
        with pytest.raises(FinlabError, match=said):
            read_mesh(name, content, scale)


def test_missing_mesh_file_is_no_disaster(session: Session) -> None:
    session.import_hull(Hull(mesh="/nowhere/hull.stl"))
    assert hull_of(session.state.layout).shape != "mesh"
