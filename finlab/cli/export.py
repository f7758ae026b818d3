"""`finlab export`: write what a robot needs."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg


def export(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    output: Annotated[Path, arg(metavar="DIR", aliases=["-o"])],
    zip: bool = False,
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    method: Literal["dual", "mdn"] = "dual",
) -> None:
    """Write the deployment bundle: the robot, its fins' physics, settings, README and checksums.

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        output: folder to write.
        zip: write one archive, DIR.zip, instead of a folder.
        failed: name of a fin that does not work.
        method: who answers on the robot: dual keeps watts least, mdn the paper's effort, by the networks
            that come with finlab.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import FinlabError

    if output.suffix == ".json":
        raise FinlabError(f"{output}: expected a folder, got the name of a file")
    robot, failed = open_robot(layout, failed)  # before a network is loaded
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
