"""Keeps one page's answer up to date: asks for the newest state, and knows what of the answer is shown."""

from collections.abc import Callable

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from webapp.tasks.background import Newest
from webapp.tasks.context import Context
from webapp.tasks.mode_names import NO_MODES, Modes
from webapp.tasks.solver import Reply

SEARCH_REST_S = 0.2
"""How long there must be no newer answer before all its modes are searched for [s]: that takes a while."""


class Answering:
    """The newest answer, its modes, and the part of it that is on the robot."""

    def __init__(self, context: Context, found: Callable[[], None]) -> None:
        """Answer what the page's session asks; `found` is called when its candidates are known."""
        self._session = context.session
        self._changed, self._found, self._notify = context.changed, found, context.notify
        self._told: str | None = None
        self._shown: tuple[Allocation, Array, Allocation] | None = None
        loop, worker, solver = context.loop, context.workers.answers, context.solver
        self._answer = Newest(loop, worker, solver.reply, self._take)
        self._search = Newest(loop, worker, solver.modes, self._take_modes, SEARCH_REST_S)

    @property
    def reply(self) -> Reply | None:
        """The newest answer with all that belongs to it; it may be older than the state."""
        return self._answer.findings

    @property
    def best(self) -> Allocation | None:
        """The newest answer itself."""
        return None if self.reply is None else self.reply.answer

    @property
    def modes(self) -> Modes:
        """The ways to do what an answer does, known after a moment of rest; until then those of the answer
        before, of which none can be chosen."""
        return self._search.findings or NO_MODES

    @property
    def busy(self) -> bool:
        """True while the newest answer is older than the state."""
        return self._answer.answered != self._session.state

    @property
    def searching(self) -> bool:
        """True until all modes of the newest answer are known."""
        return self.busy or self._search.busy

    @property
    def error(self) -> str | None:
        """Why the present state has no answer."""
        return None if self.busy else self._answer.error

    @property
    def shown(self) -> Allocation | None:
        """What is on the robot: the answer with the chosen mode's command, or, while that is refined, with
        what has become so far of the proposal that leads to it."""
        best, mode, step, modes = self.best, self._session.mode, self._session.step, self.modes
        if best is None or self.searching:
            return best
        if step is not None and step < modes.steps and (proposal := modes.proposal_of(mode)) is not None:
            return self._variant(best, modes.ways[step].command[proposal])
        return self._variant(best, modes.shown[mode].mode.command) if 0 < mode < len(modes.shown) else best

    def _variant(self, best: Allocation, command: Array) -> Allocation:
        """The answer with another command; kept, because every refresh asks for it."""
        known = self._shown
        if known is None or known[0] is not best or not np.array_equal(known[1], command, equal_nan=True):
            known = self._shown = (best, command, best.with_command(command))
        return known[2]

    def ask(self) -> None:
        """Have the worker answer the present state, unless it was asked already."""
        self._answer.ask(self._session.state)

    def forget(self) -> None:
        """Nothing is known of the robot any more: another one was opened, or the page has gone."""
        for task in (self._answer, self._search):
            task.forget()

    def _take(self) -> None:
        error = self._answer.error
        if self.reply is not None:
            self._search.ask(self.reply)
        else:
            self._search.forget()
            if error is not None and error != self._told:
                self._notify("No answer", error)
        self._told = error
        self._changed()

    def _take_modes(self) -> None:
        if self._search.error is not None:
            self._notify("No candidates", self._search.error)
        self._found()
