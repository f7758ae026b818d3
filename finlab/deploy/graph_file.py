"""Layout graph files (`*.graph.json`, version 2): written once at the desk, read on a robot. numpy only.

The file is one JSON object; `graph.schema.json` beside this module describes it, and its part `graph` is what
`networkx.node_link_graph` reads. A SHA-256 over all the rest tells an edited or damaged file from a good one.
Reading checks every value, and refusals name the key.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from finlab.deploy.graph import SELF_TEST_TOLERANCE, LayoutGraph, SelfTest
from finlab.errors import LayoutError
from finlab.inference.normalization import Normalization
from finlab.layout import layout_to_dict
from finlab.layout.file import FRAME
from finlab.layout.load import (
    GRAPH_FORMAT,
    GRAPH_VERSION,
    SUFFIX,
    UNITS,
    GraphDocument,
    GraphText,
    checksum_of,
    parse_graph_document,
    read_graph_text,
)
from finlab.layout.rules import mapping, numbers, shown, text, under
from finlab.whole_file import write_whole


def write_graph(graph: LayoutGraph, path: str | os.PathLike[str]) -> None:
    """Write a graph file; the same graph gives the same bytes. An existing file is replaced whole.

    Raises:
        LayoutError: the name does not end in `.graph.json`, or the file cannot be written.
    """
    if not Path(path).name.endswith(SUFFIX):
        raise LayoutError(f"expected a file name that ends in {SUFFIX}", source=str(path))
    write_whole(path, graph_bytes(graph))


def read_graph(path: str | os.PathLike[str]) -> LayoutGraph:
    """Read a graph file back, whole, also out of a bundle.

    Raises:
        LayoutError: it cannot be read, is of another format or version, or was changed after it was written.
        DataError: the bundle cannot be read, or was changed.
    """
    return parse_graph(read_graph_text(Path(path)))


def graph_bytes(graph: LayoutGraph) -> bytes:
    """The contents of a graph file."""
    document = _document_of(graph)
    document["checksum"] = checksum_of(document)
    return (json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def parse_graph(found: GraphText) -> LayoutGraph:
    """The graph in the text of a graph file; errors as in `read_graph`."""
    document = parse_graph_document(found)
    with under(source=found.source):
        return _graph(document)


def _document_of(graph: LayoutGraph) -> dict[str, Any]:
    """Everything but the checksum, which comes third once it is known."""
    layout = layout_to_dict(graph.layout)
    nodes = []
    for fin, entry in zip(graph.layout.fins, layout["fins"], strict=True):
        node = {
            "id": entry["name"],
            "position_m": entry["position_m"],
            "mounting_angle_rad": fin.mounting_angle,
            "limits": entry["limits"],
            "model": entry["model"],
            "healthy": fin.name not in graph.failed,
        }
        if "servo" in entry:
            node["servo"] = entry["servo"]
        nodes.append(node)
    return {
        "format": GRAPH_FORMAT,
        "version": GRAPH_VERSION,
        "checksum": "",
        "frame": FRAME,
        "units": UNITS,
        "layout": {
            key: layout[key] for key in ("name", "description", "body", "interaction") if key in layout
        },
        "graph": {
            "directed": False,
            "multigraph": False,
            "graph": {"name": graph.layout.name},
            "nodes": nodes,
            "edges": _edges(graph),
        },
        "normalization": {"mean": graph.normalization.mean.tolist(), "std": graph.normalization.std.tolist()},
        "checkpoint": {"name": graph.checkpoint, "sha256": graph.checkpoint_sha256},
        "self_test": {
            "method": graph.method,
            "tolerance_err_norm": SELF_TEST_TOLERANCE,
            "cases": [asdict(case) for case in graph.self_test],
        },
    }


def _edges(graph: LayoutGraph) -> list[dict[str, str]]:
    """Every pair of healthy fins, and each with itself."""
    return [{"source": a, "target": b} for a, b in graph.edges]


def _graph(document: GraphDocument) -> LayoutGraph:
    """The graph of a file whose layout is right; all the rest is checked here."""
    data = document.values
    normalization = _section(data, "normalization", "mean", "std")
    checkpoint = _section(data, "checkpoint", "name", "sha256")
    self_test = _section(data, "self_test", "method", "tolerance_err_norm", "cases")
    cases = self_test["cases"]
    if not isinstance(cases, list):
        raise LayoutError(f"expected a list, got {shown(cases)}", "self_test.cases")
    graph = LayoutGraph(
        layout=document.layout,
        failed=document.failed,
        normalization=Normalization(
            np.array(numbers(normalization["mean"], "normalization.mean", 6)),
            np.array(numbers(normalization["std"], "normalization.std", 6, low=0.0)),
        ),
        checkpoint=_text_or_none(checkpoint["name"], "checkpoint.name", 200),
        checkpoint_sha256=_text_or_none(checkpoint["sha256"], "checkpoint.sha256", 64),
        method=text(self_test["method"], "self_test.method", 40),
        self_test=tuple(_case(case, i, document.layout.n_fins) for i, case in enumerate(cases)),
    )
    if data["graph"]["edges"] != _edges(graph):
        raise LayoutError("expected every pair of healthy fins, and each with itself", "graph.edges")
    return graph


def _section(data: Mapping[str, Any], name: str, *keys: str) -> Mapping[str, Any]:
    """One part of the file, with exactly these keys."""
    return mapping(data[name], name, keys, required=keys)


def _case(data: Any, i: int, n_fins: int) -> SelfTest:
    keys = ("wrench", "command", "delivered_wrench")
    key = f"self_test.cases[{i}]"
    data = mapping(data, key, keys, required=keys)
    if not isinstance(data["command"], list) or len(data["command"]) != n_fins:
        raise LayoutError(f"expected a list of {n_fins} rows, one for each fin", f"{key}.command")
    return SelfTest(
        wrench=numbers(data["wrench"], f"{key}.wrench", 6),
        command=tuple(
            None if row is None else numbers(row, f"{key}.command[{j}]", 3)
            for j, row in enumerate(data["command"])
        ),
        delivered_wrench=numbers(data["delivered_wrench"], f"{key}.delivered_wrench", 6),
    )


def _text_or_none(value: Any, key: str, max_length: int) -> str | None:
    return None if value is None else text(value, key, max_length)
