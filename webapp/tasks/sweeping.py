"""Plays one component of the target through a range, and notes what the fins do at each value."""

import asyncio
from functools import partial

import numpy as np

from finlab.arrays import Array
from finlab.errors import FinlabError
from webapp.session.state import AXIS_UNITS, AXIS_WORDS, MAX_TARGET, number
from webapp.tasks.answering import Answering
from webapp.tasks.context import Context

POINTS = 61
"""Values of a range, ends included."""
STEP_S = 1 / 15
"""Time between two values [s]: 4 s for one way through the range."""


class Sweep:
    """Goes to and fro through a range until it is stopped; then what was asked before comes back."""

    def __init__(self, context: Context) -> None:
        """Move the target of the page's session; everything here runs on the loop."""
        self._session, self._loop, self._do = context.session, context.loop, context.do
        self._timer: asyncio.TimerHandle | None = None
        self._place, self._step = 0, 1
        self._revision: int | None = None  # as the last step left it
        self.axis = 0
        """Which component is moved."""
        self.values: Array = np.zeros(POINTS)
        """Its values [N or N m]."""
        self.fins: tuple[str, ...] = ()
        """Fins that the notes are about."""
        self.force: Array = np.full((0, POINTS), np.nan)
        """Mean force of each fin at each value (n, POINTS) [N]; NaN where it is not known yet."""
        self.error: Array = np.full(POINTS, np.nan)
        """Error at each value (POINTS,)."""
        self.power: Array = np.full(POINTS, np.nan)
        """Power at each value (POINTS,) [W]."""

    @property
    def running(self) -> bool:
        """True from start to stop."""
        return self._timer is not None

    def start(self, axis: int, low: float, high: float) -> None:
        """Begin at the low end.

        Raises:
            FinlabError: the range is none.
        """
        self.stop()
        name = f"{AXIS_WORDS[axis]} [{AXIS_UNITS[axis]}]"
        low, high = (number(v, f"range of {name}", -MAX_TARGET, MAX_TARGET) for v in (low, high))
        if not low < high:
            raise FinlabError(f"range of {name}: expected the smaller end first, got {low:g} and {high:g}")
        self.axis, self.values = axis, np.linspace(low, high, POINTS)
        self.fins = self._session.state.layout.names
        self.force = np.full((len(self.fins), POINTS), np.nan)
        self.error, self.power = np.full((2, POINTS), np.nan)
        self._place, self._step, self._revision = 0, 1, None
        self._session.history.end_merge()
        self._timer = self._loop.later(0.0, self._go)

    def stop(self) -> None:
        """Bring back what was asked before; whoever has asked for something else meanwhile keeps that."""
        if self._timer is not None:
            self._timer.cancel()
            self._session.end_sweep()
        self._timer = None

    def _go(self) -> None:
        # Whoever changes anything else takes over: the sweep ends.
        taken = self._revision not in (None, self._session.revision)
        if taken or self.fins != self._session.state.layout.names:
            self.stop()
            self._do(lambda: None)
            return
        self._timer = self._loop.later(STEP_S, self._go)
        self._do(partial(self._session.sweep_target, self.axis, float(self.values[self._place])))
        self._revision = self._session.revision
        if not 0 <= self._place + self._step < POINTS:
            self._step = -self._step
        self._place += self._step

    def note(self, answering: Answering) -> None:
        """Note a new answer, if it is to one of the values."""
        answer = answering.best
        if answer is None or not self.running or answer.layout.names != self.fins:
            return
        at = int(np.argmin(np.abs(self.values - answer.target[self.axis])))
        if abs(self.values[at] - answer.target[self.axis]) < 1e-9:
            self.force[:, at] = np.linalg.norm(answer.forces, axis=1)
            self.error[at], self.power[at] = answer.err_norm, answer.power
