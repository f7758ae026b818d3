"""Layout graph files: the robot as the complete graph of its actuators, for networkx and
learners."""

import math
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from finlab.errors import LayoutError
from finlab.files.schema import Name, checked
from finlab.layout.layout import MAX_ACTUATORS

POSITION_SCALE = 0.3
"""Positions [m] of order one: the paper's layouts lie within."""
SCALES = (0.6, 2.1, math.pi)
"""Amplitude [rad], frequency [Hz] and zero direction [rad] of order one."""


class Edge(Struct, forbid_unknown_fields=True):
    """Two actuators, or one twice."""

    source: Name
    target: Name


class Normalization(Struct, forbid_unknown_fields=True):
    """What numbers are divided by to be of order one."""

    features: dict[str, float]
    """Of the features of fins with horizontal shafts, by name, as the paper's network takes
    them."""
    wrench: dict[str, float]
    """Of each axis of a wrench [N, N m]: the robot's own wrench scale, in which errors are
    measured."""


class Data(Struct, forbid_unknown_fields=True):
    """What holds for the whole graph."""

    layout: dict[str, Any]
    """A layout file of version 2 without its actuators, which are the nodes."""
    normalization: Normalization
    format: Literal["finlab-graph"] = "finlab-graph"
    version: Literal[4] = 4


class Graph(Struct, forbid_unknown_fields=True):
    """A robot's actuators as nodes, each joined with every other one and with itself; node-link
    form.

    A node has the actuator's name as `id`, what a layout file says of it, and `features`: numbers
    by name and unit.
    """

    directed: Literal[False]
    multigraph: Literal[False]
    graph: Data
    nodes: Annotated[list[dict[str, Any]], Meta(min_length=1, max_length=MAX_ACTUATORS)]
    edges: list[Edge]


def layout_in_graph(data: Any) -> dict[str, Any]:
    """Returns the plain values of the layout file that a graph file holds. Raises LayoutError: a
    part of the graph is missing, unknown or not what it has to be."""
    graph = checked(data, Graph)
    names = [node.get("id") for node in graph.nodes]
    if [(edge.source, edge.target) for edge in graph.edges] != edges_of(names):
        raise LayoutError(
            "expected each actuator with itself and with those after it, in order", "edges"
        )
    parts = [
        {"name": node.get("id")} | {key: node[key] for key in node if key not in ("id", "features")}
        for node in graph.nodes
    ]
    return {**graph.graph.layout, "actuators": parts}


def edges_of(names: list[Any]) -> list[tuple[Any, Any]]:
    """Returns all pairs of names, each with itself too."""
    return [(a, b) for k, a in enumerate(names) for b in names[k:]]
