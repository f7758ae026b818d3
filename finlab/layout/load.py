"""Layouts in what a user may name: a shipped layout, a layout or graph file, a bundle's `robot.json`."""

import json
import os
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, to_builtins

from finlab.assets import shipped_layouts
from finlab.bundle_files import ROBOT, TABLES, Files, is_bundle, read_bundle_files
from finlab.errors import LayoutError
from finlab.files.guarded import decoded, read_text
from finlab.files.plain_values import parse_json, parse_yaml
from finlab.files.schema import Name, checked
from finlab.interaction.learned import Learned
from finlab.layout.file import layout_to_dict, parse_layout
from finlab.layout.file_form import under
from finlab.layout.layout import MAX_ACTUATORS, Layout


class Edge(Struct, forbid_unknown_fields=True):
    """Two actuators, or one twice."""

    source: Name
    target: Name


class Normalization(Struct, forbid_unknown_fields=True):
    """What numbers are divided by to be of order one."""

    features: dict[str, float]
    """Of the features of fins with horizontal shafts, by name, as the paper's network takes them."""
    wrench: dict[str, float]
    """Of each axis of a wrench [N, N m]: the robot's own yardstick, in which errors are measured."""


class Data(Struct, forbid_unknown_fields=True):
    """What holds for the whole graph."""

    layout: dict[str, Any]
    """A layout file of version 2 without its actuators, which are the nodes."""
    normalization: Normalization
    format: Literal["finlab-graph"] = "finlab-graph"
    version: Literal[4] = 4


class Graph(Struct, forbid_unknown_fields=True):
    """A robot's actuators as nodes, each joined with every other one and with itself; node-link form.

    A node has the actuator's name as `id`, what a layout file says of it, and `features`: numbers by name and
    unit.
    """

    directed: Literal[False]
    multigraph: Literal[False]
    graph: Data
    nodes: Annotated[list[dict[str, Any]], Meta(min_length=1, max_length=MAX_ACTUATORS)]
    edges: list[Edge]


def is_graph(data: Any) -> bool:
    """Whether plain values are those of a layout graph file."""
    about = data.get("graph") if isinstance(data, dict) else None
    return isinstance(about, dict) and about.get("format") == "finlab-graph"


def layout_in_graph(data: Any) -> dict[str, Any]:
    """Returns the plain values of the layout file that a graph file holds. Raises LayoutError: a part of the
    graph is missing, unknown or not what it has to be."""
    graph = checked(data, Graph)
    names = [node.get("id") for node in graph.nodes]
    if [(edge.source, edge.target) for edge in graph.edges] != edges_of(names):
        raise LayoutError("expected each actuator with itself and with those after it, in order", "edges")
    parts = [
        {"name": node.get("id")} | {key: node[key] for key in node if key not in ("id", "features")}
        for node in graph.nodes
    ]
    return {**graph.graph.layout, "actuators": parts}


def edges_of(names: list[Any]) -> list[tuple[Any, Any]]:
    """Returns all pairs of names, each with itself too."""
    return [(a, b) for k, a in enumerate(names) for b in names[k:]]


Wrench = tuple[float, float, float, float, float, float]


class Case(Struct, frozen=True, forbid_unknown_fields=True):
    """A target [N, N m], a command per actuator in SI and radians (null for a lost one), and its wrench."""

    wrench: Wrench
    command: tuple[tuple[float, float, float] | None, ...]
    delivered_wrench: Wrench


class Robot(Struct, forbid_unknown_fields=True):
    """What a bundle holds beside the method's settings."""

    layout: Any
    """The `Layout`, lost actuators included; in the file as a layout file has it."""
    lost: tuple[Name, ...]
    """Actuators that do not work."""
    weights_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")] | None
    """SHA-256 of the weights of the method's networks, hexadecimal; None for methods without."""
    self_test: tuple[Case, ...]
    """Targets with their answers."""


