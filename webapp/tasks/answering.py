"""The newest answer of one page, its modes and their refinement, and what of them is shown."""

import time
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.errors import FinlabError
from webapp.session import Session
from webapp.session.looking import CANDIDATES, MODE_DRAWERS, NULL_SPACE
from webapp.session.state import State
from webapp.tasks.context import Context
from webapp.tasks.mode_search import ModeSearch, search_modes
from webapp.tasks.slot import Slot
from webapp.tasks.solver import NO_MODES, Modes, Reply

SEARCH_REST_S = 0.2
"""How long there must be no newer answer before all its modes are searched for [s]: that takes a
while."""
PROVED = ("Allocate", "Log")
"""Tasks in which it is said how far an answer may be from the best."""
STEP_S = 0.2
"""Time between two steps [s]."""
HOLD = 5
"""Steps for which the end is seen before it begins anew."""


class ShownAnswer(NamedTuple):
    """What is seen of the newest answer, which may be older than the state."""

    best: Allocation | None
    """The answer itself."""
    shown_allocation: Allocation | None
    """What is on the robot: the answer with the chosen mode's command, or, while that is refined,
    with what has become so far of the proposal that leads to it."""
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


class Variant(NamedTuple):
    """An answer with another command."""

    best: Allocation
    """The answer itself."""
    command: Array
    """The other command (n, 3)."""
    answer: Allocation
    """The answer with that command."""


class Answering:
    """The newest answer, its modes, and the part of it that is on the robot."""

    def __init__(self, context: Context) -> None:
        """Answer what the page's session asks."""
        self._session: Session = context.session
        self._last_variant: Variant | None = None
        pool = context.pools.answers
        bell = context.bell
        solver = context.solver
        self.slot: Slot[State, Reply] = Slot(
            pool, bell, solver.reply, live=True, title="No answer", alike=State.is_same_but_target
        )
        self.search: Slot[ModeSearch, Modes] = Slot(
            pool,
            bell,
            search_modes,
            rest_s=SEARCH_REST_S,
            title="No candidates",
            alike=ModeSearch.is_same_but_target,
        )
        self._solver = solver

    @property
    def modes(self) -> Modes:
        """The modes of an answer, known after a moment of rest; until then those of the answer
        before, of which none can be chosen."""
        return self.search.answer or NO_MODES

    @property
    def busy(self) -> bool:
        """True while the newest answer is older than the state."""
        return self.slot.answered != self._session.state

    @property
    def searching(self) -> bool:
        """True until all modes of the newest answer are known."""
        return self.busy or self.search.busy

    def shown_answer(self) -> ShownAnswer:
        """What is seen of the newest answer now."""
        session = self._session
        search = self.search
        reply = self.slot.answer
        busy = self.busy
        modes = search.answer or NO_MODES
        mode = session.mode
        searching = busy or search.busy
        is_proved = search.answered is not None and search.answered.reply is reply
        best = None if reply is None else reply.answer
        shown_allocation = best
        steps = 0 if searching else modes.steps
        step = session.step if steps else None
        # Sliders of the null space are followed while its modes are searched for.
        can_choose = is_proved and not busy and (modes.null_space is not None or not searching)
        if best is not None and can_choose:
            proposal = None
            if step is not None and step < steps:
                proposal = modes.proposal_of(mode)
            if step is not None and proposal is not None:
                shown_allocation = self._variant(best, modes.refinement[step].command[proposal])
            elif 0 < mode < len(modes.visible):
                shown_allocation = self._variant(best, modes.visible[mode].mode.command)
        return ShownAnswer(
            best=best,
            shown_allocation=shown_allocation,
            in_reach=reply is not None and reply.in_reach,
            busy=busy,
            error=None if busy else self.slot.error,
            modes=modes,
            searching=searching,
            proving=busy or not is_proved,
            mode=min(mode, max(len(modes.visible) - 1, 0)),
            step=step,
        )

    def _variant(self, best: Allocation, command: Array) -> Allocation:
        """The answer with another command; kept, because every refresh asks for it."""
        last = self._last_variant
        if (
            last is None
            or last.best is not best
            or not np.array_equal(last.command, command, equal_nan=True)
        ):
            last = Variant(best, command, best.with_command(command))
            self._last_variant = last
        return last.answer

    def ask(self) -> None:
        """Have the present state answered; then have the answer proved, where that is said, and its
        modes found, where these can be seen."""
        session = self._session
        self.slot.ask(session.state)
        reply = self.slot.answer
        before = self.search.question
        if reply is None:
            self.search.forget()
            return
        presents = session.display.presents
        drawer = CANDIDATES if presents and session.state.layout.is_of_fins else session.drawer
        if session.desk.task not in PROVED and not presents:
            return
        if drawer not in MODE_DRAWERS:
            # A mode that is chosen stays on the robot when the drawer is closed.
            drawer = before.drawer if before is not None and session.mode > 0 else ""
        is_known = before is not None and before.reply is reply
        if is_known and not drawer:  # it is proved, and its modes are not looked at
            return
        shifts = session.shifts if drawer == NULL_SPACE else ()
        # A drawer that is opened has rested already.
        search = ModeSearch(self._solver, reply, drawer or "", shifts)
        self.search.ask(search, at_once=is_known)

    def forget(self) -> None:
        """Nothing is known of the robot any more: another one was opened, or the page has gone."""
        self.slot.forget()
        self.search.forget()


class Refining:
    """Plays the refinement of what the network proposes: in the plot, on the robot, and in what is
    said."""

    def __init__(self, context: Context, answering: Answering) -> None:
        self._session = context.session
        self._bell = context.bell
        self._answering = answering
        self._due_s = 0.0
        """Time of the next step, while it is `running` [s]."""
        self._held = 0
        self.running = False
        """Whether it goes on by itself."""

    def toggle(self) -> None:
        """Play, from the proposals where the end is shown, or pause. FinlabError: nothing can be
        played."""
        if self.running:
            self.stop()
            return
        session = self._session
        modes = self._answering.modes
        if self._answering.searching or not modes.steps:
            raise FinlabError("the network proposes nothing here whose refinement could be shown")
        if (
            modes.proposal_of(session.mode) is None
        ):  # the answer of another method: then the network's best
            session.mode = min(mode for mode in modes.ends if mode >= 0)
        if session.step is None:
            session.step = 0
        self._wait()

    def stop(self) -> None:
        """Stay where it is."""
        self.running = False

    def hold(self, step: Any) -> None:
        """Stay at a step."""
        self.stop()
        self._session.show_step(int(step), self._answering.modes.steps)

    def _wait(self) -> None:
        self.running = True
        self._due_s = time.monotonic() + STEP_S
        self._bell.ring_later(STEP_S, self)

    def attend(self) -> bool:
        """Take the next step, when its time has come."""
        if not self.running or time.monotonic() < self._due_s:
            return False
        session = self._session
        steps = self._answering.modes.steps
        self.running = False
        is_visible = session.opened == CANDIDATES
        if self._answering.searching or not steps or not is_visible:
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
        return True
