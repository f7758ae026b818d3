"""Boxes for numbers: what is typed comes here as text, is read with units and arithmetic, and is taken whole
or refused in place. The other half, which keeps a box to the user who types, is `number_fields.js`."""

import re
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from typing import Any, NamedTuple, TypeVar

import viser

from finlab.errors import FinlabError
from webapp.handles import on_user_change, put
from webapp.mailbox import Mailbox
from webapp.markup.html import html
from webapp.session.quantities import read_number
from webapp.viser_internals import uuid_of

SCRIPT = files("webapp").joinpath("number_fields.js").read_text("utf-8")
"""What runs in the page."""
MAX_MESSAGE = 10_000
"""Longest message of the page that is read."""
HOW = ("enter", "pause", "escape", "empty", "step")
"""What a user may do with a box: be done with a text, rest, give up, leave nothing, or go up and down."""

Values = tuple[float, ...]
Answer = TypeVar("Answer")


class Note(NamedTuple):
    """What stands below a field."""

    text: str
    """A sentence."""
    refused: bool
    """Whether the text in the box was not taken."""
    about: object
    """What the page held then: the note goes when that changes."""


class NumberField:
    """One slider, number or vector. Each of its boxes commits by itself."""

    def __init__(
        self,
        handle: Any,
        note: viser.GuiHtmlHandle,
        act: Callable[[Any], FinlabError | None],
        value: Callable[[], Any],
        subject: Callable[[], object],
        digits: int,
    ) -> None:
        """Take over a handle.

        Args:
            handle: of viser; its label ends with the unit, as in `Position [m]`.
            note: what stands below it.
            act: carries out the intent with a number, or with a tuple of them, and gives back why it was
                refused.
            value: what is in force, likewise.
            subject: whose value it is; a note about another one's is taken away.
            digits: how many are shown behind the point.
        """
        self.handle, self._note = handle, note
        self._act, self._value, self._subject = act, value, subject
        found = re.search(r"\[(.+)\]$", handle.label)
        self._unit = found[1] if found else ""
        self._digits = handle.precision = digits
        self._notes: dict[int, Note] = {}
        self._before: dict[int, float] = {}
        """What was in force when the texts that rest in boxes were begun."""

    @property
    def values(self) -> Values:
        """What is in force, a number for each box."""
        value = self._value()
        return tuple(float(v) for v in value) if isinstance(value, (tuple, list)) else (float(value),)

    def hear(self, place: int, how: str, text: str) -> tuple[bool, str] | None:
        """Do what a user means with a box: whether it was refused, and what is to stand there.

        None where there is no such box, or nothing of the kind can be done with one.
        """
        if not 0 <= place < len(self.values) or how not in HOW:
            return None
        self._notes.pop(place, None)
        before = self.values[place]
        if how == "pause":
            refused = self._read(place, text, half_typed=True)
            if not refused:
                self._before.setdefault(place, before)
        else:
            before = self._before.pop(place, before)
            if how == "enter":
                refused = self._read(place, text)
            elif how == "step":
                way = -1.0 if text.startswith("-") else 1.0
                refused = self._take(place, round(self.values[place] + way * self.handle.step, self._digits))
            else:
                refused = how == "escape" and text != "" and self._take(place, before)
        self.refresh()
        return refused, self._text(self.values[place])

    def _read(self, place: int, text: str, half_typed: bool = False) -> bool:
        """Take a text; whether it was refused. Half of one is no reason to complain."""
        if half_typed and text.endswith((".", ",")):
            return False
        try:
            asked = read_number(text, self._unit)
        except FinlabError as error:
            if not half_typed:
                self._tell(place, str(error), refused=True)
            return not half_typed
        return self._take(place, asked)

    def _take(self, place: int, asked: float) -> bool:
        """Bring a number into force; whether it was refused. What a grid or a turn changed is shown."""
        values = list(self.values)
        if asked == values[place]:
            return False
        values[place] = asked
        error = self._act(tuple(values) if isinstance(self._value(), (tuple, list)) else asked)
        got = self.values[place]
        if error is not None:
            self._tell(place, str(error), refused=True)
        elif abs(got - asked) > 1e-9 * max(1.0, abs(asked)):
            self._tell(place, f"{asked:.6g} became {self._text(got)}".replace("-", "−"), refused=False)
        return error is not None

    def _tell(self, place: int, text: str, refused: bool) -> None:
        self._notes[place] = Note(text, refused, self._about(place))

    def _about(self, place: int) -> object:
        return self._subject(), self.values[place]

    def _text(self, value: float) -> str:
        """A number as its box shows it."""
        text = f"{value:.{self._digits}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
        return "0" if text == "-0" else text

    def slide(self, value: Any) -> None:
        """The slider was dragged; what it is refused stands below it."""
        error = self._act(value)
        if error is not None:
            self._tell(0, str(error), refused=True)
        self.refresh()

    def refresh(self) -> bool:
        """Write what is in force, and the notes that still hold; whether one went."""
        rounded = tuple(round(v, self._digits) + 0.0 for v in self.values)
        put(self.handle, value=rounded if isinstance(self.handle.value, tuple) else rounded[0])
        stale = [place for place, note in self._notes.items() if note.about != self._about(place)]
        for place in stale:
            del self._notes[place]
        lines = [
            html("<div class='{}' role='alert'>{}</div>", "missing" if note.refused else "dim", note.text)
            for _, note in sorted(self._notes.items())
        ]
        put(self._note, content=html("<div class='fl note'>{}</div>", lines))
        put(self._note, visible=bool(lines) and self.handle.visible)
        return bool(stale)


class NumberFields:
    """All of one page."""

    def __init__(self, gui: viser.GuiApi, fault: Callable[[Exception], None]) -> None:
        """Listen to the page; `fault` gets exceptions that are our own."""
        self._fault = fault
        self._fields: dict[str, NumberField] = {}
        self.mailbox = Mailbox(gui, "finlabFields", SCRIPT, (str, int, str, str), self._hear, MAX_MESSAGE)
        """Where the page sends what was typed."""

    def add(self, field: NumberField) -> Callable[[], None]:
        """One more; what comes back writes it, and lets go of a text in the page whose refusal is past."""
        uuid = uuid_of(field.handle)
        self._fields[uuid] = field
        on_user_change(field.handle, lambda value: self._safely(partial(field.slide, value)))

        def write() -> None:
            if field.refresh():
                self.mailbox.tell("drop", uuid)

        return write

    def start(self) -> None:
        """All are there: let the page's half begin."""
        self.mailbox.start(list(self._fields))

    def _safely(self, act: Callable[[], Answer]) -> Answer | None:
        try:
            return act()
        except Exception as error:  # the page must go on
            self._fault(error)
            return None

    def _hear(self, uuid: str, place: int, how: str, text: str) -> tuple[bool, str] | None:
        if uuid not in self._fields:
            return None
        return self._safely(partial(self._fields[uuid].hear, place, how, text))
