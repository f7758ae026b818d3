"""Checks of what a mesh file asks for against what it holds, before a library reads it."""

import json
import re
import struct
from typing import Any

from finlab.errors import FinlabError

FREE_TRIANGLES = 100_000
"""Triangles, instances counted, that a GLB may have however small it is."""
BYTES_PER_TRIANGLE = 6
"""Of a larger one each takes at least so many: corners and indices take 18."""
_PARTS = re.compile(rb"(?m)^[ \t]*(?:usemtl|mtllib|o|g|s)(?:[ \t].*)?$")


def in_one_part(content: bytes) -> bytes:
    """An OBJ file without materials and groups, each of which would become a mesh of its own."""
    return _PARTS.sub(b"", content)


def check_glb(name: str, content: bytes) -> None:
    """Refuse a GLB whose accessors or instances ask for far more than it holds; what is no GLB passes.

    Raises:
        FinlabError: the sentence says how much, and calls the file `name`.
    """
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
            f"{name}: has {triangles:,} triangles with its instances, expected at most {most:,}; simplify it"
        )


def _triangles(mesh: Any, counts: list[int]) -> int:
    """Triangles in a mesh of a GLB document, by the counts of its accessors."""
    parts = mesh.get("primitives", [])
    return sum(counts[part.get("indices", part["attributes"]["POSITION"])] // 3 for part in parts)
