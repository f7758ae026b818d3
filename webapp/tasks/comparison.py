"""Several methods on the same question, one after the other, the quick ones first; the page stays alive."""

from dataclasses import replace
from typing import NamedTuple

from finlab.allocation.allocation import Allocation
from webapp.session.state import State, compared
from webapp.tasks.background import Newest
from webapp.tasks.context import Context

TRIES = 3
"""Answers of each method, of whose times the shortest counts: the first one may have to load a network, and
on a busy machine any may have to wait."""

Answer = Allocation | str


class Run(NamedTuple):
    """One comparison, as far as it has come."""

    state: State | None = None
    """The question, None before the first run."""
    answers: tuple[tuple[str, Answer], ...] = ()
    cancelled: bool = False

    @property
    def methods(self) -> tuple[str, ...]:
        """Those that are asked, in their order."""
        return () if self.state is None else compared(self.state.layout)

    @property
    def running(self) -> bool:
        """True until all methods have answered."""
        return len(self.answers) < len(self.methods) and not self.cancelled


class Comparison:
    """The runs of one page."""

    def __init__(self, context: Context) -> None:
        self._solver, self._changed = context.solver, context.changed
        # One question per method: those of this and other pages are answered in between.
        self._asked = Newest(context.loop, context.workers.answers, self._quickest, self._take)
        self.run = Run()

    def start(self, state: State) -> None:
        """Ask all methods about a state; a run that is still going on is given up."""
        self.forget()
        self.run = Run(state)
        self._next()

    def cancel(self) -> None:
        """Ask no more; the answers so far stay."""
        self._asked.forget()
        self.run = self.run._replace(cancelled=True)

    def forget(self) -> None:
        """Give up and forget."""
        self._asked.forget()
        self.run = Run()

    def _next(self) -> None:
        if self.run.state is not None and self.run.running:
            method = self.run.methods[len(self.run.answers)]
            self._asked.ask(replace(self.run.state, method=method))

    def _quickest(self, state: State) -> Allocation:
        return min((self._solver.solve(state) for _ in range(TRIES)), key=lambda answer: answer.solve_ms)

    def _take(self) -> None:
        asked = self._asked
        if self.run.state is not None and asked.answered is not None:
            answer = asked.error if asked.findings is None else asked.findings
            answers = (*self.run.answers, (asked.answered.method, answer or "no answer"))
            self.run = Run(self.run.state, answers)
            self._changed()
            self._next()
