"""One browser's page: turns intents into changes of the session, and what there is to show into widgets.

Everything here runs on viser's event loop; what takes time is handed to the workers' threads.
"""

import asyncio
import json
import traceback
from collections.abc import Callable, Mapping
from functools import partial, wraps
from typing import Any, TypeVar

import viser

from finlab.actuators.kinds import KINDS
from finlab.allocation.allocation import Allocation
from finlab.bundle_files import LARGEST_BUNDLE
from finlab.errors import FinlabError
from webapp.board import Board, facts_of
from webapp.handles import Asking, Presses, on_user_change
from webapp.markup.words import in_app
from webapp.scene.scenery import Scenery
from webapp.session import Session
from webapp.tasks.background import Context, EventLoop, Workers
from webapp.tasks.designs import Designs, Opening
from webapp.tasks.jobs import Jobs
from webapp.tasks.solver import Solver
from webapp.theme import BLUE, VERMILLION
from webapp.viser_internals import hold_uploads, run_script, uuid_of

BEGIN = "What is its first actuator? Add others in the list; it can be deleted once there is another."
PATIENCE_S = 0.025
"""How long a change waits for its answer before the page is written without it [s]."""
DRAWN_S = 0.004
"""How long after its words the view is drawn [s]: a browser shows what comes without nodes of the view at
once, and the rest with its next picture."""

Input = TypeVar("Input")


