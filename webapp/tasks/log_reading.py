"""A log of an autopilot or of ROS that one page judges, and its moments on the robot."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finlab.assets import install_command
from finlab.errors import FinlabError
from finlab.files.worker import in_worker
from finlab.layout import Layout
from webapp.tasks.context import Context
from webapp.tasks.fitting import as_file, short_name
from webapp.tasks.slot import Slot, Work

if TYPE_CHECKING:  # who opens no log needs none of it
    from finlab.log import Judgement

SUFFIXES = ".ulg,.bin,.tlog,.mcap,.db3,.bag"
"""Suffixes of logs, as a browser expects them."""


@dataclass(frozen=True, eq=False)
class LogFile:
    """A log that the browser sent."""

    name: str
    """Of the file."""
    content: bytes
    robot: Layout | None
    """By whose laws it is judged; None for what its own parameters say."""


class LogReading(Slot[LogFile, "Judgement"]):
    """One log at a time for one page."""

    def __init__(self, context: Context) -> None:
        super().__init__(
            context.pools.long,
            context.bell,
            judge_upload,
            watched=True,
            stage="reading the log",
            title="Not judged",
        )
        self._session = context.session
        self.by_page = False
        """Whether the page's robot counts, not that of the log's parameters."""
        self.moment: float | None = None
        """Which moment of the log is on the robot [s]."""

    def choose_robot(self, by_page: object) -> None:
        """Judge by the page's robot, or by the one that the log tells; a log that is there is
        judged anew."""
        self.by_page = bool(by_page)
        if self.question is not None:
            self.open(self.question.name, self.question.content)

    def open(self, name: str, content: bytes) -> None:
        """Judge a log in place of the one before."""
        self.forget()
        self.moment = None
        self._session.show_task("Log")
        self.ask(
            LogFile(short_name(name), content, self._session.state.layout if self.by_page else None)
        )

    def jump(self, time: float) -> None:
        """Put the robot of the log, and the wrench that it asked for at a time [s], on the page."""
        judgement = self.answer
        if judgement is None:
            raise FinlabError("open a log first")
        nearest = int(np.abs(judgement.timeline.time - time).argmin())
        self.moment = float(judgement.timeline.time[nearest])
        is_opened = self.use(judgement.robot, f"Robot of {judgement.source}")
        demand = judgement.timeline.demand[nearest].tolist()
        step = "" if is_opened else f"Moment of {judgement.source}"
        self._session.ask_for([repr(value) for value in demand], step)

    def use(self, layout: Layout, step: str) -> bool:
        """Open a robot of the log, unless it is there; whether it was opened."""
        is_new = self._session.state.layout != layout
        if is_new:
            self._session.open_layout(layout, step)
        return is_new


def judge_upload(file: LogFile, work: Work[LogFile]) -> "Judgement":
    """What is said of a log. FinlabError: it cannot be read."""
    try:
        from finlab.log import judge, read_log

        with as_file(file.name, file.content) as path:
            log = in_worker(read_log, path, file.robot)
    except ModuleNotFoundError as error:
        raise FinlabError(f"{file.name} needs {error.name}; {install_command('logs')}") from None
    work.report("asking other methods and policies the same")
    return judge(log)
