"""Several methods on the same question, one after the other, while the page stays alive."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from finlab.allocation.allocation import Allocation
from webapp.session.state import COMPARED, State
from webapp.tasks.solver import Solver
from webapp.tasks.worker import Worker

TRIES = 3
"""Answers of each method, of whose times the shortest counts: the first one may have to load a network, and
on a busy machine any may have to wait."""

Answer = Allocation | str
"""An answer, or why there is none."""


class Comparison:
    """The answers of one run; its owner is told on the event loop whenever there is one more."""

    def __init__(
        self,
        solver: Solver,
        worker: Worker,
        post: Callable[[Callable[[], object]], None],
        changed: Callable[[], None],
    ) -> None:
        """Prepare to compare.

        Args:
            solver: answers.
            worker: whose thread computes.
            post: brings a call to the event loop.
            changed: called there after every answer.
        """
        self._solver, self._worker, self._post, self._changed = solver, worker, post, changed
        self.state: State | None = None
        """The question, None before the first run."""
        self.answers: dict[str, Answer] = {}
        """Answers so far, by method."""

    @property
    def running(self) -> bool:
        """True until all methods have answered."""
        return self.state is not None and len(self.answers) < len(COMPARED)

    def start(self, state: State) -> None:
        """Ask all methods about a state; a run that is still going on is given up."""
        self.state, self.answers = state, {}
        self._next(state)

    def cancel(self) -> None:
        """Give up and forget."""
        self.state, self.answers = None, {}

    def _next(self, state: State) -> None:
        waiting = [method for method in COMPARED if method not in self.answers]
        if not waiting:
            return
        method = waiting[0]

        # One job per method: questions of this and other pages are answered in between.
        def job() -> None:
            question = replace(state, method=method)
            answers = [self._solver.solve(question) for _ in range(TRIES)]
            answer = min(answers, key=lambda answer: answer.solve_ms)
            self._post(partial(self._take, state, method, answer))

        def failed(text: str) -> None:
            self._post(partial(self._take, state, method, text))

        self._worker.submit((id(self), "comparison"), job, failed)

    def _take(self, state: State, method: str, answer: Answer) -> None:
        if state is not self.state:
            return
        self.answers[method] = answer
        self._changed()
        self._next(state)
