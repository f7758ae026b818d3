"""Write the layout graph that goes to the robot, read it back, and look at it with networkx.

You will see the file's checksum, its first self-test, and the edges that are left once a fin is lost.
"""

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import networkx

import finlab
from finlab.deploy.graph import build_graph
from finlab.deploy.graph_file import read_graph, write_graph


def main() -> None:
    layout = finlab.load_layout("A")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "A.graph.json"
        write_graph(build_graph(finlab.Allocator(layout), failed=("back_left",)), path)
        document = json.loads(path.read_text())
        graph = read_graph(path)
    assert graph.layout == layout
    print(document["checksum"])
    print("target", graph.self_test[0].wrench)
    print("command", graph.self_test[0].command)
    fins = networkx.node_link_graph(document["graph"], edges="edges")
    print("fins", list(fins.nodes))
    print("edges", [f"{a}-{b}" for a, b in fins.edges if a != b])


if __name__ == "__main__":
    main()
