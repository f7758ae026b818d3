"""`finlab layout check|show|capability|optimize|convert`: checks, shows, improves and converts
layouts."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Literal, cast

from tyro.conf import Positional, UseAppendAction, arg

from finlab.cli import shared_options
from finlab.errors import FinlabError, printable

if TYPE_CHECKING:
    from finlab.analysis import Improvement
    from finlab.axes import MotionAxis

Box = tuple[float, float, float, float, float, float]
"""Least and largest x, y and z [m]."""
REMARKS = ("finlab.swim.vehicle.righting:righting_words",)
"""Functions that return a remark on a valid layout, or None, as `module:function`: the wings add
theirs here."""


def check(layouts: Annotated[Positional[tuple[str, ...]], arg(metavar="LAYOUT...")]) -> int:
    """Say of each layout file whether it is valid, and if not, which key is wrong and why.

    Args:
        layouts: files or names of shipped layouts.
    """
    if not layouts:
        raise FinlabError(
            "layout check: expected at least one file or name of a shipped layout, got none"
        )
    n_bad = 0
    for text in layouts:
        try:
            layout, _ = shared_options.open_robot(text)
        except FinlabError as error:
            print(f"finlab: error: {error}", file=sys.stderr)
            n_bad += 1
        else:
            print(f"{text}: ok, layout {layout.name} with {layout.counts_in_words}")
            for note in layout.parts_notes:
                print(f"{text}: {note}")
            for remark in REMARKS:
                if (words := resolve_name(remark)(layout)) is not None:
                    print(f"{text}: {words}")
    return 2 if n_bad else 0


def show(
    layout: shared_options.Robot,
    lost: shared_options.Lost = (),
    flow: shared_options.Flow = None,
    json: shared_options.JsonFile = None,
) -> None:
    """Print the actuators of a layout and its score card: what it can do, what it can lose, and
    which pairs of losses are fatal.

    Args:
        lost: name of an actuator that does not work.
    """
    from dataclasses import asdict

    from finlab.analysis import score_card, second_losses
    from finlab.analysis.second_losses import pair_blocks
    from finlab.display import text

    shared_options.check_json_file(json)
    robot, lost_names = shared_options.open_robot(layout, lost)
    card = score_card(robot, lost_names, flow)
    pairs = second_losses(robot, lost_names, flow)
    values = card.to_dict() | {"second_losses": [asdict(pair) for pair in pairs]}
    pair_text = text(pair_blocks(pairs, card.n_actuators))
    shared_options.put_json(values, json, f"{robot}\n\n{card}\n\n{pair_text}")


def capability(
    layout: shared_options.Robot,
    standard: Literal["dnv"] | None = None,
    ship: Annotated[Path | None, arg(metavar="FILE.yaml")] = None,
    loads: Annotated[Path | None, arg(metavar="FILE.csv")] = None,
    headings: Annotated[int, arg(metavar="N")] = 36,
    lost: shared_options.Lost = (),
    flow: shared_options.Flow = None,
    losses: Annotated[
        tuple[Literal["ventilation", "flushing", "skeg"], ...] | None, arg(metavar="LOSS...")
    ] = None,
    power: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="W|BUS=W")] = (),
    plot: Annotated[Path | None, arg(metavar="FILE")] = None,
    csv: Annotated[Path | None, arg(metavar="FILE.csv")] = None,
    json: shared_options.JsonFile = None,
) -> None:
    """Print by heading the largest steady load that a robot or ship can hold, with all actuators
    and after each single loss.

    Without further options it is the largest force from each heading, all other axes held at 0.

    Args:
        standard: dnv for DP capability numbers by DNV-ST-0111, level 1; it takes --ship.
        ship: file of a ship's particulars, with a block `ship:`.
        loads: table with the load of each heading: columns heading_deg and Fx to Tz [N, N m]; the
            result is the share of it that can be held.
        headings: how many headings, evenly spaced around the robot.
        lost: name of an actuator that does not work already.
        losses: losses of thrust that count besides the constant one; all of the standard's by
            default.
        power: the most that all actuators may take together [W], or those of a power bus of the
            layout, such as aft=60, in place of the layout's budget; inf for no limit.
        plot: file for the polar plot, .png, .svg or .pdf (needs matplotlib, extra plot).
        csv: file for a table with a column for each loss.
    """
    from finlab.allocation.power_budget import power_from
    from finlab.analysis.capability import MAX_HEADINGS, dp_capability
    from finlab.analysis.capability import capability as capability_by_loads
    from finlab.analysis.capability_text import capability_picture
    from finlab.analysis.dnv_thrust import LOSSES
    from finlab.analysis.load_file import read_loads
    from finlab.analysis.ship_file import read_ship
    from finlab.display.figures import check_figure_file, write_figure
    from finlab.errors import CommandError, DataError
    from finlab.files.worker import in_worker
    from finlab.whole_file import write_whole

    shared_options.check_json_file(json)
    shared_options.check_json_file(csv, "csv")
    check_figure_file(plot)
    if (standard is None) != (ship is None):
        raise CommandError("expected --standard dnv and --ship FILE together, got one of them")
    if standard is not None and (loads is not None or flow is not None):
        raise CommandError("--standard dnv has loads of its own: leave out --loads and --flow")
    if standard is None and losses is not None:
        raise CommandError("--losses are those of a standard: expected --standard dnv, too")
    if not 1 <= headings <= MAX_HEADINGS:
        raise CommandError(f"headings: expected 1 to {MAX_HEADINGS} of them, got {headings}")
    robot, lost_names = shared_options.open_robot(layout, lost)
    angles = tuple(360.0 * k / headings for k in range(headings))
    watts = power_from(power)
    if ship is not None:
        known = LOSSES if losses is None else losses
        particulars = in_worker(read_ship, ship)
        answer = dp_capability(robot, particulars, angles, lost_names, known, power=watts)
    elif loads is not None:
        angles, wrench = in_worker(read_loads, loads)
        answer = capability_by_loads(robot, wrench, angles, lost_names, flow, power=watts)
    else:
        answer = capability_by_loads(robot, None, angles, lost_names, flow, power=watts)
    if csv is not None:
        write_whole(csv, answer.to_csv(), DataError)
    if plot is not None:
        write_figure(lambda: capability_picture(answer), plot)
    shared_options.put_json(answer.to_dict(), json, str(answer))


def convert_layout(
    file: Annotated[Positional[str], arg(metavar="FILE")],
    output: Annotated[Positional[Path], arg(metavar="OUT")],
    to: Literal["layout", "urdf", "sdf", "mjcf", "px4", "ardusub", "matrix"] | None = None,
    fins: Annotated[tuple[str, ...], arg(metavar="LINK...")] = (),
    thrusters: Annotated[tuple[str, ...], arg(metavar="LINK...")] = (),
    origin: Literal["gravity", "base"] = "gravity",
    force: Annotated[tuple[float, float] | None, arg(metavar="LEAST MOST")] = None,
    frame: Literal["FLU", "FRD"] | None = None,
    rows: Literal["axes", "thrusters"] | None = None,
    length: Literal["m", "cm", "mm"] | None = None,
    model: Annotated[str | None, arg(metavar="NAME")] = None,
) -> None:
    """Make a layout of a file of others, or the other way round: URDF, SDF, MuJoCo, PX4, ArduSub, a
    matrix.

    Args:
        file: robot description (URDF, SDF, MJCF), parameters of PX4 or ArduSub, factors, matrix,
            places and directions, or layout.
        output: file to write; its end says the form.
        to: form of the output, where its end is not enough.
        fins: links or bodies of a robot description that are fins.
        thrusters: links that are thrusters although no plugin drives them.
        origin: where the layout's origin goes: the centre of gravity of all links, or the root
            link's frame.
        force: least and most force [N] of every thruster, in place of the file's.
        frame: frame of a matrix or of places: x forward, and y left, z up (FLU) or y right, z down
            (FRD); what the file says, else FLU, by default.
        rows: what the rows of a matrix without labels are, where they may be both.
        length: unit of positions whose key names none.
        model: which model of a description of several; the first with thrusters by default.
    """
    from finlab.exchange import Exchange, convert
    from finlab.files.worker import in_worker

    exchange = Exchange(
        fins=fins,
        thrusters=thrusters,
        origin=origin,
        force=force,
        frame=frame,
        rows=rows,
        length=length,
        model=model,
    )
    layout, notes = in_worker(convert, file, output, to, exchange)
    lines = [
        f"{output}: {layout.name} with {layout.counts_in_words}",
        *(f"- {printable(note)}" for note in notes),
    ]
    print("\n".join(lines))


def optimize(
    layout: shared_options.Robot,
    actuators: Annotated[tuple[str, ...], arg(metavar="NAME...", aliases=["--fins"])],
    output: Annotated[Path, arg(metavar="FILE.yaml", aliases=["-o"])],
    goal: Annotated[str, arg(metavar="NAME")] = "weakest_direction",
    reach: Annotated[float, arg(metavar="M")] = 0.05,
    turn: Annotated[float, arg(metavar="DEG")] = 90.0,
    mirror: bool = True,
    axes: Annotated[tuple[str, ...], arg(metavar="AXIS...")] = (),
    flow: shared_options.Flow = None,
    wrench: Annotated[
        UseAppendAction[tuple[shared_options.Wrench, ...]], arg(metavar="FX FY FZ TX TY TZ")
    ] = (),
    box: Annotated[Box | None, arg(metavar="X0 X1 Y0 Y1 Z0 Z1")] = None,
    keep_out: Annotated[UseAppendAction[tuple[Box, ...]], arg(metavar="X0 X1 Y0 Y1 Z0 Z1")] = (),
    bound: bool = False,
    rounds: shared_options.Count = 40,
    searches: shared_options.Count = 1,
    seed: shared_options.Count = 0,
    cluster: shared_options.Cluster = None,
    json: shared_options.JsonFile = None,
) -> None:
    """Move actuators within bounds to raise a goal, and write the layout that results.

    Args:
        actuators: those that may move; mirrored twins follow.
        output: layout file to write.
        goal: weakest_direction, mission_power or worst_single_failure.
        reach: how far each may go from where it is, either way along x, y and z [m].
        turn: how far each may turn about the vertical, either way [deg]; all but fins with a
            mounting angle also tilt, by as much.
        mirror: keep actuators that are each other's mirror image so.
        axes: surge, sway, heave, roll, pitch, yaw: those whose directions count; all that there are
            actuators enough for by default.
        wrench: a wrench of the mission for mission_power [N, N m]; may be given several times.
        box: ends along x, y and z of a box [m]; those that move may go anywhere in it, in place of
            --reach.
        keep_out: ends of a box in which none of them may stand [m]; may be given several times.
        bound: say what no layout within the bounds exceeds (thrusters at rest, goals of
            directions).
        rounds: most rounds of each search.
        searches: how many times it searches from other starts; the best result counts.
        seed: same arguments and seed, same layout.
    """
    from dataclasses import replace

    from tqdm import tqdm

    from finlab.analysis import Bounds, Progress, optimize_layout
    from finlab.analysis.goals import MISSION
    from finlab.analysis.keep_out import KeepOut
    from finlab.layout import save_layout

    shared_options.check_json_file(output, "output")
    shared_options.check_json_file(json)
    shared_options.check_positive(rounds=rounds, searches=searches)
    robot = shared_options.open_robot(layout)[0]
    if not (0.0 <= reach < math.inf and 0.0 <= turn <= 180.0):
        raise FinlabError(
            f"expected --reach from 0 m and --turn from 0 to 180 degrees, got {reach:g}, {turn:g}"
        )
    moving = [robot.actuators[i] for i in robot.indices(actuators)]
    space = {
        actuator.name: Bounds.around(actuator, reach, math.radians(turn)) for actuator in moving
    }
    if box is not None:
        ends = _box_ends(box)
        space = {name: replace(bounds, **ends) for name, bounds in space.items()}
    keep_outs = [KeepOut(**_box_ends(ends)) for ends in keep_out]
    bar = tqdm(
        total=rounds * searches, desc=goal, unit="round", disable=None, leave=False, file=sys.stderr
    )

    def report(progress: Progress) -> None:
        bar.update()
        bar.set_postfix_str(f"{progress.before:.4g} -> {progress.best:.4g}")

    with bar, shared_options.mapping_on(cluster) as mapped:
        improvement = optimize_layout(
            robot,
            actuators,
            space,
            goal,
            None if mirror else (),
            mission=wrench or MISSION,
            rounds=rounds,
            searches=searches,
            seed=seed,
            keep_outs=keep_outs,
            bound=bound,
            axes=cast("tuple[MotionAxis, ...]", axes) or None,  # which checks them
            flow=flow,
            progress=report,
            mapped=mapped,
        )
    save_layout(improvement.layout, output)
    values = improvement.to_dict() | {"output": str(output)}
    shared_options.put_json(values, json, _improvement_text(improvement, output))


def _box_ends(box: Box) -> dict[str, tuple[float, float]]:
    """The ends of a box by the names of its axes [m]."""
    return {"x": box[:2], "y": box[2:4], "z": box[4:]}


def _improvement_text(improvement: Improvement, output: Path) -> str:
    """Where the actuators went, the card after it, and where the layout was written."""
    from finlab.analysis.card_text import card_blocks
    from finlab.analysis.improvement_text import improvement_remarks, moved_table
    from finlab.display import text

    remarks = " ".join(remark.text for remark in improvement_remarks(improvement))
    written = "written." if improvement.improved else "written unchanged."
    moved = moved_table(improvement)
    return text([remarks, moved, *card_blocks(improvement.card_after), f"{output}: {written}"])
