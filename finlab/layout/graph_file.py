"""Layout graph files: the robot as the complete graph of its actuators, for networkx and learners.

`finlab.deploy.robot_graph` writes them, `finlab.layout.load` reads them. The scales are those of
the paper's network, which `finlab.research.paper` feeds with the same features.
"""

import math
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from finlab.errors import LayoutError
from finlab.files.schema import Name, checked
from finlab.layout.layout import MAX_ACTUATORS

POSITION_SCALE = 0.3
"""Divisor of positions [m] that makes them of order one: the paper's layouts lie within."""
COMMAND_SCALES = (0.6, 2.1, math.pi)
"""Divisors of amplitude [rad], frequency [Hz] and zero direction [rad]."""


class Edge(Struct, forbid_unknown_fields=True):
    """An edge of the graph, between two actuators or from one to itself."""

    source: Name
    """Name of an actuator."""
    target: Name
    """Name of another one after it, or of the same."""


class PaperNormalization(Struct, forbid_unknown_fields=True):
    """What method `paper` makes of a wrench before its network sees it: (wrench - mean) / std."""

    mean: dict[str, float]
    """Of each axis of a wrench [N, N m], over the wrenches that its networks were trained on."""
    std: dict[str, float]
    """Their standard deviation; the squared norm of the missing wrench over it is its J_norm."""


class Normalization(Struct, forbid_unknown_fields=True):
    """Divisors that make numbers of order one."""

    features: dict[str, float]
    """Of the features of fins with horizontal shafts, by name, as the paper's network has them."""
    wrench: dict[str, float]
    """Of each axis of a wrench [N, N m]: the robot's wrench scale, by which an allocator's errors
    are normalized, with any method."""
    paper: PaperNormalization | None = None
    """What the networks of method `paper` divide by, the same for all robots; files of version 4
    do not say it."""


class GraphAttributes(Struct, forbid_unknown_fields=True):
    """Attributes of the graph."""

    layout: dict[str, Any]
    """A layout file of version 2 without its actuators, which are the nodes."""
    normalization: Normalization
    format: Literal["finlab-graph"] = "finlab-graph"
    version: Literal[4, 5] = 5


class Graph(Struct, forbid_unknown_fields=True):
    """A robot's actuators as nodes, each joined with every other one and with itself; node-link
    form.

    A node has the actuator's name as `id`, what a layout file says of it, and `features`: numbers
    by name and unit.
    """

    directed: Literal[False]
    multigraph: Literal[False]
    graph: GraphAttributes
    nodes: Annotated[list[dict[str, Any]], Meta(min_length=1, max_length=MAX_ACTUATORS)]
    edges: list[Edge]


def layout_data_in_graph(data: Any) -> dict[str, Any]:
    """Returns the plain values of the layout file that a graph file contains.

    Raises:
        LayoutError: a key of the graph is missing, unknown or has a wrong value.
    """
    graph = checked(data, Graph)
    names = [node.get("id") for node in graph.nodes]
    edges = [(edge.source, edge.target) for edge in graph.edges]
    if edges != edges_of(names):
        raise LayoutError(
            "expected each actuator with itself and with those after it, in order", "edges"
        )
    actuators = []
    for node in graph.nodes:
        actuator = {"name": node.get("id")}
        for key, value in node.items():
            if key not in ("id", "features"):
                actuator[key] = value
        actuators.append(actuator)
    return {**graph.graph.layout, "actuators": actuators}


def edges_of(names: list[Any]) -> list[tuple[Any, Any]]:
    """Returns all unordered pairs of names, those of a name with itself included."""
    edges = []
    for i, source in enumerate(names):
        for target in names[i:]:
            edges.append((source, target))
    return edges
