"""The layout in a layout graph file (`*.graph.json`), which stands in for a layout file.

The rest of such a file, features and self-tests, is read by `finlab.deploy.graph_file`.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from finlab.errors import LayoutError
from finlab.layout.file import FORMAT as LAYOUT_FORMAT
from finlab.layout.file import VERSION as LAYOUT_VERSION
from finlab.layout.file import parse_layout
from finlab.layout.layout import Layout
from finlab.layout.reading import parse_json
from finlab.layout.rules import mapping, number, shown

SUFFIX = ".graph.json"
"""How the name of a graph file ends."""
FORMAT = "finlab-graph"
VERSION = 1
UNITS = {"length": "m", "angle": "rad", "frequency": "Hz", "force": "N", "torque": "N m"}
_PARTS = ("frame", "units", "layout", "graph", "features", "normalization", "checkpoint", "self_test")
KEYS = ("format", "version", "checksum", *_PARTS)


def parse_graph_layout(content: str, source: str = "graph") -> Layout:
    """Returns the layout in the text of a graph file, failed fins included.

    Raises:
        LayoutError: it is of another format or version, was changed after it was written, or holds no layout.
    """
    data = parse_json(content, source)
    try:
        return graph_layout(check_graph_document(data), source)
    except LayoutError as error:
        raise error if error.source else error.under("", source) from None


def check_graph_document(data: Any) -> Mapping[str, Any]:
    """Returns the values of a graph file once format, version, keys and checksum are right."""
    # Format and version first: in a file of another kind or version, unknown keys are not the news.
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        got = shown(data.get("format")) if isinstance(data, dict) else shown(data)
        raise LayoutError(f"expected {FORMAT}, got {got}", "format")
    if data.get("version") != VERSION or data["version"] is True:
        raise LayoutError(f"this finlab reads version {VERSION}, got {shown(data.get('version'))}", "version")
    document: Mapping[str, Any] = mapping(data, "", KEYS, required=KEYS)
    if document["checksum"] != checksum_of(document):
        raise LayoutError("does not fit the contents; the file was changed, export it again", "checksum")
    if document["units"] != UNITS:
        raise LayoutError(f"expected {UNITS}, got {shown(document['units'])}", "units")
    return document


def checksum_of(document: Mapping[str, Any]) -> str:
    """SHA-256 of everything but the checksum, independent of white space and the order of keys."""
    rest = {key: value for key, value in document.items() if key != "checksum"}
    canonical = json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return "sha256:" + hashlib.sha256(canonical.encode("utf-8", "surrogatepass")).hexdigest()


def graph_nodes(data: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Returns the fins of a checked graph document, each with the keys that it must have."""
    parts = ("directed", "multigraph", "graph", "nodes", "edges")
    nodes = mapping(data["graph"], "graph", parts, required=parts)["nodes"]
    if not isinstance(nodes, list):
        raise LayoutError(f"expected a list of fins, got {shown(nodes)}", "graph.nodes")
    keys = ("id", "position_m", "mounting_angle_rad", "limits", "model", "healthy", "features")
    checked = [mapping(node, f"graph.nodes[{i}]", keys, required=keys) for i, node in enumerate(nodes)]
    for i, node in enumerate(checked):
        if not isinstance(node["healthy"], bool):
            got = shown(node["healthy"])
            raise LayoutError(f"expected true or false, got {got}", f"graph.nodes[{i}].healthy")
    return checked


def graph_layout(data: Mapping[str, Any], source: str) -> Layout:
    """Returns the layout of a checked graph document, the shafts' angles exactly as they were."""
    about = mapping(data["layout"], "layout", ("name", "description", "body"), ("name",))
    fins, angles = [], []
    for i, node in enumerate(graph_nodes(data)):
        angle = number(
            node["mounting_angle_rad"], f"graph.nodes[{i}].mounting_angle_rad", -math.tau, math.tau
        )
        angles.append(angle)
        fin = {"name": node["id"], "mounting_angle_deg": math.degrees(angle)}
        fins.append(fin | {key: node[key] for key in ("position_m", "limits", "model")})
    head = {"format": LAYOUT_FORMAT, "version": LAYOUT_VERSION, "frame": data["frame"]}
    layout = parse_layout({**head, **about, "fins": fins}, source)
    pairs = zip(layout.fins, angles, strict=True)
    return replace(layout, fins=tuple(replace(fin, mounting_angle=angle) for fin, angle in pairs))
