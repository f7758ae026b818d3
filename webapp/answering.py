"""Keeps one page's answer up to date: asks for the newest state, and knows what of the answer is shown."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.density import Densities
from webapp.modes import Mode, distinct_modes, nearest_modes
from webapp.session import Session
from webapp.solver import Reply, Solver
from webapp.worker import Worker


class Answering:
    """The newest answer, its modes, and the part of it that is on the robot."""

    def __init__(
        self,
        session: Session,
        solver: Solver,
        worker: Worker,
        post: Callable[[Callable[[], object]], None],
        changed: Callable[[], None],
        failed: Callable[[str], None],
    ) -> None:
        """Prepare.

        Args:
            session: whose questions are answered.
            solver: answers them.
            worker: on whose thread.
            post: brings a call to the event loop.
            changed: called there when there is a new answer, or none.
            failed: called there with a sentence when a state has no answer.
        """
        self._session, self._solver, self._worker = session, solver, worker
        self._post, self._changed, self._failed = post, changed, failed
        self._asked = -1
        self._revision = -1
        self._error: str | None = None
        self._error_revision = -1
        self._shown: tuple[Allocation, str, int, Allocation] | None = None
        self.reply: Reply | None = None
        """The newest answer with all that belongs to it; it may be older than the state."""
        self.modes: tuple[Mode, ...] = ()
        """Its distinct modes."""
        self.sample_modes: NDArray | None = None
        """Which mode each raw sample is nearest to (K,)."""
        self.frames: tuple[Allocation, ...] = ()
        """Steps of a refinement that are still to be played, the present one first."""

    @property
    def best(self) -> Allocation | None:
        """The newest answer itself."""
        return None if self.reply is None else self.reply.answer

    @property
    def densities(self) -> Densities | None:
        """What the network proposed for it, where the method has a network."""
        return None if self.reply is None else self.reply.densities

    @property
    def busy(self) -> bool:
        """True while the newest answer is older than the state."""
        return max(self._revision, self._error_revision) != self._session.revision

    @property
    def error(self) -> str | None:
        """Why the present state has no answer."""
        return self._error if self._error_revision == self._session.revision else None

    @property
    def shown(self) -> Allocation | None:
        """The answer with the chosen mode's or sample's command, or the step of the refinement on show."""
        if self.frames:
            return self.frames[0]
        best, mode, sample = self.best, self._session.mode, self._session.sample
        if best is None:
            return None
        if sample is not None and best.samples is not None and sample < len(best.samples.command):
            return self._variant(best, "sample", sample)
        if best.candidates is not None and 0 < mode < len(self.modes):
            return self._variant(best, "mode", self.modes[mode].index)
        return best

    def _variant(self, best: Allocation, kind: str, index: int) -> Allocation:
        """The answer with another command; kept, because every refresh asks for it."""
        known = self._shown
        if known is None or known[0] is not best or known[1:3] != (kind, index):
            group = best.samples if kind == "sample" else best.candidates
            assert group is not None
            other = replace(best, command=group.command[index], wrench_surrogate=None)
            known = self._shown = (best, kind, index, other)
        return known[3]

    def ask(self) -> None:
        """Have the worker answer the present state, unless it was asked already."""
        state, revision = self._session.state, self._session.revision
        if self._asked == revision:
            return
        self._asked = revision

        def job() -> None:
            try:
                reply = self._solver.reply(state)
            except FinlabError as error:
                self._post(partial(self._take_error, revision, str(error)))
            except Exception as error:  # a fault of a method must not take the page with it
                self._post(partial(self._take_error, revision, f"{state.method} failed: {error}"))
                raise
            else:
                self._post(partial(self._take, revision, reply))

        self._worker.submit(id(self), job)

    def close(self) -> None:
        """Nobody wants to know any more."""
        self._worker.forget(id(self))

    def _take(self, revision: int, reply: Reply) -> None:
        if revision < self._revision:
            return
        self.frames = ()
        self.reply, self._revision = reply, revision
        answer = reply.answer
        self.modes = distinct_modes(answer.candidates)
        self.sample_modes = nearest_modes(answer.samples, answer.candidates, self.modes)
        self._error = None
        self._changed()

    def _take_error(self, revision: int, text: str) -> None:
        if text != self._error:
            self._failed(text)
        self._error, self._error_revision = text, revision
        self._changed()
