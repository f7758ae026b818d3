"""One browser's page, as its panels are built: widgets that show facts, and what these may ask for.

Everything here runs on viser's event loop; what takes time is handed to threads.
"""

import json
from collections.abc import Callable, Mapping
from functools import partial, wraps
from typing import Any, TypeVar

import viser

from finlab.actuators.kinds import KINDS
from finlab.allocation.allocation import Allocation
from finlab.bundle_files import MAX_BUNDLE_BYTES
from webapp.board import Board
from webapp.handles import Asking, Presses, on_user_change
from webapp.inquiry import Inquiry
from webapp.intents import Intents
from webapp.markup.words import kind_words
from webapp.number_boxes import NumberBoxes
from webapp.scene.scenery import Scenery
from webapp.tasks.context import Context
from webapp.tasks.designs import Designs, Opening
from webapp.tasks.following import Following, Lectures
from webapp.tasks.importing import Importing
from webapp.tasks.jobs import Jobs
from webapp.tasks.slot import Deferred
from webapp.viser_internals import hold_uploads, run_script, uuid_of

BEGIN = (
    "What is its first actuator? Add others in the list; it can be deleted once there is another."
)

Input = TypeVar("Input")


class Page:
    """The scene of one client around its session, and what the panels beside it may ask for."""

    def __init__(
        self, client: viser.ClientHandle, context: Context, intents: Intents, lectures: Lectures
    ) -> None:
        """A page without panels; what a user does goes to `intents`. It may follow one of
        `lectures`."""
        self.client = client
        self.gui = client.gui
        self.do = intents.do
        self.look = intents.look
        self._intents = intents
        self.notify = intents.notify
        session = self.session = context.session
        solver = self.solver = context.solver
        self.jobs = Jobs(context)
        self.following = Following(context, lectures)
        self.board = Board(intents.fault)
        self.deferred = Deferred(context.pools.brief, context.bell, intents.do)
        self.scenery = Scenery(client, session, self.jobs.swimming, self.board, intents)
        self.presses = Presses(client.gui, intents.do, context.bell, intents.look)
        self.number_boxes = NumberBoxes(
            self.presses, intents.do, lambda _: session.history.end_merge()
        )
        self.ask = Asking(client.gui, self.presses).ask
        self.designs = Designs(client, session, solver, self.deferred, intents.notify)
        self.importing = Importing(
            session, Inquiry(client.gui, self.presses), self.deferred, self.designs.take
        )
        """Asks what a file of another program leaves open."""
        self.presses.on("design-link", lambda _, text: self.designs.open_link(text))
        self.opening = Opening(self.presses)
        self.new = partial(
            self.ask,
            "New design",
            BEGIN,
            {kind_words(kind): partial(self.designs.new, kind) for kind in KINDS},
        )
        """Asks what a new design begins with."""
        hold_uploads(client.gui, MAX_BUNDLE_BYTES, partial(intents.notify, "Not possible"))

    @property
    def shown_allocation(self) -> Allocation | None:
        """What is on the robot."""
        return self.jobs.answering.shown_answer().shown_allocation

    def lock(self, why: str) -> None:
        """Let nothing be changed on this page, for a reason; let it again where that is empty."""
        self._intents.lock = why

    def undo(self) -> None:
        """Take back the last step, and say which."""
        self.notify("Undone", self.session.undo(), calm=True)

    def redo(self) -> None:
        """Bring back the step taken back last, and say which."""
        self.notify("Done again", self.session.redo(), calm=True)

    def on_change(self, handle: Any, act: Callable[[Any], object], **box: bool) -> None:
        """Carry out `act(value)` when the user changes an input; `box` as `NumberBoxes.add` has
        it."""
        self.number_boxes.add(handle, act, **box)
        on_user_change(handle, lambda value: self.do(partial(act, value), handle))

    def bind(
        self, handle: Input, act: Callable[[Any], object], value: Callable[..., object], **box: bool
    ) -> Input:
        """An input that carries out `act(value)` when the user changes it, and else shows `value`
        of the facts; `box` as `NumberBoxes.add` has it."""
        self.on_change(handle, act, **box)
        self.board.show(handle, value=value)
        return handle

    def bind_number(
        self,
        handle: Input,
        act: Callable[[Any], object],
        value: Callable[..., Any],
        digits: int = 4,
        may_be_empty: bool = False,
    ) -> Input:
        """A slider, number or vector; `digits` are shown behind the point. What the page only shows
        rounded stays as exact as it is. A box that `may_be_empty` means None then."""

        exact: Any = None

        @wraps(value)
        def rounded(*facts: Any) -> Any:
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
        return self.bind(handle, meant, rounded, may_be_empty=may_be_empty)

    def add_html(
        self, content: Callable[..., str], **made: Callable[..., object]
    ) -> viser.GuiHtmlHandle:
        """Markup, and what else of it is a function of facts."""
        handle: viser.GuiHtmlHandle = self.board.show(
            self.gui.add_html(""), content=content, **made
        )
        return handle

    def add_button(
        self, label: str, act: Callable[[], object], **options: Any
    ) -> viser.GuiButtonHandle:
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

    def _hear(
        self, button: Any, listen: Callable[..., object], act: Callable[[Any], object]
    ) -> None:
        """Carry out `act(value)` when a button is pressed, and let the page show its hint: viser
        shows those of other inputs alone."""

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
