"""Plays the refinement of an answer step by step on the robot."""

from collections.abc import Callable
from typing import NamedTuple

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.session import Session
from webapp.session.state import State
from webapp.tasks.answering import Answering
from webapp.tasks.background import EventLoop, Newest, Worker
from webapp.tasks.solver import STEPS, Solver

FRAME_S = 0.9
"""How long each step of a refinement is shown [s]."""

Frames = tuple[Allocation, ...]


class Wanted(NamedTuple):
    """Whose refinement is to be played."""

    revision: int
    """Revision of the session."""
    state: State
    """Its state then."""
    answer: Allocation
    """The answer to it."""


class Playback:
    """Puts one frame after another in the place of the answer; a change of the state ends it."""

    def __init__(
        self,
        session: Session,
        answering: Answering,
        solver: Solver,
        loop: EventLoop,
        worker: Worker,
        changed: Callable[[], None],
        failed: Callable[[str], None],
    ) -> None:
        """Prepare; `changed` and `failed` are called on the event loop."""
        self._session, self._answering, self._solver = session, answering, solver
        self._loop, self._changed, self._failed = loop, changed, failed
        self._steps: Newest[Wanted, Frames] = Newest(loop, worker, self._refine, self._begin)

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
        best = self._answering.best
        if best is None or self._answering.busy:
            raise FinlabError("there is no answer yet; wait for one")
        self._steps.forget()
        self._steps.ask(Wanted(self._session.revision, self._session.state, best))

    def _refine(self, wanted: Wanted) -> Frames:
        return self._solver.refinement(wanted.state, wanted.answer)

    def _begin(self) -> None:
        steps = self._steps
        if steps.error is not None:
            self._failed(steps.error)
        elif steps.answered is not None and steps.answered.revision == self._session.revision:
            self._play(steps.findings or ())

    def _play(self, frames: Frames) -> None:
        self._answering.frames = frames
        self._changed()
        if frames:
            self._loop.later(FRAME_S, lambda: self._next(frames))

    def _next(self, frames: Frames) -> None:
        if self._answering.frames is frames:  # else it was ended, or started again
            self._play(frames[1:])
