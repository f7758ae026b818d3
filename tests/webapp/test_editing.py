"""Links, rings, hulls from numbers and from files."""

import math
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import trimesh

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.layout.body import Hull
from finlab.layout.layout import MAX_ACTUATORS
from finlab.swim.hull import hull_of
from finlab.swim.hull.mesh_file import (
    MAX_BYTES,
    MAX_FACES,
    MeshReport,
    read_mesh,
    simplified,
    turned,
)
from tests.webapp.stand_in import turn_fin
from webapp.markup.score_card import warnings
from webapp.panels.pairs import broken_pairs_words
from webapp.session import Session, layout_edits
from webapp.session.files import reshaped_hull, stored_hull
from webapp.session.targets import axis_reach


def test_linked_twins_move_together_until_unlinked(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    assert session.state.layout.n_fins == 4, "its image stands there already"
    assert (
        session.state.layout.mirror_pairs == (("front_left", "front_right"),)
        and session.selected == "front_right"
    )
    session.end_drag("front_left", (0.2, 0.18, 0.01))
    turn_fin(session, "front_left", 0.5)
    twin = session.state.layout.fins[0]
    assert twin.position == (0.2, -0.18, 0.01) and twin.mounting_angle == pytest.approx(-0.5)
    session.undo()
    session.undo()
    assert session.state.layout.unpaired == load_layout(shipped_layouts()["ucat"])
    session.unlink()
    session.end_drag("front_left", (0.1, 0.2, 0.0))
    assert session.state.layout.fins[0].position[0] == pytest.approx(0.25753)
    with pytest.raises(FinlabError, match="not linked"):
        session.unlink()


def test_link_goes_with_its_fin(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    before = session.state.layout
    session.delete()
    assert session.state.layout.mirror_pairs == ()
    sentence = broken_pairs_words(before, session.state.layout)
    assert sentence == "front_left moves by itself: it is not linked to front_right any more"
    session.undo()
    assert session.state.layout.mirror_pairs == (("front_left", "front_right"),)


def test_pairs_end_where_the_mirror_plane_moves(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    paired = session.state.layout
    x, y, z = layout_edits.center_of_gravity(paired)
    session.set_center_of_gravity((x + 0.05, y, z - 0.01))
    assert session.state.layout.mirror_pairs == paired.mirror_pairs, "along the plane"
    assert broken_pairs_words(paired, session.state.layout) == ""
    session.set_center_of_gravity((x, y + 0.05, z))
    moved = session.state.layout
    assert moved.mirror_pairs == ()
    assert "each moves by itself" in broken_pairs_words(paired, moved)
    session.end_drag("front_left", (0.2, 0.18, 0.01))
    assert session.state.layout.fins[0] == moved.fins[0], "the other one stays"


def test_another_pair_ends_the_one_before(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    session.select("back_left")
    session.mirror()
    both = session.state.layout
    assert broken_pairs_words(load_layout("ucat"), both) == ""
    linked = layout_edits.linked(both, "front_left", "back_right")
    assert linked.mirror_pairs == (("front_left", "back_right"),)
    sentences = broken_pairs_words(both, linked).split("; ")
    assert [sentence.partition(" ")[0] for sentence in sentences] == ["front_right", "back_left"]


def test_ring_around_the_vertical_axis(session: Session) -> None:
    session.open_layout(load_layout(shipped_layouts()["pair"]))
    first = session.state.layout.fins[0]
    session.select(first.name)
    session.ring(4)
    assert session.state.layout.n_fins == 5
    radius = math.hypot(*first.position[:2])
    new = session.state.layout.fins[2:]
    assert all(math.hypot(*fin.position[:2]) == pytest.approx(radius) for fin in new)
    turned = new[0].mounting_angle - first.mounting_angle
    assert math.cos(turned) == pytest.approx(0.0, abs=1e-9)
    session.ring(8)
    with pytest.raises(FinlabError, match=f"at most {MAX_ACTUATORS}"):
        session.ring(MAX_ACTUATORS)
    assert session.state.layout.n_fins == 12


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
    session.import_hull(stored_hull(f"my hull.{kind}", content))
    hull = hull_of(session.state.layout)
    assert hull.shape == "mesh" and hull.half == pytest.approx((0.3, 0.1, 0.05))
    inside = hull.contains(np.array([[0.0, 0.0, 0.0], [0.29, 0.09, 0.04], [0.31, 0.0, 0.0]]))
    assert inside.tolist() == [True, True, False]
    point, normal = hull.nearest(np.array([0.1, 0.5, 0.0]))
    assert point == pytest.approx((0.1, 0.1, 0.0)) and normal == pytest.approx((0.0, 1.0, 0.0))
    assert hull.anchor(np.array([0.1, 0.5, 0.0])) == pytest.approx((0.1, 0.1, 0.0))
    assert len(hull.mesh.faces) >= 12


def test_bad_meshes_are_refused_in_words() -> None:
    box = trimesh.creation.box((600, 200, 100)).export(file_type="stl")
    for name, content, scale, said in (
        ("x.stl", box, 1.0, "another unit"),
        ("x.exe", box, 1.0, "ending in"),
        ("x.stl", b"", 1.0, "x.stl"),
        ("x.glb", b"glTF nonsense", 1.0, "GLB"),
        ("x.obj", b"v 0 0 nan\n", 1.0, "x.obj"),
        (
            "x.obj",
            b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            1.0,
            "1 of its 3 corners are not finite",
        ),
        (
            "x.obj",
            b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n",
            1.0,
            "is an open sheet, 4 of its",
        ),
        ("x.stl", bytes(MAX_BYTES + 1), 1.0, "at most"),
    ):
        with pytest.raises(FinlabError, match=said):
            read_mesh(name, content, scale)


def test_what_is_found_in_a_mesh_and_mended() -> None:
    box = trimesh.creation.box((0.6, 0.2, 0.1)).subdivide().subdivide()
    whole, report = read_mesh("box.stl", box.export(file_type="stl"), 1.0)
    assert report == MeshReport(192, True, ()) and np.ptp(whole.vertices, axis=0) == pytest.approx(
        (0.6, 0.2, 0.1)
    )
    faces = np.concatenate([box.faces[1:], box.faces[5:7], [[3, 3, 4]]])
    faces[10] = faces[10][::-1]
    worn = trimesh.Trimesh(box.vertices, faces, process=False)
    _, report = read_mesh("box.stl", worn.export(file_type="stl"), 1.0)
    told = "; ".join(report.mended)
    assert report.is_watertight and report.triangles == 192
    assert "3 triangles without an area or twice there left out" in told
    assert "1 triangle added to close holes" in told and "1 triangle turned outwards" in told


def test_a_hull_from_a_file_is_turned_scaled_and_simplified(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    ball = trimesh.creation.icosphere(subdivisions=6)
    ball.apply_scale((300.0, 100.0, 50.0))
    assert len(ball.faces) > MAX_FACES
    hull = stored_hull("ball.stl", ball.export(file_type="stl"))
    session.import_hull(hull)
    drawn = hull_of(session.state.layout)
    assert (
        drawn.report is not None
        and drawn.report.is_watertight
        and drawn.report.triangles <= MAX_FACES
    )
    assert drawn.half == pytest.approx((0.3, 0.1, 0.05), rel=1e-2)
    about_z = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for change, half in (
        (lambda mesh: turned(mesh, about_z), (0.1, 0.3, 0.05)),
        (lambda mesh: mesh._replace(vertices=2.0 * mesh.vertices), (0.6, 0.2, 0.1)),
        (lambda mesh: simplified(mesh, 500), (0.3, 0.1, 0.05)),
    ):
        session.import_hull(reshaped_hull(hull, change))
        found = hull_of(session.state.layout)
        assert found.report is not None and found.half == pytest.approx(half, rel=3e-2)
    assert found.report.triangles <= 500 and found.report.is_watertight
    assert found.contains(np.array([[0.29, 0.0, 0.0], [0.0, 0.0, 0.06]])).tolist() == [True, False]
    with pytest.raises(FinlabError, match="import a mesh first"):
        reshaped_hull(Hull(shape="box", size_m=(1.0, 1.0, 1.0)), lambda mesh: mesh)


def test_missing_mesh_file_is_no_disaster(session: Session) -> None:
    session.import_hull(Hull(mesh="/nowhere/hull.stl"))
    assert hull_of(session.state.layout).shape != "mesh"


def test_new_fins_and_copies_stand_apart(session: Session) -> None:
    for _ in range(4):
        session.add("fin")
    layout = session.state.layout
    new = [fin.position for fin in layout.fins[4:]]
    gaps = [math.dist(a.position, b.position) for a, b in combinations(layout.fins, 2)]
    assert len(set(new)) == 4 and min(gaps) >= 0.12 and warnings(layout) == ()
    for _ in range(3):
        session.select("front_left")
        session.duplicate()
    heights = [
        fin.position[2] for fin in session.state.layout.fins if fin.name.startswith("front_left")
    ]
    assert heights == pytest.approx([0.0, 0.05, 0.1, 0.15])
    while session.state.layout.n_fins < MAX_ACTUATORS:
        session.add("fin")
    with pytest.raises(FinlabError, match=f"at most {MAX_ACTUATORS}"):
        session.add("fin")


def test_a_hull_that_nobody_described_stays_while_fins_move() -> None:
    session = Session(load_layout(shipped_layouts()["A"]))
    assert session.state.layout.body is None or session.state.layout.body.hull is None
    before = hull_of(session.state.layout)
    name = session.state.layout.names[0]
    for k in range(3):
        session.drag(name, (0.3 + 0.1 * k, -0.2, 0.0))
        assert hull_of(session.state.layout) == before
    session.end_drag(name, (0.6, -0.2, 0.0))
    session.select(name)
    session.delete()
    assert hull_of(session.state.layout) == before
    session.undo()
    session.undo()
    assert session.state.layout == load_layout(shipped_layouts()["A"])
