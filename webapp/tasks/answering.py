"""The newest answer of one page, its modes and their refinement, and what of them is shown."""

import asyncio
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.errors import FinlabError
from webapp.session import Session
from webapp.session.looking import WAYS
from webapp.tasks.background import Context, Newest
from webapp.tasks.null_ways import null_modes
from webapp.tasks.solver import NO_MODES, Modes, Reply

SEARCH_REST_S = 0.2
"""How long there must be no newer answer before all its modes are searched for [s]: that takes a while."""
STEP_S = 0.2
"""Time between two steps [s]."""
HOLD = 5
"""Steps for which the end is seen before it begins anew."""


class Seen(NamedTuple):
    """What is seen of the newest answer, which may be older than the state."""

    best: Allocation | None
    """The answer itself."""
    shown: Allocation | None
    """What is on the robot: the answer with the chosen mode's command, or, while that is refined, with what
    has become so far of the proposal that leads to it."""
    in_reach: bool
    busy: bool
    error: str | None
    """Why the present state has no answer."""
    modes: Modes
    searching: bool
    proving: bool
    """True until what is proved of the answer is known."""
    mode: int
    """Which of the modes is shown."""
    step: int | None
    """How many steps of their refinement the network's proposals have had; None for all."""


class Answering:
    """The newest answer, its modes, and the part of it that is on the robot."""

    def __init__(self, context: Context, known: Callable[[], None]) -> None:
        """Answer what the page's session asks; `known` is called when its candidates are."""
        self._session: Session = context.session
        self._changed, self._known, self._notify = context.changed, known, context.notify
        self._noted: str | None = None
        self._shown: tuple[Allocation, Array, Allocation] | None = None
        self._solver, loop, worker = context.solver, context.loop, context.workers.answers
        self._answer = Newest(loop, worker, self._solver.reply, self._take)
        self._search = Newest(loop, worker, self._modes, self._take_modes, SEARCH_REST_S)

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

    def seen(self) -> Seen:
        """What is seen of the newest answer now."""
        session, search, reply = self._session, self._search, self._answer.findings
        busy, modes, mode = self.busy, search.findings or NO_MODES, session.mode
        searching = busy or search.busy
        known = search.answered is not None and search.answered[0] is reply
        best = shown = None if reply is None else reply.answer
        steps = 0 if searching else modes.steps
        step = session.step if steps else None
        if best is not None and not busy and known and (modes.null is not None or not searching):
            proposal = modes.proposal_of(mode) if step is not None and step < steps else None
            if step is not None and proposal is not None:
                shown = self._variant(best, modes.ways[step].command[proposal])
            elif 0 < mode < len(modes.shown):
                shown = self._variant(best, modes.shown[mode].mode.command)
        return Seen(
            *(best, shown, reply is not None and reply.in_reach, busy, None if busy else self._answer.error),
            *(modes, searching, busy or not known),
            *(min(mode, max(len(modes.shown) - 1, 0)), step),
        )

    def _variant(self, best: Allocation, command: Array) -> Allocation:
        """The answer with another command; kept, because every refresh asks for it."""
        known = self._shown
        if known is None or known[0] is not best or not np.array_equal(known[1], command, equal_nan=True):
            known = self._shown = (best, command, best.with_command(command))
        return known[2]

    def ask(self) -> None:
        """Have the worker answer the present state, unless it was asked already."""
        self._answer.ask(self._session.state)
        if not self.busy:
            self._look(at_once=True)

    def _look(self, at_once: bool) -> None:
        """Prove the newest answer, and search for its modes once these can be seen."""
        reply, session, before = self._answer.findings, self._session, self._search.question
        kept = "" if before is None else before[1]
        kind = drawer if (drawer := session.drawer) in WAYS else kept * (session.mode > 0)
        known = before is not None and before[0] is reply and not kind  # it is proved, and not looked at
        if reply is not None and not known:
            self._search.ask((reply, kind, session.shifts if kind == WAYS[1] else ()), at_once)

    def forget(self) -> None:
        """Nothing is known of the robot any more: another one was opened, or the page has gone."""
        for task in (self._answer, self._search):
            task.forget()

    def _modes(self, question: tuple[Reply, str, tuple[float, ...]]) -> Modes:
        """On the worker's thread."""
        reply, kind, shifts = question
        modes = self._solver.modes(reply, seen=kind == WAYS[0])
        return null_modes(reply.answer, shifts) if kind == WAYS[1] else modes

    def _take(self) -> None:
        error = self._answer.error
        if self._answer.findings is not None:
            self._look(at_once=False)
        else:
            self._search.forget()
            if error is not None and error != self._noted:
                self._notify("No answer", error)
        self._noted = error
        self._changed()

    def _take_modes(self) -> None:
        if self._search.error is not None:
            self._notify("No candidates", self._search.error)
        self._known()


class Refining:
    """Plays the refinement of what the network proposes: in the plot, on the robot, and in what is said."""

    def __init__(self, context: Context, answering: Answering) -> None:
        self._session, self._loop, self._changed = context.session, context.loop, context.changed
        self._answering = answering
        self._timer: asyncio.TimerHandle | None = None
        self._held = 0

    @property
    def running(self) -> bool:
        """Whether it goes on by itself."""
        return self._timer is not None

    def toggle(self) -> None:
        """Play, from the proposals where the end is shown, or pause. FinlabError: nothing can be played."""
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
        looked_at = session.opened == WAYS[0]
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
