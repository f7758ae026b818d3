"""Plays the refinement of an answer step by step on the robot."""

from collections.abc import Callable

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.tasks.answering import Answering
from webapp.tasks.background import EventLoop, Newest, Worker
from webapp.tasks.solver import STEPS, Reply, Solver

FRAME_S = 0.9
"""How long each step of a refinement is shown [s]."""

Frames = tuple[Allocation, ...]


class Playback:
    """Puts one frame after another in the place of the answer; a change of the state ends it."""

    def __init__(
        self,
        answering: Answering,
        solver: Solver,
        loop: EventLoop,
        worker: Worker,
        changed: Callable[[], None],
        failed: Callable[[str], None],
    ) -> None:
        """Prepare; `changed` and `failed` are called on the event loop."""
        self._answering, self._loop, self._changed, self._failed = answering, loop, changed, failed
        self._steps: Newest[Reply, Frames] = Newest(loop, worker, solver.refinement, self._begin)

    @property
    def frame(self) -> int | None:
        """Which step of the refinement is on the robot, None while none is played."""
        left = len(self._answering.frames)
        return STEPS + 2 - left if left else None

    def start(self) -> None:
        """Show how the refinement makes a raw candidate exact.

        Raises:
            FinlabError: there is no answer to the present state yet.
        """
        reply = self._answering.reply
        if reply is None or self._answering.busy:
            raise FinlabError("there is no answer yet; wait for one")
        self._steps.forget()
        self._steps.ask(reply)

    def _begin(self) -> None:
        steps = self._steps
        if steps.error is not None:
            self._failed(steps.error)
        elif steps.answered is self._answering.reply and not self._answering.busy:
            self._play(steps.findings or ())

    def _play(self, frames: Frames) -> None:
        self._answering.frames = frames
        self._changed()
        if frames:
            self._loop.later(FRAME_S, lambda: self._next(frames))

    def _next(self, frames: Frames) -> None:
        if self._answering.frames is frames:  # else it was ended, or started again
            self._play(frames[1:])
