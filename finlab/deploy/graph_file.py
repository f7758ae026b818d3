"""Layout graph files (`*.graph.json`, version 3): written once at the desk, read on a robot. numpy only.

The file is one JSON object; `graph.schema.json` beside this module describes it, and its part `graph` is what
`networkx.node_link_graph` reads. A SHA-256 over all the rest tells an edited or damaged file from a good one.
Reading checks every value, and refusals name the key.
"""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import to_builtins

from finlab.deploy.graph import SELF_TEST_TOLERANCE, LayoutGraph
from finlab.errors import LayoutError
from finlab.layout import layout_to_dict
from finlab.layout.file import FRAME, under
from finlab.layout.graph_form import Units, node_to_dict
from finlab.layout.load import (
    GRAPH_FORMAT,
    GRAPH_VERSION,
    SUFFIX,
    GraphDocument,
    GraphText,
    checksum_of,
    parse_graph_document,
    read_graph_text,
)
from finlab.networks.normalization import Normalization
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
    nodes = [node_to_dict(part, part.name not in graph.failed) for part in graph.layout.actuators]
    return {
        "format": GRAPH_FORMAT,
        "version": GRAPH_VERSION,
        "checksum": "",
        "frame": FRAME,
        "units": to_builtins(Units()),
        "layout": {
            key: layout[key] for key in ("name", "description", "body", "interaction") if key in layout
        },
        "graph": {
            "directed": False,
            "multigraph": False,
            "graph": {"name": graph.layout.name},
            "nodes": nodes,
            "edges": [{"source": a, "target": b} for a, b in graph.edges],
        },
        "normalization": {"mean": graph.normalization.mean.tolist(), "std": graph.normalization.std.tolist()},
        "checkpoint": {"name": graph.checkpoint, "sha256": graph.checkpoint_sha256},
        "self_test": {
            "method": graph.method,
            "tolerance_err_norm": SELF_TEST_TOLERANCE,
            "cases": [to_builtins(case) for case in graph.self_test],
        },
    }


def _graph(document: GraphDocument) -> LayoutGraph:
    """The graph of a file; what goes beyond the parts of it is checked here."""
    data, layout = document.values, document.layout
    cases = data.self_test.cases
    for i, case in enumerate(cases):
        if len(case.command) != layout.n:
            problem = f"expected a list of {layout.n} rows, one for each actuator, got {len(case.command)}"
            raise LayoutError(problem, f"self_test.cases[{i}].command")
    graph = LayoutGraph(
        layout=layout,
        failed=document.failed,
        normalization=Normalization(np.array(data.normalization.mean), np.array(data.normalization.std)),
        checkpoint=data.checkpoint.name,
        checkpoint_sha256=data.checkpoint.sha256,
        method=data.self_test.method,
        self_test=tuple(cases),
    )
    if [(edge.source, edge.target) for edge in data.graph.edges] != list(graph.edges):
        raise LayoutError("expected every pair of healthy actuators, and each with itself", "graph.edges")
    return graph
