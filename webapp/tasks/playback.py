"""Plays the refinement of an answer step by step on the robot."""

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.tasks.answering import Answering
from webapp.tasks.background import Newest
from webapp.tasks.context import Context
from webapp.tasks.solver import STEPS

FRAME_S = 0.9
"""How long each step of a refinement is shown [s]."""

Frames = tuple[Allocation, ...]


class Playback:
    """Puts one frame after another in the place of the answer; a change of the state ends it."""

    def __init__(self, context: Context, answering: Answering) -> None:
        """Play on the robot that shows the answers of `answering`."""
        self._context, self._answering = context, answering
        worker, refine = context.workers.answers, context.solver.refinement
        self._steps = Newest(context.loop, worker, refine, self._begin)

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
            self._context.notify("Not possible", steps.error)
        elif steps.answered is self._answering.reply and not self._answering.busy:
            self._play(steps.findings or ())

    def _play(self, frames: Frames) -> None:
        self._answering.frames = frames
        self._context.changed()
        if frames:
            self._context.loop.later(FRAME_S, lambda: self._next(frames))

    def _next(self, frames: Frames) -> None:
        if self._answering.frames is frames:  # else it was ended, or started again
            self._play(frames[1:])
