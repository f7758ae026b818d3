"""What a robot takes home: the layout graph, the bundle with its networks, and the runtime that answers.

Names are imported on first use: the runtime starts quickly and sets its threads before numpy is loaded.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from finlab.deploy.bundle import Bundle as Bundle
    from finlab.deploy.bundle import make_bundle as make_bundle
    from finlab.deploy.graph import LayoutGraph as LayoutGraph
    from finlab.deploy.graph import SelfTest as SelfTest
    from finlab.deploy.graph import build_graph as build_graph
    from finlab.deploy.graph_file import graph_bytes as graph_bytes
    from finlab.deploy.graph_file import parse_graph as parse_graph
    from finlab.deploy.graph_file import read_graph as read_graph
    from finlab.deploy.graph_file import write_graph as write_graph

_HOME = {
    "Bundle": "bundle",
    "make_bundle": "bundle",
    "LayoutGraph": "graph",
    "SelfTest": "graph",
    "build_graph": "graph",
    "graph_bytes": "graph_file",
    "parse_graph": "graph_file",
    "read_graph": "graph_file",
    "write_graph": "graph_file",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'finlab.deploy' has no attribute {name!r}")
    return getattr(import_module(f"finlab.deploy.{_HOME[name]}"), name)
