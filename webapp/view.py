"""One browser: state, questions, answers, and the page that is written of them, in one loop.

browser   a widget changes       viser calls `Intents.do` on the event loop
loop      the session changes    nothing else ever changes it
loop      `Jobs.ask`             what can be seen is asked; what was asked already costs nothing
thread    `solve(question)`      pure: it knows no widget, no session, no loop
loop      `facts_of`, `Board`    widgets are functions of facts; what did not change is not sent
"""

import asyncio
import time
from typing import Any

import viser

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.facts import facts_of
from webapp.intents import Intents
from webapp.page import Page
from webapp.panels.frame import Frame
from webapp.session import Session
from webapp.tasks.context import Context
from webapp.tasks.slot import Attended, Bell, Pools, Slot
from webapp.tasks.solver import Solver

PATIENCE_S = 0.025
"""How long a change waits for its answer before the page is written without it [s]: a browser takes
longer to write a page twice than once."""
TOGETHER_S = 0.4
"""How long what comes beside an answer waits for the rest of it [s]."""
Slots = frozenset[Slot[Any, Any]]
NONE: Slots = frozenset()
DRAWN_S = 0.004
"""How long after its words the view is drawn [s]: a browser shows what comes without nodes of the
view at once, and the rest with its next picture."""


class View:
    """Panels and scene of one client around its session, and the loop that keeps them so."""

    def __init__(
        self,
        client: viser.ClientHandle,
        session: Session,
        solver: Solver,
        pools: Pools,
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        """Build the page and begin; called on `loop`, which is viser's. Threads of `pools`
        compute."""
        self.client = client
        self.session = session
        self.bell = Bell(loop)
        self.intents = Intents(client, self.bell)
        page = self.page = Page(client, Context(session, solver, pools, self.bell), self.intents)
        self.do = page.do
        self.jobs = page.jobs
        self.board = page.board
        self.scenery = page.scenery
        self.designs = page.designs
        self.deferred = page.deferred
        self.frame = Frame(page)
        page.presses.start()
        self._revision: int | None = None
        self._is_due = True
        self._held_until = 0.0
        self._held_for: Slots = NONE
        self.bell.ring()
        self._task = loop.create_task(self._run())

    @property
    def shown(self) -> Allocation | None:
        """What is on the robot."""
        return self.page.shown

    @property
    def busy(self) -> bool:
        """True while the newest answer is older than the state."""
        return self.jobs.answering.busy

    @property
    def is_settled(self) -> bool:
        """Whether all that was asked is answered, and written."""
        return not (self._is_due or self.bell.rings or self.jobs.busy)

    async def _run(self) -> None:
        while True:
            left = None
            try:
                self._look()
                if self._is_due:
                    left = self._held_s()
                    if left is None:
                        await self._write()
            except Exception as error:  # the page must go on, whatever we have got wrong
                self.intents.fault(error)
            await self.bell.wait(left)

    def _look(self) -> None:
        """Take what has been answered and done, ask what follows, and see whether the page is
        due."""
        came = []
        for waiting in self.bell.take():
            if self._attend(waiting):
                came.append(waiting)
        done = self.intents.is_new
        if not came and not done and self._revision is not None:
            return
        self._is_due = True
        self.intents.is_new = False
        jobs = self.jobs
        jobs.ask()
        revised = self._revision != self.session.revision
        self._revision = self.session.revision
        if revised and self.busy:
            self._hold(PATIENCE_S, frozenset([jobs.answering.slot]))
        elif done or not jobs.beside.issuperset(came):
            self._held_for = NONE
        else:
            self._hold(TOGETHER_S, jobs.beside)

    def _attend(self, waiting: Attended) -> bool:
        """Let something that has rung go on; whether there is something new to show."""
        try:
            came = waiting.attend()
        except FinlabError as error:
            self.intents.notify("Not possible", str(error))
            return True
        except Exception as error:
            self.intents.fault(error)
            return True
        if came and isinstance(waiting, Slot) and waiting.title and waiting.is_error_new:
            self.intents.notify(waiting.title, str(waiting.error))
        return came

    def _hold(self, seconds: float, slots: Slots) -> None:
        """Leave the page as it is until some slots are answered, but no longer than some time
        [s]."""
        if self._held_for != slots:
            self._held_for = slots
            self._held_until = time.monotonic() + seconds

    def _held_s(self) -> float | None:
        """How much longer the page is left as it is [s]; None where it is to be written."""
        left = self._held_until - time.monotonic()
        for slot in self._held_for:
            if left > 0.0 and slot.busy:
                return left
        self._held_for = NONE
        return None

    async def _write(self) -> None:
        """Words first, then the view."""
        with self.client.atomic():
            self._write_words()
        self.client.flush()
        if self.board.view.is_due:
            await asyncio.sleep(DRAWN_S)
            with self.client.atomic():
                self.board.draw()
            self.client.flush()
        self._is_due = False

    def _write_words(self) -> None:
        intents = self.intents
        board = self.board
        session = self.session
        if intents.is_distrusted:
            board.distrust()
            intents.is_distrusted = False
        for handle in intents.doubted:
            board.doubt(handle)
        intents.doubted.clear()
        try:
            seen = self.jobs.answering.seen()
            guide = session.guide
            if guide.stop is not None and seen.shown is not None and not seen.busy:
                guide.take(seen.shown)
            self.scenery.follow_guide()
            scale = self.scenery.fit(session.state.target, seen.shown)
            facts = facts_of(session, self.jobs, seen, self.scenery.robot.dragged, scale)
        except Exception as error:
            board.fail(error)
        else:
            board.refresh(facts)

    def close(self) -> None:
        """The browser has gone."""
        self._task.cancel()
        self.jobs.stop()
        self.deferred.forget()
