"""Opens what a user may name as a layout: a shipped one, a layout file, a layout graph file, or a bundle."""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from finlab.assets import shipped_layouts
from finlab.bundle_files import GRAPH, TABLES, Files, is_bundle, read_bundle_files
from finlab.errors import LayoutError
from finlab.files.guarded import decoded, read_text
from finlab.files.plain_values import parse_json, parse_yaml
from finlab.files.schema import checked
from finlab.layout.file import check_version, layout_of, parse_layout, under
from finlab.layout.fin import Fin
from finlab.layout.graph_form import Graph, actuator_of_node
from finlab.layout.layout import Layout

SUFFIX = ".graph.json"
"""How the name of a graph file ends."""
GRAPH_FORMAT = "finlab-graph"
GRAPH_VERSION = 3
MAX_BYTES = 1_000_000
"""Largest layout file that is read [bytes]; a real one has a few thousand."""
A_LAYOUT = "a layout file (.yaml or .json)"


class GraphText(NamedTuple):
    """A layout graph file that was found somewhere."""

    content: str
    """Its text."""
    source: str = "graph"
    """What to call it in error messages."""
    folder: Path | None = None
    """Where relative paths in it start; the working directory when None."""
    tables: frozenset[str] | None = None
    """Paths of the force tables that it may name; None for any."""


class GraphDocument(NamedTuple):
    """What a layout graph file says."""

    values: Graph
    """Everything in it."""
    layout: Layout
    """The layout, failed fins included, the shafts' angles exactly as they were."""
    failed: tuple[str, ...]
    """Names of the actuators that do not work."""


def load_layout(layout: str | os.PathLike[str]) -> Layout:
    """Returns a shipped layout by its bare name, such as "A", or the layout in a file or bundle.

    Files are layout files (YAML, JSON) and layout graph files (`.graph.json`); a bundle is a folder or zip
    archive made by `finlab export`. A bare name is never looked up in the current folder while a layout of
    that name is shipped; write `./A` for a file called `A` there. Relative paths inside a layout file (a
    force table, a hull mesh) are taken from the file's own folder.

    Raises:
        LayoutError: the file cannot be read or is not a valid layout; the message names file and key.
        DataError: the bundle cannot be read, or was changed.
    """
    return layout_and_failed(layout)[0]


def layout_and_failed(
    layout: str | os.PathLike[str], *, may_open: bool = True
) -> tuple[Layout, tuple[str, ...]]:
    """A layout as `load_layout` opens it, and the actuators that a graph file marks as failed; `may_open` as
    for `parse_layout`."""
    file = layout_path(layout)
    source = str(layout)
    if is_bundle(file) or file.name.endswith(SUFFIX):
        document = parse_graph_document(read_graph_text(file))
        return document.layout, document.failed
    content = read_text(file, MAX_BYTES, A_LAYOUT, LayoutError)
    parse = parse_json if file.suffix.lower() == ".json" else parse_yaml
    data, folder = parse(content, source, LayoutError), file.resolve().parent
    return parse_layout(data, source, folder, may_open=may_open), ()


def layout_path(layout: str | os.PathLike[str]) -> Path:
    """The path that a user means: text may be the name of a shipped layout, a `Path` is always a path.

    Raises:
        LayoutError: there is neither a shipped layout nor anything else of this name.
    """
    if not isinstance(layout, str):
        return Path(layout)
    shipped = shipped_layouts()
    if layout in shipped:
        return shipped[layout]
    path = Path(layout)
    try:
        if path.exists():
            return path
    except (OSError, ValueError) as error:  # a name that is too long, or holds a NUL byte
        reason = getattr(error, "strerror", None) or error
        raise LayoutError(f"layout {layout[:80]!r} cannot be a path: {reason}") from error
    raise LayoutError(
        f"layout {layout!r} is neither a file nor a shipped layout; "
        f"shipped are {', '.join(shipped) or 'none'}"
    )


def read_graph_text(path: Path) -> GraphText:
    """The text of a graph file, or of the one in a bundle.

    Raises:
        LayoutError: the file cannot be read.
        DataError: the bundle cannot be read, or was changed.
    """
    source = str(path)
    if not is_bundle(path):
        return GraphText(read_text(path, MAX_BYTES, A_LAYOUT, LayoutError), source, path.resolve().parent)
    return bundle_graph_text(read_bundle_files(path), source)


def bundle_graph_text(files: Files, source: str) -> GraphText:
    """The graph file among the files of a bundle, a folder or archive at the path `source`."""
    place, folder = f"{source}/{GRAPH}", Path(os.path.abspath(source))
    tables = frozenset(str(folder / name) for name in files if name.startswith(TABLES))
    return GraphText(decoded(files[GRAPH], place, A_LAYOUT, LayoutError), place, folder, tables)


def parse_graph_document(found: GraphText) -> GraphDocument:
    """What the text of a graph file says.

    Raises:
        LayoutError: it is of another format or version, was changed after it was written, or holds no layout.
    """
    data = parse_json(found.content, found.source, LayoutError)
    with under(source=found.source):
        check_version(data, GRAPH_FORMAT, GRAPH_VERSION)
        document = checked(data, Graph)
        if document.checksum != checksum_of(data):
            raise LayoutError("does not fit the contents; the file was changed, export it again", "checksum")
        parts, nodes = [], document.graph.nodes
        for i, node in enumerate(nodes):
            with under(f"graph.nodes[{i}]"):
                part = actuator_of_node(node, found.folder)
                parts.append(part)
                path = part.model.values().get("path") if isinstance(part, Fin) else None
                if found.tables is not None and path is not None and path not in found.tables:
                    problem = "names a force table that is not in the bundle; export it again"
                    raise LayoutError(problem, "model.path")
        layout = layout_of(document.layout, parts, found.folder)
    return GraphDocument(document, layout, tuple(node.name for node in nodes if not node.healthy))


def checksum_of(document: Mapping[str, Any]) -> str:
    """SHA-256 of everything but the checksum, independent of white space and the order of keys."""
    rest = {key: value for key, value in document.items() if key != "checksum"}
    canonical = json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return "sha256:" + hashlib.sha256(canonical.encode("utf-8", "surrogatepass")).hexdigest()
