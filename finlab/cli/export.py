"""`finlab export`: write what a robot needs, the whole bundle or the layout graph file alone."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg


def export(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    output: Annotated[Path, arg(metavar="DIR|FILE.graph.json", aliases=["-o"])],
    zip: bool = False,
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    method: Literal["dual", "mdn"] = "dual",
    checkpoint: Annotated[str | None, arg(metavar="NAME|FOLDER")] = None,
) -> None:
    """Write the deployment bundle: layout graph, the fins' physics, settings, README and checksums.

    Args:
        layout: layout file, layout graph file, bundle, or the name of a shipped layout.
        output: folder to write; a name that ends in .graph.json takes the layout graph file alone.
        zip: write one archive, DIR.zip, instead of a folder.
        failed: name of a fin that does not work.
        method: who answers on the robot: dual keeps watts least, mdn the paper's effort; the networks of
            mdn travel with it.
        checkpoint: of mdn, the shipped one by default.
    """
    from finlab.cli.inputs import open_robot
    from finlab.cli.layout_table import counted
    from finlab.errors import FinlabError
    from finlab.layout.load import SUFFIX

    graph_alone = output.name.endswith(SUFFIX)
    if zip and graph_alone:
        raise FinlabError(f"{output}: a graph file alone is not zipped; name a folder, or leave out --zip")
    if output.suffix == ".json" and not graph_alone:
        raise FinlabError(f"{output}: expected a file name that ends in {SUFFIX}, or a folder")
    robot = open_robot(layout)  # before a network is loaded
    failed = robot.with_failed(failed)
    from finlab.allocation import Allocator

    allocator = Allocator(robot.layout, method, checkpoint=checkpoint)
    if graph_alone:
        from finlab.deploy.bundle import write_graph_and_tables
        from finlab.deploy.graph import build_graph

        graph = build_graph(allocator, failed)
        write_graph_and_tables(graph, output)
        print(f"{output}: {counted(robot.layout)}, {len(graph.self_test)} self-tests, method {method}")
        return
    from finlab.deploy.bundle import make_bundle

    bundle = make_bundle(allocator, failed)
    if zip:
        output = output if output.suffix == ".zip" else output.with_name(output.name + ".zip")
        bundle.write_zip(output)
    else:
        bundle.write(output)
    size = sum(map(len, bundle.files.values())) / 1e6
    print(f"{output}: {counted(robot.layout)}, {len(bundle.files)} files, {size:.2f} MB")
    print(f"check it on the robot: finlab-runtime check {output.name}")
