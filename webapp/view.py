"""One browser's page: turns intents into changes of the session, and answers into what the page shows.

Everything here runs on viser's event loop; what takes time is handed to the workers' threads.
"""

import asyncio
import traceback
from collections.abc import Callable
from functools import partial

import viser

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.panels.commands import add_commands
from webapp.panels.header import Header
from webapp.panels.host import Panel
from webapp.panels.swim_tab import SwimTab
from webapp.panels.tabs import PANEL_WIDTH, build_panels
from webapp.scene.scenery import Scenery
from webapp.session import Session
from webapp.tasks.analyst import Question, find
from webapp.tasks.answering import Answering
from webapp.tasks.comparison import Comparison
from webapp.tasks.debounce import Debounced
from webapp.tasks.exports import Exports
from webapp.tasks.improving import Improver
from webapp.tasks.playback import Playback
from webapp.tasks.ranging import REST_S, Beside, find_ranges
from webapp.tasks.solver import Solver
from webapp.tasks.sweeping import Sweep
from webapp.tasks.swimming import Swimming
from webapp.tasks.workers import Workers
from webapp.theme import GREEN, VERMILLION

CARD_REST_S = 0.35
"""How long a layout may not change before its card is worked out [s]: that takes a second."""


class View:
    """Panels and scene of one client around its session."""

    def __init__(
        self,
        client: viser.ClientHandle,
        session: Session,
        solver: Solver,
        workers: Workers,
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        """Build the page and ask for a first answer.

        Args:
            client: the browser.
            session: what it shows.
            solver: answers its questions.
            workers: on whose threads everything is computed.
            loop: viser's event loop.
        """
        self.client = client
        self.session = session
        self._loop = loop
        self._closed = False
        self._panels: list[Panel] = []
        answers, post, changed = workers.answers, self._post, self._refresh
        refused = partial(self.notify, "Not possible")
        self.answering = Answering(
            session, solver, answers, loop, post, self._answered, partial(self.notify, "No answer")
        )
        self.playback = Playback(session, self.answering, solver, answers, loop, post, changed, refused)
        self.ranging = Debounced(find_ranges, REST_S, workers.marks, loop, post, changed)
        self.analyst = Debounced(find, CARD_REST_S, workers.cards, loop, post, changed)
        self.improver = Improver(workers.searches, post, changed)
        self.comparison = Comparison(solver, answers, post, changed)
        self.swimming = Swimming(solver.aside, workers.swims, post, self._swam, refused)
        self.sweep = Sweep(session, loop, self.do)
        self.exports = Exports(client, session, solver, answers, post, self.notify)
        self._build()
        self.scenery.follow_tour()
        self.scenery.apply_theme()
        self._refresh()
        self._ask()

    def _build(self) -> None:
        gui = self.client.gui
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_WIDTH)
        gui.set_panel_label("finlab")
        self.scenery = Scenery(self.client, self.session, self.swimming, self.do)
        self._panels = build_panels(gui, self)
        add_commands(gui, self)

    # What panels and scene may ask for.

    @property
    def shown(self) -> Allocation | None:
        """What is on the robot."""
        return self.answering.shown

    @property
    def busy(self) -> bool:
        """True while the newest answer is older than the state."""
        return self.answering.busy

    def do(self, act: Callable[[], object]) -> None:
        """Carry out an intent; a refusal becomes a note, and the page goes back to what the session holds."""
        try:
            act()
        except FinlabError as error:
            self.notify("Not possible", str(error))
        except Exception as error:  # the page must go on, whatever we have got wrong
            traceback.print_exc()
            self.notify("A fault of the app", f"{type(error).__name__}: {error}")
        self.scenery.follow_tour()
        self.scenery.apply_theme()
        self._refresh()
        self._ask()

    def notify(self, title: str, body: str, *, good: bool = False) -> None:
        """Show a note to the user."""
        self.client.add_notification(title, body, auto_close_seconds=8.0, color=GREEN if good else VERMILLION)

    def animate(self, elapsed: float) -> None:
        """Let time pass [s]."""
        self.scenery.animate(elapsed)

    # From the session to the page.

    def _refresh(self) -> None:
        with self.client.atomic():
            # First: it settles the scale that the legend tells.
            self.scenery.refresh(self.answering, self.comparison, self.improver, self.analyst.findings)
            for panel in self._panels:
                panel.refresh()

    # From the session to the workers and back.

    def _ask(self) -> None:
        """Have the workers answer the present state, unless they were asked already."""
        session = self.session
        display, state = session.display, session.state
        self.analyst.ask(Question(state.able, state.failed, session.reference, display.drawn, display.alone))
        self.ranging.ask(Beside(state.able, state.failed, state.target))
        self.answering.ask()

    def _swam(self) -> None:
        """The swim has gone on: ten times a second, so only what shows it is written."""
        if self.scenery.swims != bool(self.swimming.swimmers):
            self._refresh()
            return
        with self.client.atomic():
            self.scenery.refresh_swim()
            for panel in self._panels:
                if isinstance(panel, (Header, SwimTab)):
                    panel.refresh()

    def _answered(self) -> None:
        self.sweep.note(self.answering)
        self._refresh()

    def _post(self, act: Callable[[], object]) -> None:
        """Run `act` on the event loop, unless the browser has gone."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(lambda: None if self._closed else act())

    def close(self) -> None:
        """The browser has gone."""
        self._closed = True
        self.sweep.stop()
        self.swimming.stop()
        self.answering.frames = ()
        self.comparison.cancel()
        self.analyst.close()
        self.ranging.close()
        self.improver.close()
        self.answering.close()