class Page:
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
        self.client, self.gui, self.session, self.solver = client, client.gui, session, solver
        self._loop = page = EventLoop(loop, self.fault)
        self._faults: set[str] = set()
        self._soon: asyncio.TimerHandle | None = None
        self._note: viser.NotificationHandle | None = None
        context = Context(client, session, solver, workers, page, self.do, self._refresh, self.notify)
        self.context, self.jobs = context, Jobs(context)
        self.board = Board(self.fault)
        self.scenery = Scenery(context, self.jobs.swimming, self.board, self.fault)
        self.presses = Presses(client.gui, self.do, page.later)
        self.ask = Asking(client.gui, self.presses).ask
        self.designs = Designs(context)
        self.presses.on("design-link", lambda _, text: self.designs.open_link(text))
        self.opening = Opening(self.presses)
        self.new = partial(
            self.ask, "New design", BEGIN, {k.capitalize(): partial(self.designs.new, k) for k in KINDS}
        )
        """Asks what a new design begins with."""
        hold_uploads(client.gui, LARGEST_BUNDLE, partial(self.notify, "Not possible"))
        self._build()
        self.presses.start()
        self._refresh()
        self.jobs.ask()

    def _build(self) -> None:
        """Build everything in the panel beside the view."""
        raise NotImplementedError

    # What panels and scene may ask for.

    @property
    def shown(self) -> Allocation | None:
        """What is on the robot."""
        return self.jobs.answering.seen().shown

    @property
    def busy(self) -> bool:
        """True while the newest answer is older than the state."""
        return self.jobs.answering.busy

    def do(self, act: Callable[[], object], handle: Any = None) -> None:
        """Carry out an intent, by the input `handle` that the user has changed, if any; a refusal becomes a
        note, and the page goes back to what the session holds."""
        self._faults.clear()
        before = self.session.revision
        try:
            act()
        except FinlabError as error:
            self.notify("Not possible", str(error))
        except Exception as error:  # the page must go on, whatever we have got wrong
            self.fault(error)
        self.board.doubt(handle)
        self.jobs.ask()
        if self.session.revision == before or not self.busy:
            self._refresh()
        elif self._soon is None:
            # A quick answer comes with its question: a browser takes longer to write a page twice than once.
            self._soon = self._loop.later(PATIENCE_S, self._refresh)

    def on_change(self, handle: Any, act: Callable[[Any], object]) -> None:
        """Carry out `act(value)` when the user changes an input."""
        on_user_change(handle, lambda value: self.do(partial(act, value), handle))

    def bind(self, handle: Input, act: Callable[[Any], object], value: Callable[..., object]) -> Input:
        """An input that carries out `act(value)` when the user changes it, and else shows `value` of the
        facts."""
        self.on_change(handle, act)
        self.board.show(handle, value=value)
        return handle

    def bind_number(
        self, handle: Input, act: Callable[[Any], object], value: Callable[..., Any], digits: int = 4
    ) -> Input:
        """A slider, number or vector; `digits` are shown behind the point. What the page only shows rounded
        stays as exact as it is."""

        exact: Any = None

        @wraps(value)
        def shown(*facts: Any) -> Any:
            nonlocal exact
            exact = value(*facts)
            if isinstance(exact, (tuple, list)):
                return tuple([round(v, digits) + 0.0 for v in exact])
            return round(float(exact), digits) + 0.0

        def meant(typed: Any) -> None:
            if isinstance(exact, (tuple, list)):
                both = zip(typed, exact, strict=True)
                typed = tuple(old if new == round(old, digits) else new for new, old in both)
            act(typed)

        handle.precision = digits  # type: ignore[attr-defined]
        return self.bind(handle, meant, shown)

    def add_html(self, content: Callable[..., str], **made: Callable[..., object]) -> viser.GuiHtmlHandle:
        """Markup, and what else of it is a function of facts."""
        handle: viser.GuiHtmlHandle = self.board.show(self.gui.add_html(""), content=content, **made)
        return handle

    def add_button(self, label: str, act: Callable[[], object], **options: Any) -> viser.GuiButtonHandle:
        """A button that carries out an intent; `options` as viser has them."""
        button = self.gui.add_button(label, **options)
        self._hear(button, button.on_click, lambda _: act())
        return button

    def add_upload(
        self, label: str, act: Callable[[str, bytes], object], **options: Any
    ) -> viser.GuiUploadButtonHandle:
        """A button that carries out `act(name, content)` when the user has chosen a file."""
        button = self.gui.add_upload_button(label, **options)
        self._hear(button, button.on_upload, lambda file: act(file.name[-80:], file.content))
        return button

    def _hear(self, button: Any, listen: Callable[..., object], act: Callable[[Any], object]) -> None:
        """Carry out `act(value)` when a button is pressed, and let the page show its hint: viser shows those
        of other inputs alone."""

        async def pressed(event: Any) -> None:
            if event.client is not None:
                self.do(partial(act, event.target.value))

        listen(pressed)
        hint = json.dumps([uuid_of(button), button.hint or ""])
        run_script(self.gui, f"(window.finlabHints ??= new Map()).set(...{hint});")

    def add_buttons(
        self, label: str, acts: Mapping[str, Callable[[], object]], **options: Any
    ) -> viser.GuiButtonGroupHandle:
        """A group of buttons that carry out an intent each; `options` as viser has them."""
        group = self.gui.add_button_group(label, tuple(acts), **options)
        on_user_change(group, lambda button: self.do(acts[button]) if button in acts else None)
        return group

    def notify(self, title: str, body: str, calm: bool = False) -> None:
        """Show a note to the user, in place of the last one; a calm one is no warning."""
        if self._note is not None:
            self._note.remove()
        color = BLUE if calm else VERMILLION
        self._note = self.client.add_notification(title, in_app(body), auto_close_seconds=8.0, color=color)

    # From the session to the page.

    def _refresh(self) -> None:
        if self._soon is not None:
            self._soon.cancel()
            self._soon = None
        with self.client.atomic():
            try:
                guide, seen = self.session.guide, self.jobs.answering.seen()
                if guide.stop is not None and seen.shown is not None and not seen.busy:
                    guide.take(seen.shown)
                self.scenery.follow_guide()
                scale = self.scenery.fit(self.session.state.target, seen.shown)
                facts = facts_of(self.session, self.jobs, seen, self.scenery.robot.dragged, scale)
            except Exception as error:
                self.board.fail(error)
            else:
                self.board.refresh(facts)
        self.client.flush()
        self._loop.later(DRAWN_S, self._draw)

    def _draw(self) -> None:
        with self.client.atomic():
            self.board.draw()
        self.client.flush()

    def fault(self, error: Exception) -> None:
        """An error of our own: it is reported, and nothing that was drawn before is trusted."""
        self.board.distrust()
        text = f"{type(error).__name__}: {error}"
        if text not in self._faults:  # once is enough, however often the page is written
            self._faults.add(text)
            traceback.print_exception(error)
            self.notify("A fault of the app", text)

    def close(self) -> None:
        """The browser has gone."""
        self._loop.close()
        self.jobs.stop()
