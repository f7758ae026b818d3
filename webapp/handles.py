"""Inputs of the page, and words in its own markup that can be pressed (their other half is
`presses.js`)."""

import json
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import Any

import numpy as np
import viser
from markupsafe import escape

from finlab.errors import FinlabError
from webapp.markup.words import html, marker
from webapp.tasks.slot import Bell
from webapp.viser_internals import assign, keep_private, run_file, run_script, uuid_of


def add_html(gui: viser.GuiApi, content: str) -> viser.GuiHtmlHandle:
    """Markup in the page; what is not marked as such is text."""
    return gui.add_html(str(escape(content)))


def set_properties(handle: Any, **values: Any) -> None:
    """Set those properties of a handle that differ, so that an unchanged page gets no message;
    content not marked as markup is text. An array must not be changed afterwards."""
    changed: dict[str, Any] = {}
    for key, value in values.items():
        if key == "content":
            value = str(escape(value))
        old = getattr(handle, key)
        is_old_array = isinstance(old, np.ndarray)
        is_new_array = isinstance(value, np.ndarray)
        if is_old_array and is_new_array:  # quicker than numpy's own comparison
            is_same = old.shape == value.shape and bool((old == value).all())
        elif is_old_array or is_new_array:
            is_same = np.array_equal(old, value)
        else:
            is_same = old == value
        if not is_same:
            changed[key] = value
    if changed:
        assign(handle, changed)


def on_user_change(handle: Any, act: Callable[[Any], None]) -> None:
    """Call `act(value)` on the loop when the user, not we, changes an input; a value of another
    kind than the input's own is not from our page: it goes back to what it held last."""
    honest = handle.value
    buttons = isinstance(handle, viser.GuiButtonGroupHandle)
    keep_private(handle)

    async def changed(event: Any) -> None:
        nonlocal honest
        if event.client is None:
            return
        value = event.target.value
        if _alike(honest, value):
            honest = value
            act(value)
        elif not buttons:
            handle.value = honest

    # A group of buttons is an input whose value is the button that was pressed last.
    listen = handle.on_click if buttons else handle.on_update
    listen(changed)


def _alike(known: Any, value: Any) -> bool:
    """Whether two values are of the same kind: texts, switches, numbers, or as many numbers."""
    if isinstance(known, (tuple, list)):
        listed = isinstance(value, (tuple, list)) and len(value) == len(known)
        return listed and all(_alike(a, b) for a, b in zip(known, value, strict=True))
    if isinstance(known, bool) or isinstance(value, bool):
        return isinstance(known, bool) and isinstance(value, bool)
    kind = (int, float) if isinstance(known, (int, float)) else str
    return isinstance(value, kind)


MAX_MESSAGE = 100_000
"""Longest message of the page that is read; a link with a design is the longest honest one."""
HEARD_S = 0.1
"""When a page is told that it was heard [s]: a script would hold up the answer until the next
picture."""
KINDS = [int, str, str, str]
"""Number, kind, key and text of a word."""

Do = Callable[[Callable[[], object]], None]
"""Carries out an intent."""
Act = Callable[[str, str], object]
"""Carries out what was meant with a key and a text, or raises a `FinlabError`."""


@lru_cache(maxsize=512)
def press(kind: str, key: str) -> str:
    """Attributes of an element that can be pressed; its text is "", "shift" or "ctrl", what was
    held."""
    return html("data-press='{}' data-key='{}'", kind, key)


def button(word: str, kind: str, key: str = "", attributes: str = "") -> str:
    """A button in markup that can be pressed; `attributes` are markup."""
    return html("<button {} {}>{}</button>", attributes, press(kind, key), word)


def placed(key: str, count: int) -> int:
    """The place that a page names, of `count`. FinlabError: there is no such place."""
    if not key.isdecimal() or len(key) > 6 or int(key) >= count:
        raise FinlabError("that one is gone")
    return int(key)


class Presses:
    """All of one page."""

    def __init__(self, gui: viser.GuiApi, do: Do, bell: Bell, look: Do | None = None) -> None:
        """Listen to the page.

        Args:
            gui: of the page.
            do: carries out what was meant.
            bell: wakes the page.
            look: the same for what may be done on a page that is locked; `do` where it is None.
        """
        self._gui = gui
        self._do = do
        self._look = look or do
        self._bell = bell
        self._acts: dict[str, tuple[Act, Do]] = {}
        self._last = 0
        hidden = "<style>[data-fl~=presses] + div {{ display: none; }}</style>{}"
        add_html(gui, html(hidden, marker("fl-presses")))
        self._box = gui.add_text("presses", "")
        on_user_change(self._box, self.read)

    def on(self, kind: str, act: Act, looks: bool = False) -> None:
        """Who hears of a kind; one that only `looks` is heard on a page that is locked as well."""
        self._acts[kind] = act, self._look if looks else self._do

    def start(self) -> None:
        """Let the page's half begin."""
        run_file(self._gui, "presses.js", f"finlabPresses.start({json.dumps(uuid_of(self._box))});")

    def read(self, message: str) -> None:
        """Words that were not heard yet, oldest first; the page may send anything."""
        if not 0 < len(message) <= MAX_MESSAGE:
            return
        try:
            words = json.loads(message)
        except (ValueError, RecursionError):
            return
        for word in words if isinstance(words, list) else []:
            if not (isinstance(word, list) and [type(part) for part in word] == KINDS):
                continue
            number, kind, key, text = word
            if number > self._last:
                self._last = number
                if kind in self._acts:
                    act, do = self._acts[kind]
                    do(partial(act, key, text))
        self._bell.ring_later(HEARD_S, self)

    def attend(self) -> bool:
        """Tell the page what was heard."""
        run_script(self._gui, f"finlabPresses.heard({self._last});")
        return False


class Asking:
    """The question of one page to its user, on a card over the view that `cards.js` draws; a newer
    one takes its place."""

    def __init__(self, gui: viser.GuiApi, presses: Presses) -> None:
        self._gui = gui
        self._acts: list[Callable[[], object]] = []
        presses.on("answer", self._answer)
        run_file(gui, "cards.js")

    def ask(self, title: str, text: str, answers: Mapping[str, Callable[[], object]]) -> None:
        """Show a title, a sentence, and a button for each answer that does something; another one
        leaves all as it is."""
        self._acts = list(answers.values())
        card = json.dumps([title, text, [*answers, "Cancel"]])
        run_script(self._gui, f"finlabCards.ask(...{card});")

    def _answer(self, key: str, _text: str) -> None:
        acts = self._acts
        self._acts = []
        if key.isdecimal() and int(key) < len(acts):
            acts[int(key)]()
