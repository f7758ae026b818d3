"""`finlab export`: write what a robot needs."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg


def export(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    output: Annotated[Path | None, arg(metavar="DIR", aliases=["-o"])] = None,
    graph: Annotated[Path | None, arg(metavar="FILE")] = None,
    zip: bool = False,
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    method: Literal["dual", "mdn"] = "dual",
) -> None:
    """Write the deployment bundle (the robot, its actuators' physics, settings, README, checksums), or the
    layout graph file.

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        output: folder to write the bundle to.
        graph: file to write the graph of actuators to (JSON, node-link form), for networkx and learners.
        zip: write one archive, DIR.zip, instead of a folder.
        failed: name of a fin that does not work.
        method: who answers on the robot: dual keeps watts least, mdn the paper's effort, by the networks
            that come with finlab.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import FinlabError

    if output is None and graph is None:
        raise FinlabError("nothing to write: expected -o DIR (bundle), --graph FILE, or both")
    if output is not None and output.suffix == ".json":
        raise FinlabError(f"{output}: expected a folder, got the name of a file (a graph: --graph FILE)")
    robot, failed = open_robot(layout, failed)  # before a network is loaded
    if graph is not None:
        from finlab.deploy.graph_file import write_graph

        write_graph(robot.without(failed) if failed else robot, graph)
        print(f"{graph}: {robot.counted}, {len(robot.names) - len(failed)} nodes")
    if output is None:
        return
    from finlab.allocation import Allocator

    allocator = Allocator(robot, method)
    from finlab.deploy.bundle import make_bundle

    bundle = make_bundle(allocator, failed)
    if zip:
        output = output if output.suffix == ".zip" else output.with_name(output.name + ".zip")
        bundle.write_zip(output)
    else:
        bundle.write(output)
    size = sum(map(len, bundle.files.values())) / 1e6
    print(f"{output}: {robot.counted}, {len(bundle.files)} files, {size:.2f} MB")
    print(f"check it on the robot: finlab-runtime check {output.name}")
