"""`finlab export`: write the layout graph file that a robot takes home."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg


def export(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    output: Annotated[Path, arg(metavar="FILE.graph.json", aliases=["-o"])],
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    checkpoint: Annotated[str, arg(metavar="NAME|FOLDER")] = "default",
) -> None:
    """Write the layout graph for deployment: fins, features, normalization and a self-test.

    Args:
        layout: layout file, layout graph file, or the name of a shipped layout.
        output: file to write; its name ends in .graph.json.
        failed: name of a fin that does not work.
        checkpoint: trained checkpoint the graph is made for.
    """
    from finlab.cli.inputs import open_robot
    from finlab.deploy import build_graph, write_graph
    from finlab.deploy.graph_file import check_graph_name

    check_graph_name(output)  # before the seconds it takes to load the network
    robot = open_robot(layout)
    from finlab.allocation import load_allocator

    graph = build_graph(robot.layout, load_allocator(checkpoint), failed=robot.with_failed(failed))
    write_graph(graph, output)
    print(f"{output}: {graph.layout.n_fins} fins, {len(graph.self_test)} self-tests, checkpoint {checkpoint}")
