"""What a robot takes home: the layout graph, as a value (`graph`) and as a file (`graph_file`)."""

from finlab.deploy.graph import LayoutGraph as LayoutGraph
from finlab.deploy.graph import SelfTest as SelfTest
from finlab.deploy.graph import build_graph as build_graph
from finlab.deploy.graph_file import graph_bytes as graph_bytes
from finlab.deploy.graph_file import parse_graph as parse_graph
from finlab.deploy.graph_file import read_graph as read_graph
from finlab.deploy.graph_file import write_graph as write_graph
