"""One browser's page: turns intents into changes of the session, and answers into what the page shows.

Everything here runs on viser's event loop; what takes time is handed to the workers' threads.
"""

import asyncio
import json
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Protocol, TypeVar

import viser

from finlab.allocation.allocation import Allocation
from finlab.bundle_files import LARGEST_BUNDLE
from finlab.errors import FinlabError
from webapp.handles import Changes, on_user_change, put
from webapp.presses import Presses
from webapp.scene.scenery import Scenery
from webapp.session import Session
from webapp.session.state import State
from webapp.tasks.analyst import REST_S, Question, find, find_ranges
from webapp.tasks.answering import Answering
from webapp.tasks.background import EventLoop, Newest, Workers
from webapp.tasks.comparison import Comparison
from webapp.tasks.context import Context
from webapp.tasks.designs import Designs
from webapp.tasks.exports import Exports
from webapp.tasks.fitting import Fitting
from webapp.tasks.improving import Improver
from webapp.tasks.opening import Opening
from webapp.tasks.reading import Reading
from webapp.tasks.solver import Solver
from webapp.tasks.swimming import Swimming
from webapp.theme import VERMILLION
from webapp.uploads import Uploads
from webapp.viser_internals import run_script, uuid_of

CARD_REST_S = 0.35
"""How long a layout may not change before its card is worked out [s]: that takes a second."""
PATIENCE_S = 0.025
"""How long a change waits for its answer before the page is written without it [s]."""

MAX_UPLOAD = LARGEST_BUNDLE
"""Largest file that a browser may send [bytes]; each kind of file has a limit of its own below it."""

Input = TypeVar("Input")


class Panel(Protocol):
    """A group of widgets."""

    def refresh(self) -> None:
        """Write the session and the answer into the widgets."""


