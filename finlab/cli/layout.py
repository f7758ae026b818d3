"""`finlab layout check|show|optimize|convert`: look at layout files, improve and exchange them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg
from tyro.extras import SubcommandApp

from finlab.cli.json_file import JsonFile, check_json_file, put_json
from finlab.cli.layout_table import layout_text
from finlab.cli.optimize import Flow, optimize
from finlab.errors import printable

if TYPE_CHECKING:
    from finlab.exchange import Exchange
    from finlab.layout import Layout

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
    from finlab.vehicle.righting import righting_words

    if not layouts:
        raise FinlabError("layout check: expected at least one file or name of a shipped layout, got none")
    n_bad = 0
    for text in layouts:
        try:
            layout, _ = open_robot(text)
        except FinlabError as error:
            print(f"finlab: error: {error}", file=sys.stderr)
            n_bad += 1
        else:
            print(f"{text}: ok, layout {layout.name} with {layout.counted}")
            if (words := righting_words(layout)) is not None:
                print(f"{text}: {words}")
    return 2 if n_bad else 0


@verbs.command
def show(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    failed: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = (),
    flow: Annotated[Flow | None, arg(metavar="VX VY VZ WX WY WZ")] = None,
    json: JsonFile = None,
) -> None:
    """Print the actuators of a layout and its score card: what it can do, what it can lose.

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        failed: name of an actuator that does not work.
        flow: velocity of the robot relative to the water, body frame [m/s, rad/s]; it is at rest by default.
        json: file for one JSON object; it is printed in place of the tables where no file is named.
    """
    from finlab.analysis import score_card
    from finlab.cli.inputs import open_robot
    from finlab.cli.score_card import score_card_text

    check_json_file(json)
    robot, lost = open_robot(layout, failed)
    card = score_card(robot, lost, flow)
    put_json(card.to_dict(), json, f"{layout_text(robot)}\n\n{score_card_text(card)}")


@verbs.command(name="convert")
def convert_layout(
    file: Annotated[Positional[str], arg(metavar="FILE")],
    output: Annotated[Positional[Path], arg(metavar="OUT")],
    to: Literal["layout", "urdf", "sdf", "px4", "ardusub", "matrix"] | None = None,
    fins: Annotated[tuple[str, ...], arg(metavar="LINK...")] = (),
    thrusters: Annotated[tuple[str, ...], arg(metavar="LINK...")] = (),
    origin: Literal["gravity", "base"] = "gravity",
    force: Annotated[tuple[float, float] | None, arg(metavar="LEAST MOST")] = None,
    frame: Literal["FLU", "FRD"] = "FLU",
) -> None:
    """Make a layout of a file of others, or the other way round: URDF, SDF, PX4, ArduSub, a matrix.

    Args:
        file: robot description (URDF, SDF), parameters of PX4 or ArduSub, factors, matrix, or layout.
        output: file to write; its end says the form.
        to: form of the output, where its end is not enough.
        fins: links of a robot description that are fins.
        thrusters: links that are thrusters although no plugin drives them.
        origin: where the layout's origin goes: the centre of gravity of all links, or the root link's frame.
        force: least and most force [N] of every thruster, in place of the file's.
        frame: frame of a matrix: x forward, and y left, z up (FLU) or y right, z down (FRD).
    """
    from finlab.exchange import Exchange
    from finlab.files.worker import in_worker

    exchange = Exchange(fins, thrusters, origin, force, frame)
    layout, exchange = in_worker(_converted, file, output, to, exchange)
    print(
        "\n".join(
            [
                f"{output}: {layout.name} with {layout.counted}",
                *(f"- {printable(note)}" for note in exchange.notes),
            ]
        )
    )


def _converted(file: str, output: Path, to: str | None, exchange: Exchange) -> tuple[Layout, Exchange]:
    """The layout that went from one file into the other, and what there is to say of it."""
    from finlab.exchange import convert

    return convert(file, output, to, exchange), exchange
