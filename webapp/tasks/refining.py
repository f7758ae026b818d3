"""Plays the refinement of what the network proposes: in the plot, on the robot, and in what is said of it."""

import asyncio
from typing import Any

from finlab.errors import FinlabError
from webapp.tasks.answering import Answering
from webapp.tasks.context import Context

STEP_S = 0.2
"""Time between two steps [s]."""
HOLD = 5
"""Steps for which the end is seen before it begins anew."""


class Refining:
    """The clock of one page."""

    def __init__(self, context: Context, answering: Answering) -> None:
        """Nothing is played yet; `answering` knows the steps."""
        self._session, self._loop, self._changed = context.session, context.loop, context.changed
        self._answering = answering
        self._timer: asyncio.TimerHandle | None = None
        self._held = 0

    @property
    def running(self) -> bool:
        """Whether it goes on by itself."""
        return self._timer is not None

    def toggle(self) -> None:
        """Play, from the proposals where the end is shown, or pause.

        Raises:
            FinlabError: there is nothing to play.
        """
        if self.running:
            self.stop()
            return
        session, modes = self._session, self._answering.modes
        if self._answering.searching or not modes.steps:
            raise FinlabError("the network proposes nothing here whose refinement could be shown")
        if modes.proposal_of(session.mode) is None:  # the answer of another method: then the network's best
            session.mode = min(place for place in modes.ends if place >= 0)
        if session.step is None:
            session.step = 0
        self._wait()

    def stop(self) -> None:
        """Stay where it is."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None

    def hold(self, step: Any) -> None:
        """Stay at a step."""
        self.stop()
        self._session.show_step(int(step), self._answering.modes.steps)

    def _wait(self) -> None:
        self._timer = self._loop.later(STEP_S, self._go_on)

    def _go_on(self) -> None:
        session, steps, self._timer = self._session, self._answering.modes.steps, None
        looked_at = session.desk.opened[session.task] == "Candidates"
        if self._answering.searching or not steps or not looked_at:
            session.step = None
        else:
            if session.step is not None:
                session.show_step(session.step + 1, steps)
                self._held = 0
            else:
                self._held += 1
                session.step = 0 if self._held >= HOLD else None
            if session.step is not None or session.loops:
                self._wait()
        self._changed()