class Page(ABC):
    """The scene of one client around its session, and what the panels beside it may ask for."""

    def __init__(
        self,
        client: viser.ClientHandle,
        session: Session,
        solver: Solver,
        workers: Workers,
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        """Build the page and ask for a first answer; `loop` is viser's, on `workers` all is computed."""
        self.client = client
        self.session = session
        self._loop = page = EventLoop(loop, self.fault)
        self._robot = _robot(session)
        self._faults: set[str] = set()
        self._soon: asyncio.TimerHandle | None = None
        self._note: viser.NotificationHandle | None = None
        changed = self._refresh
        self.reading = Reading(workers.readers, page, self.do)
        context = Context(client, session, solver, workers, page, self.reading, self.do, changed, self.notify)
        self.answering = Answering(context)
        self.ranging = Newest(page, workers.marks, find_ranges, changed, REST_S)
        self.analyst = Newest(page, workers.cards, find, changed, CARD_REST_S)
        self.improver = Improver(context)
        self.fitting = Fitting(context)
        self.comparison = Comparison(context)
        self.swimming = Swimming(context, self._swam)
        self.exports = Exports(context)
        self.scenery = Scenery(context, self.swimming)
        self.bound: list[Callable[[], None]] = []
        """Each writes what the session holds into a widget; the panel that is being built takes them."""
        self.presses = Presses(client.gui, self.do)
        self.designs = Designs(context, self.exports, self.presses)
        self.opening = Opening(client.gui, self.presses)
        self._uploads = Uploads(client.gui, MAX_UPLOAD, partial(self.notify, "Not possible"))
        self._panels: list[Panel] = []
        self._panels, self._swim_panels = self._build()
        self.presses.start()
        self._refresh()
        self._ask()

    @abstractmethod
    def _build(self) -> tuple[list[Panel], list[Panel]]:
        """Build everything in the panel beside the view: all panels, and of these those that show a swim."""

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
        error = self.attempt(act)
        if error is not None:
            self.notify("Not possible", str(error))

    def attempt(self, act: Callable[[], object]) -> FinlabError | None:
        """Carry out an intent, and give back why it was refused; whoever asks says it where it belongs."""
        self._faults.clear()
        refusal, before = None, self.session.revision
        try:
            act()
        except FinlabError as error:
            refusal = error
        except Exception as error:  # the page must go on, whatever we have got wrong
            self.fault(error)
        self._ask()
        if self.session.revision != before and self.busy:
            self._refresh_soon()
        else:
            self._refresh()
        return refusal

    def on_change(self, handle: Any, act: Callable[[Any], object]) -> None:
        """Carry out `act(value)` when the user changes an input."""
        on_user_change(handle, lambda value: self.do(partial(act, value)))

    def bind(self, handle: Input, act: Callable[[Any], object], value: Callable[[], object]) -> Input:
        """An input that carries out `act(value)` when the user changes it, and else shows `value()`."""
        self.on_change(handle, act)
        self.bound.append(lambda: put(handle, value=value()))
        return handle

    def bind_number(
        self, handle: Input, act: Callable[[Any], object], value: Callable[[], Any], digits: int = 4
    ) -> Input:
        """A slider, number or vector; `digits` are shown behind the point. What the page only shows rounded
        stays as exact as it is."""

        def shown() -> Any:
            now = value()
            if isinstance(now, (tuple, list)):
                return tuple(round(v, digits) + 0.0 for v in now)
            return round(float(now), digits) + 0.0

        def meant(asked: Any) -> None:
            if isinstance(asked, (tuple, list)):
                pairs = zip(asked, shown(), value(), strict=True)
                asked = tuple(exact if new == old else new for new, old, exact in pairs)
            act(asked)

        handle.precision = digits  # type: ignore[attr-defined]
        return self.bind(handle, meant, shown)

    def bind_display(self, handle: Input, key: str) -> Input:
        """An input for a field of the session's `Display`."""
        session = self.session
        return self.bind(handle, partial(session.set_display, key), lambda: getattr(session.display, key))

    def add_button(self, label: str, act: Callable[[], object], **options: Any) -> viser.GuiButtonHandle:
        """A button that carries out an intent; `options` as viser has them."""
        button = self.client.gui.add_button(label, **options)
        self._hint(button)

        @button.on_click
        async def _clicked(event: Any) -> None:
            if event.client is not None:
                self.do(act)

        return button

    def add_upload(
        self, label: str, act: Callable[[str, bytes], object], **options: Any
    ) -> viser.GuiUploadButtonHandle:
        """A button that carries out `act(name, content)` when the user has chosen a file."""
        button = self.client.gui.add_upload_button(label, **options)
        self._hint(button)
        self._uploads.on(button, lambda name, content: self.do(partial(act, name, content)))
        return button

    def _hint(self, button: Any) -> None:
        """Let the page show the hint of a button: viser takes it, and shows those of other inputs alone."""
        told = json.dumps([uuid_of(button), button.hint or ""])
        run_script(self.client.gui, f"(window.finlabHints ??= new Map()).set(...{told});")

    def add_buttons(
        self, label: str, acts: Mapping[str, Callable[[], object]], **options: Any
    ) -> viser.GuiButtonGroupHandle:
        """A group of buttons that carry out an intent each; `options` as viser has them."""
        group = self.client.gui.add_button_group(label, tuple(acts), **options)
        on_user_change(group, lambda button: self.do(acts[button]) if button in acts else None)
        return group

    def notify(self, title: str, body: str) -> None:
        """Show a note to the user, in place of the last one."""
        if self._note is not None:
            self._note.remove()
        self._note = self.client.add_notification(title, body, auto_close_seconds=8.0, color=VERMILLION)

    # From the session to the page.

    def _refresh_soon(self) -> None:
        """A quick answer comes with its question: a browser takes longer to write a page twice than once."""
        if self._soon is None:
            self._soon = self._loop.later(PATIENCE_S, self._refresh)

    def _refresh(self) -> None:
        if self._soon is not None:
            self._soon.cancel()
            self._soon = None
        with self.client.atomic():
            try:
                self._take_in()
                # Before the panels: it settles the scale in the legend.
                self.scenery.robot.editing = self.session.task == "Design"
                self.scenery.refresh(self.answering, self.improver, self.analyst.findings)
            except Exception as error:
                self.scenery.hide()
                self.fault(error)
            for panel in self._panels:
                panel.refresh()

    def _take_in(self) -> None:
        """What follows from what is on the robot now, before anything is written."""
        if self.shown is not None and not self.busy:
            self.session.take(self.shown)

    # From the session to the workers and back.

    def _ask(self) -> None:
        """Have the workers answer the present state, unless they were asked already."""
        session = self.session
        display, state = session.display, session.state
        if self._robot != _robot(session):
            # What is known of another robot must not stand under this one's name.
            self._robot = _robot(session)
            for task in (self.answering, self.analyst, self.ranging):
                task.forget()
        self.analyst.ask(Question(state.able, state.failed, session.saved, display.drawn))
        self.ranging.ask(State(state.able, state.failed, target=state.target))
        self.answering.ask()

    def _swam(self) -> None:
        """The swim has gone on: ten times a second, so only what shows it is written."""
        if self.scenery.swims != (self.swimming.swimmer is not None):
            self._refresh()
            return
        with self.client.atomic():
            self.scenery.refresh_swim()
            for panel in self._swim_panels:
                panel.refresh()

    def fault(self, error: Exception) -> None:
        """An error of our own: it is reported, and nothing that was drawn before is trusted."""
        Changes.faults += 1
        text = f"{type(error).__name__}: {error}"
        if text not in self._faults:  # once is enough, however often the page is written
            self._faults.add(text)
            traceback.print_exception(error)
            self.notify("A fault of the app", text)

    def close(self) -> None:
        """The browser has gone."""
        self._loop.close()
        self._uploads.close()
        self.swimming.stop()
        self.comparison.cancel()
        self.improver.forget()
        self.fitting.forget()
        for task in (self.answering, self.analyst, self.ranging):
            task.forget()


def _robot(session: Session) -> tuple[str, tuple[str, ...]]:
    """What identifies a robot, however its fins are moved."""
    return session.state.layout.name, session.state.layout.names
