"""Swims of the app and of `finlab simulate` as logs that are judged."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from finlab.errors import DataError
from finlab.layout import Layout
from finlab.log import Log, read_log
from finlab.log.read import log_of_record
from finlab.log.recorded import LogRecord, Series
from finlab.swim.simulation.log import load_log

SUFFIX = ".npz"
"""End of the name of a swim's log."""
UNKNOWN_ROBOT = (
    "is a swim of {}, which is neither the robot of the page nor a shipped one with the actuators "
    "{}; open that robot first"
)
"""The error about a swim whose robot is not at hand: the file holds the names of its actuators."""


def read_any_log(path: Path, robot: Layout | None, robots: Sequence[Layout]) -> Log:
    """Returns the log of an autopilot, of ROS or of a swim.

    Args:
        path: of the file.
        robot: by whose laws the log of a program is judged; by its own parameters when None.
        robots: robots that a swim may be of.

    Raises:
        DataError: it is damaged, of an unknown kind, or of no known robot.
        LayoutError: the robot does not fit it.
    """
    if path.suffix.lower() == SUFFIX:
        return read_swim(path, robots)
    return read_log(path, robot)


def read_swim(path: Path, robots: Sequence[Layout]) -> Log:
    """Returns the log of a swim for the first robot of its name and actuators.

    What the controller asked for counts as demanded; what the allocator commanded, as sent.

    Args:
        path: of the file.
        robots: robots that it may be of.

    Raises:
        DataError: it is no log of a swim, or of another robot.
        LayoutError: the commands do not fit the robot.
    """
    swim = load_log(path)
    able = [robot for robot in robots if robot.names == swim.names]
    # One of the same name comes first; the app's user may have given it another since.
    able.sort(key=lambda robot: robot.name != swim.layout)
    if not able:
        problem = UNKNOWN_ROBOT.format(swim.layout, ", ".join(swim.names)[:200])
        raise DataError(f"{path}: {problem}")
    time = swim.time
    command = swim.command.reshape(len(time), -1)
    record = LogRecord(
        form="finlab",
        demand=Series.of(time, np.asarray(swim.asked)),
        outputs=Series.of(time, command),
        of_shares=False,
        notes=[f"The swim went along {swim.task} by {swim.method}, controller {swim.controller}."],
    )
    return log_of_record(path.name, record, able[0], None)
