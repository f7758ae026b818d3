"""Mesh files (STL, OBJ, GLB, PLY) as hulls: what is read of one, what is mended, what is refused,
and why."""

import json
import re
import struct
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout.body import MESH_SUFFIXES

FREE_TRIANGLES = 100_000
"""Triangles, instances counted, that a GLB may have however small it is."""
BYTES_PER_TRIANGLE = 6
"""Of a larger one each takes at least so many: corners and indices take 18."""
_PARTS = re.compile(rb"(?m)^[ \t]*(?:usemtl|mtllib|o|g|s)(?:[ \t].*)?$")
"""Materials and groups of an OBJ file, each of which would become a mesh of its own."""


class Mesh(NamedTuple):
    """Triangles with outward normals."""

    vertices: Array
    """Points (V, 3) [m]."""
    faces: NDArray[np.int32]
    """Corners of the triangles (F, 3), counter-clockwise from outside."""


def check_glb(name: str, content: bytes) -> None:
    """Refuse a GLB whose accessors or instances ask for far more than it holds; what is no GLB
    passes. Raises FinlabError: the sentence says how much, and calls the file `name`."""
    try:
        length, kind = struct.unpack("<I4s", content[12:20])
        document = json.loads(content[20 : 20 + length]) if kind == b"JSON" else {}
        counts = [accessor.get("count", 0) for accessor in document.get("accessors", [])]
        meshes = [_triangles(mesh, counts) for mesh in document.get("meshes", [])]
        nodes = document.get("nodes", [])
        triangles = sum(meshes[node["mesh"]] for node in nodes if "mesh" in node)
        values = sum(counts)
    except (struct.error, ValueError, RecursionError, LookupError, TypeError, AttributeError):
        return  # whoever reads it says what is wrong
    if values > len(content):
        raise FinlabError(
            f"{name}: asks for {values:,} values in its {len(content):,} bytes; export it again"
        )
    if triangles > (most := max(FREE_TRIANGLES, len(content) // BYTES_PER_TRIANGLE)):
        raise FinlabError(
            f"{name}: has {triangles:,} triangles with its instances, expected at most {most:,}; "
            "simplify it"
        )


def _triangles(mesh: Any, counts: list[int]) -> int:
    """Triangles in a mesh of a GLB document, by the counts of its accessors."""
    parts = mesh.get("primitives", [])
    return sum(counts[part.get("indices", part["attributes"]["POSITION"])] // 3 for part in parts)


MAX_BYTES = 20_000_000
"""Largest mesh file."""
MAX_FACES = 60_000
"""Most triangles of a hull; more would make the page slow and show nothing new, so they are
simplified."""
LENGTH_MIN = 0.02
"""Least length of a hull [m]; anything else is a mistaken unit."""
LENGTH_MAX = 10.0
"""Largest [m]."""
OPEN_SHARE = 0.02
"""Share of edges with one triangle only from which a mesh is a sheet and not a body."""


class SizeError(FinlabError):
    """A mesh is of a size that no hull has, in the unit that was said."""


@dataclass(frozen=True)
class MeshReport:
    """What there is to know of a mesh file."""

    triangles: int
    """How many it holds, mended."""
    is_watertight: bool
    mended: tuple[str, ...]


def read_mesh(name: str, content: bytes, scale: float) -> tuple[Mesh, MeshReport]:
    """The mesh in a file: whole scene, in metres, mended, the middle of its box at the origin.
    Raises FinlabError: too large, no closed mesh, or of a size that no hull has; the message names
    the file.

    Args:
        name: the file's name; its suffix gives the format.
        content: what is in it.
        scale: metres per unit.
    """
    mesh = _loaded(name, content)
    mended = _mended(mesh)
    vertices = np.asarray(mesh.vertices, dtype=float) * scale
    edges = np.unique(mesh.edges_sorted, axis=0, return_counts=True)[1]
    loose = int((edges == 1).sum())
    if len(mesh.faces) == 0 or loose > OPEN_SHARE * len(edges):
        raise FinlabError(
            f"{name}: is an open sheet, {loose} of its {len(edges)} edges belong to one triangle "
            "only; give it a thickness, or close it"
        )
    low = vertices.min(axis=0)
    high = vertices.max(axis=0)
    length = float((high - low).max())
    if not LENGTH_MIN <= length <= LENGTH_MAX:
        raise SizeError(
            f"{name}: would be {length:.3g} m long, expected {LENGTH_MIN:g} to {LENGTH_MAX:g} m; "
            "choose another unit"
        )
    report = MeshReport(len(mesh.faces), bool(mesh.is_watertight), mended)
    return Mesh(vertices - (low + high) / 2, np.asarray(mesh.faces, dtype=np.int32)), report


def _loaded(name: str, content: bytes) -> trimesh.Trimesh:
    """The triangles of a file, as they stand in it."""
    kind = Path(name).suffix.lower()
    if kind not in MESH_SUFFIXES:
        raise FinlabError(f"{name}: expected a file ending in {', '.join(MESH_SUFFIXES)}")
    if len(content) > MAX_BYTES:
        raise FinlabError(f"{name}: is {len(content):,} bytes long, expected at most {MAX_BYTES:,}")
    if kind == ".glb":
        check_glb(name, content)
    try:
        content = _PARTS.sub(b"", content) if kind == ".obj" else content
        # Without a resolver nothing beside this file is read: no textures, no materials. Without
        # processing, corners that are no numbers are not quietly left out.
        mesh = trimesh.load_mesh(BytesIO(content), file_type=kind[1:], process=False)
        if isinstance(mesh, trimesh.Scene):
            mesh = mesh.to_mesh()
        faces = np.asarray(mesh.faces)
        corners = np.asarray(mesh.vertices, dtype=float)
    except Exception as error:  # trimesh's readers raise whatever went wrong inside them
        reason = str(error).split("\n")[0][:120]
        raise FinlabError(
            f"{name}: is not a {kind[1:].upper()} mesh that can be read ({reason})"
        ) from None
    if len(faces) == 0:
        raise FinlabError(f"{name}: holds no triangles")
    if (
        faces.shape[1:] != (3,)
        or corners.shape[1:] != (3,)
        or faces.min() < 0
        or faces.max() >= len(corners)
    ):
        raise FinlabError(f"{name}: holds triangles whose corners are not there; export it again")
    # Beyond any unit's size, what trimesh makes of corners overflows.
    wrong = int((~(np.abs(corners) < 1e9).all(axis=1)).sum())
    if wrong:
        raise FinlabError(
            f"{name}: {wrong} of its {len(corners)} corners are not finite, or too far; export it "
            "again"
        )
    return mesh


def _mended(mesh: trimesh.Trimesh) -> tuple[str, ...]:
    """Close small holes, drop what has no area, turn triangles outwards: in place, and in words."""
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    before = len(mesh.faces)
    mesh.update_faces(mesh.nondegenerate_faces() & mesh.unique_faces())
    kept = len(mesh.faces)
    if not mesh.is_watertight:
        trimesh.repair.fill_holes(mesh)
    filled = len(mesh.faces) - kept
    normals = np.array(mesh.face_normals)
    trimesh.repair.fix_normals(mesh)
    turned = (
        int((np.einsum("ij,ij->i", normals, mesh.face_normals) < 0.0).sum()) if len(normals) else 0
    )
    counts = {
        "without an area or twice there left out": before - kept,
        "added to close holes": filled,
    }
    counts["turned outwards"] = turned
    return tuple(f"{n} triangle{'s' * (n != 1)} {what}" for what, n in counts.items() if n)


def simplified(mesh: Mesh, faces: int) -> Mesh:
    """About the same shape with at most so many triangles, by quadric error metrics."""
    if len(mesh.faces) <= faces:
        return mesh
    joined = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    fewer = joined.simplify_quadric_decimation(face_count=faces)
    return Mesh(np.asarray(fewer.vertices, dtype=float), np.asarray(fewer.faces, dtype=np.int32))


def turned(mesh: Mesh, rotation: Array) -> Mesh:
    """A mesh turned by a matrix (3, 3) about the middle of its box, which stays at the origin."""
    vertices = mesh.vertices @ np.asarray(rotation).T
    return Mesh(vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2, mesh.faces)


def stl_of(mesh: Mesh) -> bytes:
    """A mesh as the content of a binary STL file."""
    content = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type="stl")
    assert isinstance(content, bytes)
    return content
