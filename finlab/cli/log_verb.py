"""`finlab log`: judges a log: which axis was lost, at which limits, and what would have held it."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

from tyro.conf import Positional, UseAppendAction, arg

from finlab.cli import shared_options

if TYPE_CHECKING:
    from finlab.axes import Axis


def log(
    file: Annotated[Positional[Path], arg(metavar="FILE")],
    robot: Annotated[str | None, arg(metavar="LAYOUT")] = None,
    scale: Annotated[shared_options.Wrench | None, arg(metavar="FX FY FZ TX TY TZ")] = None,
    demand: Annotated[str | None, arg(metavar="TOPIC")] = None,
    outputs: Annotated[str | None, arg(metavar="TOPIC")] = None,
    priority: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="AXES")] = (),
    whole: bool = False,
    improve: bool = True,
    output: Annotated[Path | None, arg(metavar="FILE.yaml", aliases=["-o"])] = None,
    plot: Annotated[Path | None, arg(metavar="FILE")] = None,
    mcap: Annotated[Path | None, arg(metavar="FILE.mcap")] = None,
    json: shared_options.JsonFile = None,
) -> None:
    """Say from a log of PX4 (.ulg), ArduSub (.bin, .tlog) or ROS (a bag) why a thruster saturated,
    which axis was lost, and what would have held it.

    Args:
        file: log, or folder of a bag.
        robot: layout file or name of a shipped layout; the robot of the log's own parameters by
            default.
        scale: what a setpoint of 1 asks for on each axis [N, N m]; the autopilot's own rule by
            default.
        demand: topic of a bag with the wrench, where there are several.
        outputs: topic of a bag with what actuators were sent, where there are several.
        priority: for policy priority: a group of axes with commas between, most important first;
            the axis that lost most by default.
        whole: judge time disarmed, landed or on deck, too.
        improve: search for a better layout and replay on it.
        output: layout file to write that layout to.
        plot: file for a picture of the timeline, .png, .svg or .pdf (needs matplotlib, extra plot).
        mcap: file of MCAP for Foxglove and PlotJuggler, with the verdict, wrenches and forces.
    """
    from finlab.display.figures import check_figure_file, write_figure
    from finlab.files.worker import in_worker
    from finlab.layout import save_layout
    from finlab.log import judge, read_log
    from finlab.log.judgement_text import judgement_text
    from finlab.log.mcap_file import check_mcap_file, write_mcap
    from finlab.log.timeline_picture import timeline_picture

    shared_options.check_json_file(json)
    shared_options.check_json_file(output, "output")
    check_figure_file(plot)
    check_mcap_file(mcap)
    layout = None if robot is None else shared_options.open_robot(robot)[0]
    read = partial(read_log, scale=scale, demand=demand, outputs=outputs, whole=whole)
    groups = cast(
        "list[list[Axis]]", [group.split(",") for group in priority]
    )  # `judge` checks them
    recorded = in_worker(read, file, layout)
    judgement = judge(recorded, priority=groups, improve=improve)
    if plot is not None:
        write_figure(lambda: timeline_picture(judgement), plot)
    if mcap is not None:
        write_mcap(recorded, judgement, mcap)
    if output is not None and judgement.improved is not None:
        save_layout(judgement.improved, output)
    shared_options.put_json(judgement.to_dict() if json else None, json, judgement_text(judgement))