def robot_bytes(robot: Robot) -> bytes:
    """Returns the contents of the file."""
    values = {**to_builtins(robot, builtin_types=(Layout,)), "layout": layout_to_dict(robot.layout)}
    return (json.dumps(values, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def robot_of(files: Files, source: str) -> Robot:
    """Returns the robot among the files of a bundle, a folder or archive at the path `source`. Raises
    LayoutError: it holds no layout, or one that names a force table or a network outside the bundle, or its
    self-test has commands for another number of actuators."""
    place, folder = f"{source}/{ROBOT}", Path(os.path.abspath(source))
    values = parse_json(decoded(files[ROBOT], place, "JSON", LayoutError), place, LayoutError)
    robot = checked(values, Robot, source=place)
    layout: Layout = parse_layout(robot.layout, f"{place}: layout", folder, may_open=False)
    tables = {str(folder / name) for name in files if name.startswith(TABLES)}
    with under(source=place):
        layout.indices(robot.lost)
        for fin in layout.fins:
            if fin.model.values().get("path", "") not in {"", *tables}:
                problem = "names a force table that is not in the bundle; export it again"
                raise LayoutError(problem, f"layout, fin {fin.name!r}, model.path")
        if isinstance(own := layout.interaction, Learned) and own.path not in tables:
            problem = "names a network that is not in the bundle; export it again"
            raise LayoutError(problem, "layout, interaction.path")
        for i, case in enumerate(robot.self_test):
            if len(case.command) != layout.n:
                problem = f"expected {layout.n} rows, one for each actuator, got {len(case.command)}"
                raise LayoutError(problem, f"self_test[{i}].command")
    robot.layout = layout
    return robot


MAX_BYTES = 1_000_000
"""Largest layout file that is read [bytes]; a real one has a few thousand."""
A_LAYOUT = "a layout file (.yaml or .json)"


def load_layout(layout: str | os.PathLike[str]) -> Layout:
    """Returns a shipped layout by its bare name, such as "A", or the layout in a file or bundle.

    Files are layout files (YAML, JSON) and layout graph files (JSON); a bundle is a folder or zip archive
    made by `finlab export`. A bare name is never looked up in the current folder while a layout of that name
    is shipped; write `./A` for a file called `A` there. Relative paths inside a layout file (a force table, a
    hull mesh) are taken from the file's own folder.

    Raises LayoutError: the file cannot be read or is not a valid layout; the message names file and key;
    DataError: the bundle cannot be read, or was changed.
    """
    return layout_and_lost(layout)[0]


def layout_and_lost(layout: str | os.PathLike[str]) -> tuple[Layout, tuple[str, ...]]:
    """Returns a layout as `load_layout` opens it, with its errors, and the names of the actuators that a
    bundle marks as lost; none of a file."""
    file = layout_path(layout)
    source = str(layout)
    if is_bundle(file):
        robot = robot_of(read_bundle_files(file), source)
        return robot.layout, robot.lost
    content = read_text(file, MAX_BYTES, A_LAYOUT, LayoutError)
    return layout_in(content, file.suffix, source, file.resolve().parent), ()


def layout_in(
    text: str, suffix: str, source: str, folder: Path | None = None, *, may_open: bool = True
) -> Layout:
    """Returns the layout in the text of a file whose name ends in `suffix`; the rest as for `parse_layout`.
    Raises LayoutError: it is no JSON or YAML, or no layout."""
    parse = parse_json if suffix.lower() == ".json" else parse_yaml
    data = parse(text, source, LayoutError)
    if is_graph(data):
        with under(source=source):
            data = layout_in_graph(data)
    return parse_layout(data, source, folder, may_open=may_open)


def layout_path(layout: str | os.PathLike[str]) -> Path:
    """Returns the path that a user means: text may be the name of a shipped layout, a `Path` is always a
    path. Raises LayoutError: there is neither a shipped layout nor anything else of this name."""
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
