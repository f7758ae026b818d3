"""The graph that the JSON object of a graph file describes: all values are checked, refusals name the key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from finlab.deploy.graph import LayoutGraph, Row, SelfTest
from finlab.deploy.graph_document import FORMAT, UNITS, VERSION, checksum_of, edges_of
from finlab.errors import LayoutError
from finlab.inference.normalization import Normalization
from finlab.layout import Layout, parse_layout
from finlab.layout.file import FORMAT as LAYOUT_FORMAT
from finlab.layout.file import VERSION as LAYOUT_VERSION
from finlab.layout.rules import mapping, number, numbers, shown, text

_KEYS = (
    "format",
    "version",
    "checksum",
    "frame",
    "units",
    "layout",
    "graph",
    "features",
    "normalization",
    "checkpoint",
    "self_test",
)


def graph_of(data: Any, source: str) -> LayoutGraph:
    """Check and convert the values of a file.

    Raises:
        LayoutError: it is of another format or version, was changed, or holds what no graph file holds.
    """
    # Format and version first: in a file of another kind or version, unknown keys are not the news.
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        got = shown(data.get("format")) if isinstance(data, dict) else shown(data)
        raise LayoutError(f"expected {FORMAT}, got {got}", "format")
    if data.get("version") != VERSION or data["version"] is True:
        raise LayoutError(f"this finlab reads version {VERSION}, got {shown(data.get('version'))}", "version")
    data = mapping(data, "", _KEYS, required=_KEYS)
    if data["checksum"] != checksum_of(data):
        raise LayoutError("does not fit the contents; the file was changed, export it again", "checksum")
    if data["units"] != UNITS:
        raise LayoutError(f"expected {UNITS}, got {shown(data['units'])}", "units")
    parts = ("directed", "multigraph", "graph", "nodes", "edges")
    shape = mapping(data["graph"], "graph", parts, required=parts)
    nodes = shape["nodes"]
    if not isinstance(nodes, list):
        raise LayoutError(f"expected a list of fins, got {shown(nodes)}", "graph.nodes")
    layout = _layout(data, nodes, source)
    normalization = _section(data, "normalization", "mean", "std")
    checkpoint = _section(data, "checkpoint", "name", "sha256")
    cases = _section(data, "self_test", "tolerance_err_norm", "cases")["cases"]
    if not isinstance(cases, list):
        raise LayoutError(f"expected a list, got {shown(cases)}", "self_test.cases")
    graph = LayoutGraph(
        layout=layout,
        failed=tuple(name for name, node in zip(layout.names, nodes, strict=True) if not node["healthy"]),
        feature_set=text(_section(data, "features", "set")["set"], "features.set", 40),
        features=tuple(_row(node["features"], f"graph.nodes[{i}].features") for i, node in enumerate(nodes)),
        normalization=Normalization(
            np.array(numbers(normalization["mean"], "normalization.mean", 6)),
            np.array(numbers(normalization["std"], "normalization.std", 6, low=0.0)),
        ),
        checkpoint=text(checkpoint["name"], "checkpoint.name", 200),
        checkpoint_sha256=text(checkpoint["sha256"], "checkpoint.sha256", 64),
        self_test=tuple(_case(case, i, layout.n_fins) for i, case in enumerate(cases)),
    )
    if shape["edges"] != edges_of(graph):
        raise LayoutError("expected every pair of healthy fins, and each with itself", "graph.edges")
    return graph


def _section(data: Mapping[str, Any], name: str, *keys: str) -> Mapping[str, Any]:
    """One part of the file, with exactly these keys."""
    return mapping(data[name], name, keys, required=keys)


def _layout(data: Mapping[str, Any], nodes: list[Any], source: str) -> Layout:
    """The layout, checked by the reader of layout files, with the shafts' angles exactly as they were."""
    keys = ("id", "position_m", "mounting_angle_rad", "limits", "model", "healthy", "features")
    about = mapping(data["layout"], "layout", ("name", "description", "body"), ("name",))
    fins, angles = [], []
    for i, node in enumerate(nodes):
        node = mapping(node, f"graph.nodes[{i}]", keys, required=keys)
        angle = number(
            node["mounting_angle_rad"], f"graph.nodes[{i}].mounting_angle_rad", -math.tau, math.tau
        )
        angles.append(angle)
        if not isinstance(node["healthy"], bool):
            got = shown(node["healthy"])
            raise LayoutError(f"expected true or false, got {got}", f"graph.nodes[{i}].healthy")
        fins.append(
            {
                "name": node["id"],
                "position_m": node["position_m"],
                "mounting_angle_deg": math.degrees(angle),
                "limits": node["limits"],
                "model": node["model"],
            }
        )
    layout = parse_layout(
        {"format": LAYOUT_FORMAT, "version": LAYOUT_VERSION, "frame": data["frame"], **about, "fins": fins},
        source,
    )
    pairs = zip(layout.fins, angles, strict=True)
    return replace(layout, fins=tuple(replace(fin, mounting_angle=angle) for fin, angle in pairs))


def _case(data: Any, i: int, n_fins: int) -> SelfTest:
    keys = ("wrench", "command", "predicted_wrench", "features")
    key = f"self_test.cases[{i}]"
    data = mapping(data, key, keys, required=keys)
    for name in ("command", "features"):
        if not isinstance(data[name], list) or len(data[name]) != n_fins:
            raise LayoutError(f"expected a list of {n_fins} rows, one for each fin", f"{key}.{name}")
    return SelfTest(
        wrench=numbers(data["wrench"], f"{key}.wrench", 6),
        command=tuple(_row(row, f"{key}.command[{j}]", 3) for j, row in enumerate(data["command"])),
        predicted_wrench=numbers(data["predicted_wrench"], f"{key}.predicted_wrench", 6),
        features=tuple(_row(row, f"{key}.features[{j}]") for j, row in enumerate(data["features"])),
    )


def _row(value: Any, key: str, count: int | None = None) -> Row | None:
    """Numbers of one fin; None for a failed one."""
    if value is None:
        return None
    length = len(value) if isinstance(value, list) else 0
    return numbers(value, key, length if count is None else count)
