"""Mesh files that ask for more than they hold, or are cut into very many parts."""

import json
import struct
from typing import Any

import pytest
import trimesh

from finlab.errors import FinlabError
from finlab.swim.hull.mesh_file import read_mesh

BOX_MESH = trimesh.creation.box((0.4, 0.2, 0.1))
"""A box of twelve triangles."""


def glb(count: int, **more: Any) -> bytes:
    """A file of a few hundred bytes whose corners are counted so, and nowhere."""
    document = {
        "asset": {"version": "2.0"},
        "accessors": [{"componentType": 5126, "count": count, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    text = json.dumps(document | more).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<III", 2, 20 + len(text), len(text)) + b"JSON" + text


def instanced(mesh: trimesh.Trimesh, count: int) -> bytes:
    """A file of glTF that shows one mesh many times."""
    scene = trimesh.Scene()
    for i in range(count):
        place = trimesh.transformations.translation_matrix([0.01 * i, 0.0, 0.0])
        scene.add_geometry(mesh, geom_name="part", node_name=f"node{i}", transform=place)
    content = scene.export(file_type="glb")
    assert isinstance(content, bytes)
    return content


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (glb(150_000_000), r"asks for 150,000,000 values in its \d+ bytes"),
        (
            instanced(trimesh.creation.icosphere(subdivisions=4), 100),
            "has 512,000 triangles with its instan",
        ),
        (glb(3, accessors=[7]), "is not a GLB mesh that can be read"),
        (glb(3, meshes={}), "holds no triangles|is not a GLB mesh"),
        (b"glTF", "is not a GLB mesh that can be read"),
    ],
)
def test_what_asks_for_more_than_it_holds_is_refused(content: bytes, sentence: str) -> None:
    with pytest.raises(FinlabError, match=sentence):
        read_mesh("a.glb", content, 1.0)


def test_instances_of_an_honest_file_are_read() -> None:
    mesh, report = read_mesh("a.glb", instanced(BOX_MESH, 5), 1.0)
    assert report.triangles == 5 * len(BOX_MESH.faces)
    assert max(mesh.vertices[:, 0]) - min(mesh.vertices[:, 0]) == pytest.approx(0.44)


@pytest.mark.parametrize("word", ["g", "o", "usemtl", "s"])
def test_an_obj_is_read_in_one_part_however_many_it_names(word: str) -> None:
    lines = [f"v {x} {y} {z}" for x, y, z in BOX_MESH.vertices]
    for i, (a, b, c) in enumerate(BOX_MESH.faces + 1):
        lines += [f"{word} part{i}", f"f {a} {b} {c}"]
    mesh, report = read_mesh("a.obj", "\n".join(lines).encode(), 1.0)
    assert (
        report.triangles == len(BOX_MESH.faces) and report.is_watertight and len(mesh.vertices) == 8
    )
