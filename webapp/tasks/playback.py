"""Plays the refinement of an answer step by step on the robot."""

import asyncio
from collections.abc import Callable
from functools import partial

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.session import Session
from webapp.tasks.answering import Answering
from webapp.tasks.refinement import STEPS
from webapp.tasks.solver import Solver
from webapp.tasks.worker import Worker

FRAME_S = 0.9
"""How long each step of a refinement is shown [s]."""


class Playback:
    """Puts one frame after another in the place of the answer; a change of the state ends it."""

    def __init__(
        self,
        session: Session,
        answering: Answering,
        solver: Solver,
        worker: Worker,
        loop: asyncio.AbstractEventLoop,
        post: Callable[[Callable[[], object]], None],
        changed: Callable[[], None],
        failed: Callable[[str], None],
    ) -> None:
        """Prepare; `changed` and `failed` are called on the event loop."""
        self._session, self._answering, self._solver = session, answering, solver
        self._worker, self._loop, self._post = worker, loop, post
        self._changed, self._failed = changed, failed

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
        best, state, revision = self._answering.best, self._session.state, self._session.revision
        if best is None or self._answering.busy:
            raise FinlabError("there is no answer yet; wait for one")

        def job() -> None:
            frames = self._solver.refinement(state, best)
            for frame in frames:
                _ = frame.wrench
            self._post(partial(self._play, revision, frames))

        def failed(text: str) -> None:
            self._post(partial(self._failed, text))

        self._worker.submit((id(self), "refinement"), job, failed)

    def _play(self, revision: int, frames: tuple[Allocation, ...]) -> None:
        self._answering.frames = frames if revision == self._session.revision else ()
        self._changed()
        if self._answering.frames:
            self._loop.call_later(FRAME_S, self._next, revision, frames)

    def _next(self, revision: int, frames: tuple[Allocation, ...]) -> None:
        if self._answering.frames is frames:  # else it was ended, or started again
            self._play(revision, frames[1:])
