"""Layout graph files (`*.graph.json`, version 1): written once at the desk, read on a robot. numpy only.

The file is one JSON object; `graph.schema.json` beside this module describes it, and its part `graph` is what
`networkx.node_link_graph` reads. A SHA-256 over all the rest tells an edited or damaged file from a good one.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

from finlab.deploy.graph import LayoutGraph
from finlab.deploy.graph_document import document_of
from finlab.deploy.graph_reading import graph_of
from finlab.errors import LayoutError
from finlab.layout.load import SUFFIX, checksum_of
from finlab.layout.reading import parse_json, read_text


def write_graph(graph: LayoutGraph, path: str | os.PathLike[str]) -> None:
    """Write a graph file; the same graph gives the same bytes. An existing file is replaced whole.

    Raises:
        LayoutError: the name does not end in `.graph.json`, or the file cannot be written.
    """
    file = Path(path)
    check_graph_name(file)
    temporary = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        # Written beside and renamed, so that a kill or a full disk never leaves half a file.
        temporary.write_bytes(graph_bytes(graph))
        os.replace(temporary, file)
    except OSError as error:
        raise LayoutError(f"cannot be written: {error.strerror}", source=str(path)) from None


def read_graph(path: str | os.PathLike[str]) -> LayoutGraph:
    """Read a graph file back, whole.

    Raises:
        LayoutError: it cannot be read, is of another format or version, or was changed after it was written.
    """
    return parse_graph(read_text(Path(path), str(path)), source=str(path))


def check_graph_name(path: Path) -> None:
    """Raise a `LayoutError` unless a file of this name would be read back as a graph file."""
    if not path.name.endswith(SUFFIX):
        raise LayoutError(f"expected a file name that ends in {SUFFIX}", source=str(path))


def graph_bytes(graph: LayoutGraph) -> bytes:
    """The contents of a graph file."""
    document = document_of(graph)
    document["checksum"] = checksum_of(document)
    return (json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def parse_graph(content: str, source: str = "graph") -> LayoutGraph:
    """The graph in the text of a graph file; errors as in `read_graph`."""
    data = parse_json(content, source)
    try:
        return graph_of(data, source)
    except LayoutError as error:
        raise error if error.source else error.under("", source) from None
