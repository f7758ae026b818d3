"""Opens what a user may name as a layout: a shipped one, a layout file, a layout graph file, or a bundle."""

import hashlib
import json
import math
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from finlab.assets import shipped_layouts
from finlab.bundle_files import GRAPH, TABLES, Files, is_bundle, read_bundle_files
from finlab.errors import LayoutError
from finlab.layout.file import FORMAT, VERSION, parse_layout
from finlab.layout.layout import Layout
from finlab.layout.reading import decode_text, parse_json, read_text
from finlab.layout.rules import mapping, number, shown, under

SUFFIX = ".graph.json"
"""How the name of a graph file ends."""
GRAPH_FORMAT = "finlab-graph"
GRAPH_VERSION = 2
ABOUT = ("name", "description", "body", "interaction")
"""What the part `layout` of a graph file holds: keys of a layout file."""
UNITS = {"length": "m", "angle": "rad", "frequency": "Hz", "force": "N", "torque": "N m"}
_PARTS = ("frame", "units", "layout", "graph", "normalization", "checkpoint", "self_test")
KEYS = ("format", "version", "checksum", *_PARTS)


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
    """What a layout graph file says, checked as far as its layout goes."""

    values: Mapping[str, Any]
    """Everything in it, with the keys that it must have."""
    layout: Layout
    """The layout, failed fins included, the shafts' angles exactly as they were."""
    failed: tuple[str, ...]
    """Names of the fins that do not work."""


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
    file = layout_path(layout)
    source = str(layout)
    if holds_graph(file):
        return parse_graph_document(read_graph_text(file)).layout
    content = read_text(file, source)
    if file.suffix.lower() == ".json":
        data = parse_json(content, source)
    else:
        from finlab.layout.yaml_file import parse_yaml  # a robot's computer reads JSON and may lack PyYAML

        data = parse_yaml(content, source)
    return parse_layout(data, source=source, folder=file.resolve().parent)


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


def holds_graph(path: Path) -> bool:
    """Whether a path looks like a layout graph file, or a bundle with one."""
    return is_bundle(path) or path.name.endswith(SUFFIX)


def read_graph_text(path: Path) -> GraphText:
    """The text of a graph file, or of the one in a bundle.

    Raises:
        LayoutError: the file cannot be read.
        DataError: the bundle cannot be read, or was changed.
    """
    source = str(path)
    if not is_bundle(path):
        return GraphText(read_text(path, source), source, path.resolve().parent)
    return bundle_graph_text(read_bundle_files(path), source)


def bundle_graph_text(files: Files, source: str) -> GraphText:
    """The graph file among the files of a bundle, a folder or archive at the path `source`."""
    place, folder = f"{source}/{GRAPH}", Path(os.path.abspath(source))
    tables = frozenset(str(folder / name) for name in files if name.startswith(TABLES))
    return GraphText(decode_text(files[GRAPH], place), place, folder, tables)


def parse_graph_document(found: GraphText) -> GraphDocument:
    """What the text of a graph file says.

    Raises:
        LayoutError: it is of another format or version, was changed after it was written, or holds no layout.
    """
    data = parse_json(found.content, found.source)
    with under(source=found.source):
        # Format and version first: in a file of another kind or version, unknown keys are not the news.
        if not isinstance(data, dict) or data.get("format") != GRAPH_FORMAT:
            got = shown(data.get("format")) if isinstance(data, dict) else shown(data)
            raise LayoutError(f"expected {GRAPH_FORMAT}, got {got}", "format")
        if type(data.get("version")) is not int or data["version"] != GRAPH_VERSION:
            got = shown(data.get("version"))
            raise LayoutError(f"this finlab reads version {GRAPH_VERSION}, got {got}", "version")
        mapping(data, "", KEYS, required=KEYS)
        if data["checksum"] != checksum_of(data):
            raise LayoutError("does not fit the contents; the file was changed, export it again", "checksum")
        if data["units"] != UNITS:
            raise LayoutError(f"expected {UNITS}, got {shown(data['units'])}", "units")
        return _document(data, found)


def checksum_of(document: Mapping[str, Any]) -> str:
    """SHA-256 of everything but the checksum, independent of white space and the order of keys."""
    rest = {key: value for key, value in document.items() if key != "checksum"}
    canonical = json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return "sha256:" + hashlib.sha256(canonical.encode("utf-8", "surrogatepass")).hexdigest()


def _document(data: Mapping[str, Any], found: GraphText) -> GraphDocument:
    """The layout of a graph file, read by way of the layout file that it would be."""
    parts = ("directed", "multigraph", "graph", "nodes", "edges")
    nodes = mapping(data["graph"], "graph", parts, required=parts)["nodes"]
    if not isinstance(nodes, list):
        raise LayoutError(f"expected a list of fins, got {shown(nodes)}", "graph.nodes")
    keys = ("id", "position_m", "mounting_angle_rad", "limits", "model", "healthy")
    carried = ("position_m", "limits", "model", "servo")
    angles, fins = [], []
    for i, node in enumerate(nodes):
        with under(f"graph.nodes[{i}]"):
            mapping(node, "", (*keys, "servo"), required=keys)
            if not isinstance(node["healthy"], bool):
                raise LayoutError(f"expected true or false, got {shown(node['healthy'])}", "healthy")
            angles.append(number(node["mounting_angle_rad"], "mounting_angle_rad", -math.tau, math.tau))
        fin = {"name": node["id"], "mounting_angle_deg": math.degrees(angles[-1])}
        fins.append(fin | {key: node[key] for key in carried if key in node})
    about = mapping(data["layout"], "layout", ABOUT, ("name",))
    head = {"format": FORMAT, "version": VERSION, "frame": data["frame"]}
    layout = parse_layout({**head, **about, "fins": fins}, found.source, found.folder)
    for i, parsed in enumerate(layout.fins):
        path = parsed.model.values().get("path")
        if found.tables is not None and path is not None and path not in found.tables:
            key = f"graph.nodes[{i}].model.path"
            raise LayoutError("names a force table that is not in the bundle; export it again", key)
    exact = (replace(fin, mounting_angle=angle) for fin, angle in zip(layout.fins, angles, strict=True))
    failed = tuple(node["id"] for node in nodes if not node["healthy"])
    return GraphDocument(data, replace(layout, fins=tuple(exact)), failed)
