"""One browser's page: turns intents into changes of the session, and answers into what the page shows.

Everything here runs on viser's event loop; only the solver's work is handed to the worker's thread.
"""

import asyncio
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import imageio.v3 as iio
import numpy as np
import viser
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.errors import FinlabError
from webapp.analyst import Analyst, Question
from webapp.commands import add_commands
from webapp.comparison import Comparison
from webapp.density import Densities
from webapp.files import file_stem, graph_bytes
from webapp.improving import Improver
from webapp.modes import Mode, distinct_modes
from webapp.panels.compare import ComparePanel
from webapp.panels.display import DisplayPanel
from webapp.panels.header import Header
from webapp.panels.host import Panel
from webapp.panels.layout import LayoutPanel
from webapp.panels.limits import LimitsPanel
from webapp.panels.modes import ModesPanel
from webapp.panels.take_home import TakeHomePanel
from webapp.panels.wrench import WrenchPanel
from webapp.recording import recorded_html
from webapp.refinement import STEPS
from webapp.scene.robot_scene import RobotScene
from webapp.session import Session
from webapp.solver import Solver
from webapp.theme import BRAND, GREEN, VERMILLION
from webapp.workers import Workers

PICTURE_SIZE = (1080, 1620)
"""Height and width of an exported picture [px]."""
FRAME_S = 0.9
"""How long each step of a refinement is shown [s]."""
PANEL_WIDTH = 410
"""Width of the panel beside the view [px]."""


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
        self._solver = solver
        self._worker = workers.answers
        self._loop = loop
        self._closed = False
        self._asked = -1
        self._best: Allocation | None = None
        self._best_revision = -1
        self._modes: tuple[Mode, ...] = ()
        self._frames: tuple[Allocation, ...] = ()
        self.densities: Densities | None = None
        self.analyst = Analyst(workers.cards, loop, self._post, self._refresh)
        self.improver = Improver(workers.searches, self._post, self._refresh)
        self.comparison = Comparison(solver, workers.answers, self._post, self._refresh)
        self._error: str | None = None
        self._error_revision = -1
        self._shown: tuple[Allocation, int, Allocation] | None = None
        self._dark: bool | None = None
        self._panels: list[Panel] = []
        self._build()
        self._apply_theme()
        self._refresh()
        self._ask()

    def _build(self) -> None:
        gui = self.client.gui
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_WIDTH)
        gui.set_panel_label("finlab")
        self.scene = RobotScene(
            self.client,
            self.session,
            lambda name: self.do(partial(self.session.select, name)),
            self._drag,
            self._drag_wrench,
        )
        self._panels.append(Header(gui, self))
        tabs = gui.add_tab_group()
        with tabs.add_tab("Wrench"):
            self._panels.append(WrenchPanel(gui, self))
        with tabs.add_tab("Layout"):
            self._panels.append(LayoutPanel(gui, self))
        with tabs.add_tab("Modes"):
            self._panels.append(ModesPanel(gui, self))
        with tabs.add_tab("Limits"):
            self._panels.append(LimitsPanel(gui, self))
        with tabs.add_tab("Compare"):
            self._panels.append(ComparePanel(gui, self))
        with tabs.add_tab("View"):
            self._panels.append(DisplayPanel(gui, self))
        with tabs.add_tab("Files"):
            self._panels.append(TakeHomePanel(gui, self))
        add_commands(gui, self)

    # What panels and scene may ask for.

    @property
    def best(self) -> Allocation | None:
        """The newest answer."""
        return self._best

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The newest answer's distinct modes."""
        return self._modes

    @property
    def shown(self) -> Allocation | None:
        """The newest answer with the chosen mode's command, or the step of the refinement that is played."""
        if self._frames:
            return self._frames[0]
        best, mode = self._best, self.session.mode
        if best is None or best.candidates is None or not 0 < mode < len(self._modes):
            return best
        index = self._modes[mode].index
        if self._shown is None or self._shown[0] is not best or self._shown[1] != index:
            other = replace(best, command=best.candidates.command[index], wrench_surrogate=None)
            self._shown = (best, index, other)
        return self._shown[2]

    @property
    def frame(self) -> int | None:
        """Which step of the refinement is on the robot, None while none is played."""
        return STEPS + 2 - len(self._frames) if self._frames else None

    def play_refinement(self) -> None:
        """Show how the refinement makes a raw candidate exact, step by step."""
        best, state, revision = self._best, self.session.state, self.session.revision
        if best is None or self.busy:
            raise FinlabError("there is no answer yet; wait for one")

        def job() -> None:
            try:
                frames = self._solver.refinement(state, best)
            except FinlabError as error:
                self._post(partial(self.notify, "Not possible", str(error)))
            else:
                for frame in frames:
                    _ = frame.wrench
                self._post(partial(self._play, revision, frames))

        self._worker.submit((id(self), "refinement"), job)

    def _play(self, revision: int, frames: tuple[Allocation, ...]) -> None:
        """Show the first frame, and the rest of them after a while; a change of the state ends it."""
        self._frames = frames if revision == self.session.revision else ()
        self._refresh()
        if self._frames:
            self._loop.call_later(FRAME_S, self._next_frame, revision, frames)

    def _next_frame(self, revision: int, frames: tuple[Allocation, ...]) -> None:
        if not self._closed and self._frames is frames:
            self._play(revision, frames[1:])

    @property
    def busy(self) -> bool:
        """True while the newest answer is older than the state."""
        return max(self._best_revision, self._error_revision) != self.session.revision

    @property
    def error(self) -> str | None:
        """Why the present state has no answer."""
        return self._error if self._error_revision == self.session.revision else None

    @property
    def newtons(self) -> float:
        """Force [N] that an arrow of 0.1 m stands for."""
        return self.scene.newtons

    @property
    def _overlaid(self) -> Allocation | None:
        """The compared answer whose forces are shown, unless the question has changed since."""
        answer = self.comparison.answers.get(self.session.overlay or "")
        fits = self.comparison.state == self.session.state
        return answer if fits and isinstance(answer, Allocation) else None

    def compare(self) -> None:
        """Ask the other methods about the present state."""
        self.comparison.start(self.session.state)

    def do(self, act: Callable[[], object]) -> None:
        """Carry out an intent; a refusal becomes a note, and the page goes back to what the session holds."""
        try:
            act()
        except FinlabError as error:
            self.notify("Not possible", str(error))
        self._apply_theme()
        self._refresh()
        self._ask()

    def notify(self, title: str, body: str, *, good: bool = False) -> None:
        """Show a note to the user."""
        self.client.add_notification(title, body, auto_close_seconds=8.0, color=GREEN if good else VERMILLION)

    def look_from(self, view: str) -> None:
        """Move the camera."""
        self.scene.look_from(view)

    def export_graph(self) -> None:
        """Make the layout graph file and send it."""
        state = self.session.state
        self._export(
            ".graph.json", lambda: graph_bytes(state.layout, state.failed, self._solver.allocator(state))
        )

    def export_html(self) -> None:
        """Make a standalone page of the 3D view and send it."""
        shown, twin = self.shown, self.session.twin()
        if shown is None:
            raise FinlabError("there is no answer yet; wait for one")
        self._export(".html", lambda: recorded_html(twin, shown))

    def _export(self, suffix: str, make: Callable[[], bytes]) -> None:
        """Have the worker make a file, and send it."""
        name = f"{file_stem(self.session.state.layout.name)}{suffix}"

        def job() -> None:
            try:
                content = make()
            except FinlabError as error:
                self._post(partial(self.notify, "Not exported", str(error)))
            else:
                self._post(partial(self.client.send_file_download, name, content, save_immediately=True))

        self._worker.submit((suffix, id(self)), job)

    def export_picture(self) -> None:
        """Make a picture of the 3D view and send it; the page has to answer, so not on the event loop."""
        name = f"{file_stem(self.session.state.layout.name)}.png"
        threading.Thread(target=self._send_picture, args=(name,), daemon=True).start()

    def _send_picture(self, name: str) -> None:
        try:
            picture = self.client.get_render(*PICTURE_SIZE, transport_format="png", timeout=30.0)
        except (RuntimeError, TimeoutError) as error:
            self._post(partial(self.notify, "No picture", str(error)))
            return
        content = iio.imwrite("<bytes>", picture, extension=".png")
        self._post(partial(self.client.send_file_download, name, content, save_immediately=True))

    # From the session to the page.

    def _refresh(self) -> None:
        with self.client.atomic():
            found = self.improver.found
            offered = found.layout if found is not None and found.improved else None
            # First: it settles the scale that the legend tells.
            self.scene.refresh(self.shown, self._overlaid, self.analyst.findings, offered)
            for panel in self._panels:
                panel.refresh()

    def _apply_theme(self) -> None:
        if self.session.display.dark != self._dark:
            self._dark = self.session.display.dark
            self.client.gui.configure_theme(
                dark_mode=self._dark, show_logo=False, show_share_button=False, brand_color=BRAND
            )

    def _drag(self, name: str, phase: str, position: tuple[float, float, float], angle: float) -> None:
        if phase == "start":
            self.session.history.end_merge()
        elif phase == "end":
            self.do(partial(self.session.end_drag, name, position, angle))
        else:
            self.do(partial(self.session.drag_fin, name, position, angle))

    def _drag_wrench(self, first: int, phase: str, vector: NDArray[np.float64]) -> None:
        if phase == "start":
            self.session.history.end_merge()
        else:
            self.do(partial(self.session.drag_target, first, vector.tolist(), phase == "end"))

    # From the session to the solver and back.

    def _ask(self) -> None:
        """Have the workers answer the present state, unless they were asked already."""
        session = self.session
        display, state = session.display, session.state
        self.analyst.ask(Question(state.layout, state.failed, session.saved, display.drawn, display.alone))
        if self._asked == self.session.revision:
            return
        self._asked = self.session.revision
        state, revision = self.session.state, self.session.revision

        def job() -> None:
            try:
                allocation = self._solver.solve(state)
                densities = self._solver.densities(state)
                # What is computed when first asked for belongs to this thread too.
                _ = allocation.wrench, allocation.energy, allocation.candidates, allocation.samples
            except FinlabError as error:
                self._post(partial(self._take_error, revision, str(error)))
            except Exception as error:  # a fault of a method must not take the page with it
                self._post(partial(self._take_error, revision, f"{state.method} failed: {error}"))
                raise
            else:
                self._post(partial(self._take, revision, allocation, densities))

        self._worker.submit(id(self), job)

    def _post(self, act: Callable[[], object]) -> None:
        """Run `act` on the event loop, unless the browser has gone."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(lambda: None if self._closed else act())

    def _take(self, revision: int, allocation: Allocation, densities: Densities | None) -> None:
        if revision < self._best_revision:
            return
        self._frames = ()
        self._best, self._best_revision = allocation, revision
        self.densities = densities
        self._modes = distinct_modes(allocation.candidates)
        self._error = None
        self._refresh()

    def _take_error(self, revision: int, text: str) -> None:
        if text != self._error:
            self.notify("No answer", text)
        self._error, self._error_revision = text, revision
        self._refresh()

    def close(self) -> None:
        """The browser has gone."""
        self._closed = True
        self.comparison.cancel()
        self.analyst.close()
        self.improver.close()
        self._worker.forget(id(self))
