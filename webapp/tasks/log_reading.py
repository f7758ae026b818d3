"""A log of an autopilot, of ROS or of a swim that one page judges, and its moments on the robot."""

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finlab.assets import install_command
from finlab.errors import FinlabError
from finlab.files.worker import in_worker
from finlab.layout import Layout
from webapp.session.files import shipped
from webapp.session.looking import LOG
from webapp.tasks.context import Context
from webapp.tasks.fitting import as_file, short_name
from webapp.tasks.log_samples import Sample
from webapp.tasks.slot import Slot, Work
from webapp.tasks.swimming import Swimming

if TYPE_CHECKING:  # who opens no log needs none of it
    from finlab.log import Judgement
    from finlab.log.judging import Progress

SUFFIXES = ".ulg,.bin,.tlog,.mcap,.db3,.bag,.npz"
"""Suffixes of logs, as a browser expects them."""
REPORT_PERIOD_S = 0.4
"""Least time between two reports of how far a judgement is [s]."""
READING = "reading the log"
"""What is done before there is a judgement."""


@dataclass(frozen=True, eq=False)
class LogFile:
    """A log that the browser sent."""

    name: str
    """Of the file."""
    content: bytes
    robot: Layout | None
    """By whose laws it is judged; None for what its own parameters say."""
    page_robot: Layout
    """The robot of the page, which a swim may be of."""


class LogReading(Slot[LogFile, "Judgement"]):
    """One log at a time for one page."""

    def __init__(self, context: Context, swimming: Swimming) -> None:
        """No log yet; a robot that swims waits while one is opened."""
        super().__init__(
            context.pools.long,
            context.bell,
            judge_upload,
            watched=True,
            stage=READING,
            title="Not judged",
        )
        self._session = context.session
        self._swimming = swimming
        self.by_page = False
        """Whether the page's robot counts, not that of the log's parameters."""
        self.moment: float | None = None
        """Which moment of the log is on the robot [s]."""
        self._is_on_page = False
        """Whether the robot of the log was put on the page."""
        self.shown: Judgement | None = None
        """The judgement, or what is known of it by now."""

    def forget(self) -> None:
        """Drop the log, and its judgement."""
        super().forget()
        self.shown = None

    def choose_robot(self, by_page: object) -> None:
        """Judge by the page's robot, or by the one that the log tells; a log that is there is
        judged anew."""
        self.by_page = bool(by_page)
        if self.question is not None:
            self.open(self.question.name, self.question.content)

    def open(self, name: str, content: bytes) -> None:
        """Judge a log in place of the one before."""
        self._open(name, content, self._session.state.layout if self.by_page else None)

    def open_sample(self, sample: Sample) -> None:
        """Judge a sample."""
        self._open(sample.file, sample.content(), sample.layout())

    def _open(self, name: str, content: bytes, robot: Layout | None) -> None:
        """Judge a log by the laws of a robot, or by its own parameters."""
        self.forget()
        self.moment = None
        self._is_on_page = False
        self._swimming.set_running(False)
        self._session.show_task(LOG)
        self.ask(LogFile(short_name(name), content, robot, self._session.state.layout))

    def attend(self) -> bool:
        """Take what has come; the log's robot and its worst moment are put on the page once."""
        came = super().attend()
        progress: Progress | str | None = self.progress
        if progress is None or isinstance(progress, str):
            self.shown = self.answer
        else:
            self.shown = progress.judgement
        judgement = self.shown
        if judgement is not None and not self._is_on_page:
            self._is_on_page = True
            self.jump(worst_moment(judgement))
        return came

    def jump(self, time: float) -> None:
        """Put the robot of the log, and the wrench that it asked for at a time [s], on the page."""
        judgement = self.shown
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


def worst_moment(judgement: "Judgement") -> float:
    """Returns the middle of the spell in which most was missing [s].

    Where nothing was lost, it is the time of the largest demand.
    """
    if judgement.spells:
        scale = judgement.scale
        worst = max(judgement.spells, key=lambda spell: float((spell.missing / scale).sum()))
        return 0.5 * (worst.start + worst.end)
    timeline = judgement.timeline
    sizes = np.linalg.norm(timeline.demand / judgement.scale, axis=1)
    return float(timeline.time[int(sizes.argmax())])


def judge_upload(file: LogFile, work: Work[LogFile]) -> "Judgement":
    """What is said of a log; reports what is known on the way, and ends with it where it is
    cancelled. FinlabError: it cannot be read."""
    try:
        from finlab.log import judge
        from webapp.tasks.swim_logs import read_any_log

        robots = [file.page_robot, *shipped().values()] if file.robot is None else [file.robot]
        with as_file(file.name, file.content) as path:
            log = in_worker(read_any_log, path, file.robot, robots)
    except ModuleNotFoundError as error:
        raise FinlabError(f"{file.name} needs {error.name}; {install_command('logs')}") from None
    next_report_s = 0.0

    def report(progress: "Progress") -> None:
        nonlocal next_report_s
        if time.monotonic() >= next_report_s:
            work.report(progress)
            next_report_s = time.monotonic() + REPORT_PERIOD_S

    return judge(log, report=report, cancelled=work.cancelled.is_set)
