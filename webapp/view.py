"""One browser: state, questions, answers, and the page that is written of them, in one loop.

browser   a widget changes       viser calls `Intents.do` on the event loop
loop      the session changes    nothing else ever changes it
loop      `Jobs.ask`             what can be seen is asked; an old question costs nothing
thread    `solve(question)`      pure: it knows no widget, no session, no loop; on the loop where
                               that is quicker than to hand it over
loop      `facts_of`, `Board`    widgets are functions of facts; only what changed is sent
"""

import asyncio
from typing import Any

import viser

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.box_labels import in_boxes
from webapp.facts import facts_of, pair_facts
from webapp.intents import Intents
from webapp.page import Page
from webapp.panels.following import begin_following
from webapp.panels.frame import Frame
from webapp.panels.presenting import begin_presenting
from webapp.session import Session
from webapp.start_page import connect_start_page
from webapp.tasks.context import Context
from webapp.tasks.following import Lectures
from webapp.tasks.slot import Attended, Bell, Pools, Slot
from webapp.tasks.solver import Solver
from webapp.viser_internals import Outbox

PATIENCE_S = 0.025
"""How long a change waits for its answer before the page is written without it [s]: a browser takes
longer to write a page twice than once."""
TOGETHER_S = 0.4
"""How long what comes beside an answer waits for the rest of it [s]."""
Slots = frozenset[Slot[Any, Any]]
NO_SLOTS: Slots = frozenset()


class View:
    """Panels and scene of one client around its session, and the loop that keeps them so."""

    def __init__(
        self,
        client: viser.ClientHandle,
        session: Session,
        solver: Solver,
        pools: Pools,
        loop: asyncio.AbstractEventLoop,
        lectures: Lectures | None = None,
    ) -> None:
        """Build the page and begin; called on `loop`, which is viser's. Threads of `pools`
        compute; the page may follow one of `lectures`."""
        self.client = client
        self.session = session
        self._loop = loop
        self._outbox = Outbox(client)
        self.bell = Bell(loop)
        self.intents = Intents(client, self.bell)
        context = Context(session, solver, pools, self.bell)
        page = self.page = Page(client, context, self.intents, lectures or Lectures())
        self.do = page.do
        self.jobs = page.jobs
        self.board = page.board
        self.scenery = page.scenery
        self.designs = page.designs
        self.deferred = page.deferred
        self.frame = Frame(page)
        page.presses.start()
        connect_start_page(page)
        begin_following(page)
        begin_presenting(page)
        self._revision: int | None = None
        self._is_due = True
        self._held_for: Slots = NO_SLOTS
        """Slots whose answers the page waits for before it is written."""
        self._patience: asyncio.TimerHandle | None = None
        """Ends that wait."""
        self.bell.ring()
        self._task = loop.create_task(self._run())

    @property
    def shown_allocation(self) -> Allocation | None:
        """What is on the robot."""
        return self.page.shown_allocation

    @property
    def busy(self) -> bool:
        """True while the newest answer is older than the state."""
        return self.jobs.answering.busy

    @property
    def is_settled(self) -> bool:
        """Whether all that was asked is answered, and written."""
        return not (self._is_due or self.bell.rung.is_set() or self.jobs.busy)

    def animate(self, elapsed: float) -> None:
        """Let time pass [s]: a robot that swims moves on. A fault ends the swim of this page, and
        those of the others go on."""
        try:
            self.scenery.animate(elapsed)
        except Exception as error:
            self.jobs.swimming.halt()
            self.intents.fault(error)
            self.bell.ring()

    async def _run(self) -> None:
        while True:
            try:
                self._look()
                if self._is_due and not (self._held_for and self._is_held()):
                    if self._patience is not None:
                        self._end_hold()
                    self._write()
            except Exception as error:  # the page must go on, whatever we have got wrong
                self.intents.fault(error)
            await self.bell.rung.wait()

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
        following = self.page.following
        if following.lecture is not None:
            following.lecture.tell()
        jobs = self.jobs
        if came and not done and jobs.beside.issuperset(came):
            # Nothing is asked because of what comes beside an answer.
            self._hold(TOGETHER_S, jobs.beside)
            return
        jobs.ask()
        is_revised = self._revision != self.session.revision
        self._revision = self.session.revision
        if is_revised and jobs.answering.busy:
            self._hold(PATIENCE_S, jobs.first)
        elif self._patience is not None:
            self._end_hold()

    def _attend(self, waiting: Attended) -> bool:
        """Let something that has rung go on; whether there is something new to show."""
        try:
            came = waiting.attend()
        except FinlabError as error:
            self.intents.notify("Not possible", in_boxes(error))
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
        if self._held_for is slots:
            return
        if self._patience is not None:
            self._patience.cancel()
        self._held_for = slots
        self._patience = self._loop.call_later(seconds, self._let_go)

    def _let_go(self) -> None:
        """Write the page with the answers that there are."""
        self._held_for = NO_SLOTS
        self.bell.ring()

    def _is_held(self) -> bool:
        """Whether an answer is to come that the page waits for."""
        is_held = False
        for slot in self._held_for:
            is_held = is_held or slot.busy
        return is_held

    def _end_hold(self) -> None:
        """Wait for no answer any longer, nor for the time after which the page would be written
        without it."""
        self._held_for = NO_SLOTS
        assert self._patience is not None
        self._patience.cancel()
        self._patience = None

    def _write(self) -> None:
        """Words first, then the view: a browser shows a group without nodes of the view at once,
        and the rest with its next picture."""
        outbox = self._outbox
        try:
            with outbox:
                self._write_words()
            if self.board.view.is_due:
                with outbox:
                    self.board.draw()
        finally:
            outbox.send()
        self._is_due = False

    def _write_words(self) -> None:
        intents = self.intents
        board = self.board
        session = self.session
        if intents.has_fault:
            board.write_all()
            intents.has_fault = False
        for handle in intents.changed_handles:
            board.recheck(handle)
        intents.changed_handles.clear()
        try:
            answer = self.jobs.answering.shown_answer()
            guide = session.guide
            if guide.stop is not None and answer.shown_allocation is not None and not answer.busy:
                guide.take(answer.shown_allocation)
            self.scenery.follow_guide()
            pair = pair_facts(session, self.jobs)
            swimmer = self.jobs.visible_swimmer
            scale = self.scenery.fit(
                session.state.target, answer.shown_allocation, swimmer, pair.pair_allocations
            )
            robot = self.scenery.robot
            facts = facts_of(
                session, self.jobs, answer, swimmer, robot.dragged, robot.pulled, scale, pair
            )
            facts |= self.page.following.facts._asdict()
        except Exception as error:
            board.fail(error)
        else:
            board.refresh(facts)

    def close(self) -> None:
        """The browser has gone."""
        self._task.cancel()
        if self._patience is not None:
            self._patience.cancel()
        self.jobs.stop()
        self.deferred.forget()
        self.page.following.close()
