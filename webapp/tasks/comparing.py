"""Several methods on the same question, one after the other."""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

from finlab.allocation.allocation import Allocation
from finlab.allocation.methods import method_class
from webapp.session.state import FIRST_POLICY, State, compared, is_same_robot
from webapp.tasks.context import Context
from webapp.tasks.slot import Slot
from webapp.tasks.solver import Solver

TRIES = 3
"""Answers of each method beside that which is shown, of whose times the shortest counts: the first
one may have to load a network, and on a busy machine any may have to wait."""
NUDGE = 1e-6
"""By what share of its size the wrench of each is another one: a question that was asked before is
answered from memory."""

Answer = Allocation | str
"""The answer of a method, or why it has none."""


class Run(NamedTuple):
    """One comparison, as far as it has come."""

    state: State | None = None
    """The question, None before the first run."""
    answers: tuple[tuple[str, Answer], ...] = ()
    cancelled: bool = False

    @property
    def methods(self) -> tuple[str, ...]:
        """All of them, in their order."""
        return () if self.state is None else compared(self.state.layout)

    @property
    def running(self) -> bool:
        """True until all methods have answered."""
        return len(self.answers) < len(self.methods) and not self.cancelled

    def answers_other_than(self, now: State) -> bool:
        """Whether the methods were asked something else than a state asks; by which method it is
        answered there does not count, for all have been asked."""
        compared = self.state
        if compared is None:
            return False
        is_as_asked = (
            is_same_robot(compared, now)
            and compared.target == now.target
            and compared.policy == now.policy
            and compared.speed == now.speed
            and compared.temperature == now.temperature
            and compared.network == now.network
        )
        return not is_as_asked


class Comparison(Slot[State, Allocation]):
    """The runs of one page: one question per method, so that those of other pages are answered in
    between."""

    def __init__(self, context: Context) -> None:
        super().__init__(context.pools.answers, context.bell, partial(_quickest, context.solver))
        self.run = Run()

    def start(self, state: State) -> None:
        """Ask all methods about a state; a run that is still going on is given up."""
        super().forget()
        self.run = Run(state)
        self._next(state)

    def cancel(self) -> None:
        """Ask no more; the answers so far stay."""
        super().forget()
        self.run = self.run._replace(cancelled=True)

    def forget(self) -> None:
        """Give up and forget."""
        super().forget()
        self.run = Run()

    def attend(self) -> bool:
        """Note an answer that has come, and ask the next method."""
        came = super().attend()
        if came and self.answered is not None:
            answer = self.answer or self.error or "no answer"
            self.run = self.run._replace(
                answers=(*self.run.answers, (self.answered.method, answer))
            )
            self._next(self.answered)
        return came

    def _next(self, state: State) -> None:
        """Asks the next method about a state, where one is left."""
        if self.run.running:
            self.ask(replace(state, method=self.run.methods[len(self.run.answers)]))


def _quickest(solver: Solver, state: State) -> Allocation:
    """The answer to a state, with the time of the quickest of `TRIES` to nearly the same one."""
    if state.policy != FIRST_POLICY and "policy" not in method_class(state.method).reads:
        # What is in reach is answered alike under every policy.
        plain = replace(state, policy=FIRST_POLICY)
        answer = solver.solve(plain)
        state = plain if answer.reachable else state
    times = []
    for k in range(1, TRIES + 1):
        fx, fy, fz, tx, ty, tz = (value * (1.0 - k * NUDGE) for value in state.target)
        nudged = replace(state, target=(fx, fy, fz, tx, ty, tz))
        times.append(solver.solve(nudged).solve_ms)
    return replace(solver.solve(state), solve_ms=min(times))
