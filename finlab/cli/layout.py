"""`finlab layout check|show|optimize|import|export`: look at layout files, improve and exchange them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg
from tyro.extras import SubcommandApp

from finlab.cli.json_file import JsonFile, check_json_file, put_json
from finlab.cli.layout_table import layout_text
from finlab.cli.optimize import optimize

verbs = SubcommandApp()
verbs.command(optimize)


@verbs.command
def check(layouts: Annotated[Positional[tuple[str, ...]], arg(metavar="LAYOUT...")]) -> int:
    """Say of each layout file whether it is valid, and if not, which key is wrong and why.

    Args:
        layouts: files or names of shipped layouts.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import FinlabError

    if not layouts:
        raise FinlabError("layout check: expected at least one file or name of a shipped layout, got none")
    n_bad = 0
    for text in layouts:
        try:
            layout = open_robot(text).layout
        except FinlabError as error:
            print(f"finlab: error: {error}", file=sys.stderr)
            n_bad += 1
        else:
            print(f"{text}: ok, layout {layout.name} with {layout.counted}")
    return 2 if n_bad else 0


@verbs.command
def show(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    json: JsonFile = None,
) -> None:
    """Print the actuators of a layout and, of fins, the score card: what it can do, what it can lose.

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        failed: name of an actuator that does not work.
        json: file for one JSON object; it is printed in place of the tables where no file is named.
    """
    from finlab.analysis import score_card
    from finlab.cli.inputs import open_robot
    from finlab.cli.score_card import score_card_text
    from finlab.layout import layout_to_dict

    check_json_file(json)
    robot = open_robot(layout)
    text, lost = layout_text(robot.layout), robot.with_failed(failed)
    if robot.layout.is_of_fins:
        card = score_card(robot.layout, lost)
        put_json(card.to_dict(), json, f"{text}\n\n{score_card_text(card)}")
        return
    robot.layout.indices(lost)
    values = {**layout_to_dict(robot.layout), "failed": lost}
    put_json(values, json, f"{text}\n\nA score card is made of robots of fins only.")


@verbs.command(name="import")
def import_layout(
    file: Annotated[Positional[Path], arg(metavar="FILE.urdf")],
    output: Annotated[Path, arg(metavar="LAYOUT.yaml", aliases=["-o"])],
    fins: Annotated[tuple[str, ...], arg(metavar="LINK...")] = (),
    origin: Literal["gravity", "base"] = "gravity",
) -> None:
    """Make a layout file from a robot description (URDF).

    Args:
        file: a URDF file.
        output: layout file to write.
        fins: links that are fins; a joint's origin gives the position, its axis the shaft.
        origin: where the layout's origin goes: the centre of gravity of all links, or the root link's frame.
    """
    from finlab.exchange import read_urdf
    from finlab.layout import save_layout

    layout = read_urdf(file, fins, origin)
    save_layout(layout, output)
    print(f"{output}: layout {layout.name} with {layout.n_fins} fins; look at it with")
    print(f"finlab layout show {output}")


@verbs.command(name="export")
def export_layout(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    output: Annotated[Path, arg(metavar="FILE.urdf", aliases=["-o"])],
) -> None:
    """Write a layout as a robot description (URDF).

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        output: file to write.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import CommandError
    from finlab.exchange import write_urdf

    if output.suffix.lower() != ".urdf":
        raise CommandError(f"{output}: expected a file that ends in .urdf")
    robot = open_robot(layout, fins_for="layout export")
    write_urdf(robot.layout, output)
    print(f"{output}: {robot.layout.n_fins} fins")
