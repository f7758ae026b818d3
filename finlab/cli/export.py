"""`finlab export`: write what a robot takes home, the whole bundle or the layout graph file alone."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg


def export(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    output: Annotated[Path, arg(metavar="DIR|FILE.graph.json", aliases=["-o"])],
    zip: bool = False,
    onnx: bool = False,
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    checkpoint: Annotated[str, arg(metavar="NAME|FOLDER")] = "default",
) -> None:
    """Write the deployment bundle: layout graph, trained weights, README and checksums.

    Args:
        layout: layout file, layout graph file, bundle, or the name of a shipped layout.
        output: folder to write; a name that ends in .graph.json takes the layout graph file alone.
        zip: write one archive, DIR.zip, instead of a folder.
        onnx: write the networks as ONNX files for other runtimes instead; needs finlab[onnx].
        failed: name of a fin that does not work.
        checkpoint: trained checkpoint the robot shall use.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import FinlabError
    from finlab.layout.load import SUFFIX

    graph_alone = output.name.endswith(SUFFIX)
    if (zip or onnx) and graph_alone:
        raise FinlabError(f"{output}: a graph file alone is not zipped; name a folder, or leave out --zip")
    if zip and onnx:
        raise FinlabError("--onnx writes a folder of ONNX files; leave out --zip")
    if output.suffix == ".json" and not graph_alone:
        raise FinlabError(f"{output}: expected a file name that ends in {SUFFIX}, or a folder")
    robot = open_robot(layout)  # before the network is loaded
    failed = robot.with_failed(failed)
    from finlab.allocation import load_allocator

    allocator = load_allocator(checkpoint=checkpoint)
    if graph_alone:
        from finlab.deploy.graph import build_graph
        from finlab.deploy.graph_file import write_graph

        graph = build_graph(robot.layout, allocator, failed)
        write_graph(graph, output)
        n_tests = len(graph.self_test)
        print(f"{output}: {robot.layout.n_fins} fins, {n_tests} self-tests, checkpoint {checkpoint}")
        return
    if onnx:
        from finlab.deploy.onnx_export import write_onnx

        assert allocator.weights is not None
        print(f"{output}: {', '.join(write_onnx(allocator.weights, output))}, checkpoint {checkpoint}")
        return
    from finlab.deploy.bundle import make_bundle

    bundle = make_bundle(robot.layout, allocator, failed)
    if zip:
        output = output if output.suffix == ".zip" else output.with_name(output.name + ".zip")
        bundle.write_zip(output)
    else:
        bundle.write(output)
    size = sum(map(len, bundle.files.values())) / 1e6
    print(f"{output}: {robot.layout.n_fins} fins, {len(bundle.files)} files, {size:.2f} MB")
    print(f"check it on the robot: finlab-runtime check {output.name}")
