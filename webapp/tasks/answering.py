"""Keeps one page's answer up to date: asks for the newest state, and knows what of the answer is shown."""

import asyncio
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.allocation.modes import Mode
from webapp.session import Session
from webapp.tasks.debounce import Debounced
from webapp.tasks.density import Densities
from webapp.tasks.mode_names import NamedMode, known_modes, named_modes, nearest_modes, same_mode
from webapp.tasks.solver import Reply, Solver
from webapp.tasks.worker import Worker

SEARCH_REST_S = 0.2
"""How long there must be no newer answer before all its modes are searched for [s]: that takes a while."""


class Answering:
    """The newest answer, its modes, and the part of it that is on the robot."""

    def __init__(
        self,
        session: Session,
        solver: Solver,
        worker: Worker,
        loop: asyncio.AbstractEventLoop,
        post: Callable[[Callable[[], object]], None],
        changed: Callable[[], None],
        failed: Callable[[str], None],
    ) -> None:
        """Prepare.

        Args:
            session: whose questions are answered.
            solver: answers them.
            worker: on whose thread.
            loop: the event loop that everything else here runs on.
            post: brings a call to it.
            changed: called there when there is a new answer, or none.
            failed: called there with a sentence when a state has no answer.
        """
        self._session, self._solver, self._worker = session, solver, worker
        self._post, self._changed, self._failed = post, changed, failed
        self._asked = -1
        self._revision = -1
        self._error: str | None = None
        self._error_revision = -1
        self._shown: tuple[Allocation, NDArray, Allocation] | None = None
        self._search = Debounced(solver.modes, SEARCH_REST_S, worker, loop, post, self._take_modes)
        self.reply: Reply | None = None
        """The newest answer with all that belongs to it; it may be older than the state."""
        self.modes: tuple[NamedMode, ...] = ()
        """Its first modes: at once those that it knows anyway, and after a moment of rest the best of all."""
        self.n_modes = 0
        """How many it has; more may be known than are shown."""
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
    def searching(self) -> bool:
        """True until all modes of the newest answer are known."""
        return self._search.busy

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
            return self._variant(best, best.samples.command[sample])
        if 0 < mode < len(self.modes):
            return self._variant(best, self.modes[mode].mode.command)
        return best

    def _variant(self, best: Allocation, command: NDArray) -> Allocation:
        """The answer with another command; kept, because every refresh asks for it."""
        known = self._shown
        if known is None or known[0] is not best or not np.array_equal(known[1], command, equal_nan=True):
            known = self._shown = (best, command, best.with_command(command))
        return known[2]

    def ask(self) -> None:
        """Have the worker answer the present state, unless it was asked already."""
        state, revision = self._session.state, self._session.revision
        if self._asked == revision:
            return
        self._asked = revision

        def job() -> None:
            self._post(partial(self._take, revision, self._solver.reply(state)))

        def failed(text: str) -> None:
            self._post(partial(self._take_error, revision, text))

        self._worker.submit(id(self), job, failed)

    def close(self) -> None:
        """Nobody wants to know any more."""
        self._worker.forget(id(self))
        self._search.close()

    def _take(self, revision: int, reply: Reply) -> None:
        if revision < self._revision:
            return
        self.frames = ()
        self.reply, self._revision = reply, revision
        self._name(known_modes(reply.answer))
        self._error = None
        self._search.ask(reply)
        self._changed()

    def _take_modes(self) -> None:
        """All modes of the newest answer are known; what is on the robot stays there if it can."""
        if self._search.busy:
            return
        if self._search.error is not None:  # those that are known must do
            self._changed()
            return
        before, mode = self.modes, self._session.mode
        self._name(self._search.findings or ())
        if 0 < mode < len(before):
            self._session.show_mode(same_mode(before[mode].mode, self.modes))
        self._changed()

    def _name(self, modes: tuple[Mode, ...]) -> None:
        self.modes, self.n_modes = named_modes(modes), len(modes)
        samples = None if self.best is None else self.best.samples
        self.sample_modes = nearest_modes(samples, self.modes)

    def _take_error(self, revision: int, text: str) -> None:
        if text != self._error:
            self._failed(text)
        self._error, self._error_revision = text, revision
        self._changed()
