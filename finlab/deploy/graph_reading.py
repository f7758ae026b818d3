"""The graph that the JSON object of a graph file describes: all values are checked, refusals name the key."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from finlab.deploy.graph import LayoutGraph, Row, SelfTest
from finlab.deploy.graph_document import edges_of
from finlab.errors import LayoutError
from finlab.inference.normalization import Normalization
from finlab.layout.load import check_graph_document, graph_layout, graph_nodes
from finlab.layout.rules import mapping, numbers, shown, text


def graph_of(data: Any, source: str) -> LayoutGraph:
    """Check and convert the values of a file.

    Raises:
        LayoutError: it is of another format or version, was changed, or holds what no graph file holds.
    """
    data = check_graph_document(data)
    nodes = graph_nodes(data)
    layout = graph_layout(data, source)
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
    if data["graph"]["edges"] != edges_of(graph):
        raise LayoutError("expected every pair of healthy fins, and each with itself", "graph.edges")
    return graph


def _section(data: Mapping[str, Any], name: str, *keys: str) -> Mapping[str, Any]:
    """One part of the file, with exactly these keys."""
    return mapping(data[name], name, keys, required=keys)


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
