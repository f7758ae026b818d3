"""Words in the app's own markup that can be edited where they stand, and pressed.

`edit` and `press` give the attributes of such an element; who hears of it is told by `Editables.on`. The box
in which one types is made by the other half, `editables.js`.
"""

import json
from collections.abc import Callable
from functools import partial
from html import escape
from importlib.resources import files
from typing import Any

import viser

from finlab.errors import FinlabError
from webapp.markup.picking import marker
from webapp.viser_internals import run_script, uuid_of

SCRIPT = files("webapp").joinpath("editables.js").read_text("utf-8")
"""What runs in the page."""
CHANNEL = "fl-edited"
MAX_MESSAGE = 2_000_000
"""Longest message of the page that is read."""

Act = Callable[[str, str], object]
"""Carries out what was meant with a key and a text, or raises a `FinlabError`."""
Attempt = Callable[[Callable[[], object]], FinlabError | None]
"""Carries out an intent, and gives back why it was refused."""


def edit(kind: str, key: str, value: str, label: str, rows: int = 1, at_once: bool = False) -> str:
    """Attributes of an element whose text can be edited.

    Args:
        kind: what it is, heard by `Editables.on(kind, ...)`.
        key: whose it is.
        value: what stands in the box at first.
        label: what a screen reader says.
        rows: lines of the box; more than one take line ends, too.
        at_once: whether one click opens the box, else two.
    """
    return (
        f"data-edit='{escape(kind)}' data-key='{escape(key)}' data-value='{escape(value)}' "
        f"data-rows='{rows}' data-open='{'click' if at_once else 'double'}' tabindex='0' role='button' "
        f"aria-label='{escape(label)}'"
    )


def press(kind: str, key: str) -> str:
    """Attributes of an element that can be pressed; its text is "", "shift" or "ctrl", what was held."""
    return f"data-press='{escape(kind)}' data-key='{escape(key)}'"


class Editables:
    """The channel of one page."""

    def __init__(self, gui: viser.GuiApi, attempt: Attempt) -> None:
        """Open the channel, a hidden box of text; `attempt` carries out what comes by it."""
        self._gui, self._attempt = gui, attempt
        self._acts: dict[str, Act] = {}
        self._last = 0
        gui.add_html(f"<style>div:has(>.{CHANNEL}) + div {{ display: none; }}</style>{marker(CHANNEL)}")
        self._box = gui.add_text(CHANNEL, "")

        @self._box.on_update
        async def _told(event: Any) -> None:
            if event.client is not None:
                self._hear(str(event.target.value))

    def on(self, kind: str, act: Act) -> None:
        """Who hears of elements of a kind."""
        self._acts[kind] = act

    def start(self) -> None:
        """Let the page's half begin."""
        run_script(self._gui, f"{SCRIPT}\nfinlabEditables.start({json.dumps(uuid_of(self._box))});")

    def _hear(self, message: str) -> None:
        """What the page has told and got no answer to yet, oldest first; it may send anything."""
        try:
            words = json.loads(message) if len(message) <= MAX_MESSAGE else []
        except (ValueError, RecursionError):
            return
        answers: list[tuple[int, str | None]] = []
        for word in words if isinstance(words, list) else []:
            if not (isinstance(word, list) and [type(part) for part in word] == [int, str, str, str]):
                continue
            number, kind, key, text = word
            if number <= self._last or kind not in self._acts:
                continue
            self._last = number
            refusal = self._attempt(partial(self._acts[kind], key, text))
            answers.append((number, None if refusal is None else str(refusal)))
        if answers:
            run_script(self._gui, f"finlabEditables.answer({json.dumps(answers)});")
