"""`finlab layout import|export`: layouts from and to the formats of others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg


def import_layout(
    file: Annotated[Positional[Path], arg(metavar="FILE.urdf|FILE.csv")],
    output: Annotated[Path, arg(metavar="LAYOUT.yaml", aliases=["-o"])],
    fins: Annotated[tuple[str, ...], arg(metavar="LINK...")] = (),
    origin: Literal["gravity", "base"] = "gravity",
    name: Annotated[str | None, arg(metavar="TEXT")] = None,
) -> None:
    """Make a layout file from a robot description (URDF) or a table (CSV).

    Args:
        file: a URDF file, or a CSV file with the columns x_m, y_m, z_m and, if wanted, name,
            mounting_angle_deg and limits.
        output: layout file to write.
        fins: links of the URDF file that are fins; a joint's origin gives the position, its axis the shaft.
        origin: where the layout's origin goes: the centre of gravity of all links, or the root link's frame.
        name: what to call the layout.
    """
    from finlab.errors import CommandError
    from finlab.exchange import read_csv, read_urdf
    from finlab.layout import save_layout

    kind = file.suffix.lower()
    if kind not in (".urdf", ".xml", ".csv"):
        raise CommandError(f"{file}: expected a file that ends in .urdf or .csv")
    layout = read_csv(file) if kind == ".csv" else read_urdf(file, fins, origin)
    if name is not None:
        layout = replace(layout, name=name)
    save_layout(layout, output)
    print(f"{output}: layout {layout.name} with {layout.n_fins} fins; look at it with")
    print(f"finlab layout show {output}")


def export_layout(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    output: Annotated[Path, arg(metavar="FILE.urdf|FILE.csv", aliases=["-o"])],
) -> None:
    """Write a layout as a robot description (URDF) or a table (CSV).

    Args:
        layout: layout file, layout graph file, or the name of a shipped layout.
        output: file to write; its ending says in which format.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import CommandError
    from finlab.exchange import write_csv, write_urdf

    writers = {".urdf": write_urdf, ".csv": write_csv}
    if output.suffix.lower() not in writers:
        raise CommandError(f"{output}: expected a file that ends in .urdf or .csv")
    robot = open_robot(layout)
    writers[output.suffix.lower()](robot.layout, output)
    print(f"{output}: {robot.layout.n_fins} fins")
