"""Words in the app's own markup that can be edited where they stand, and pressed.

`edit` and `press` give the attributes of such an element; its handler is given to `Editables.on`. The box
in which one types is made by the other half, `editables.js`.
"""

from collections.abc import Callable
from functools import partial
from importlib.resources import files

import viser

from finlab.errors import FinlabError
from webapp.mailbox import Mailbox
from webapp.markup.html import html

SCRIPT = files("webapp").joinpath("editables.js").read_text("utf-8")
"""What runs in the page."""
MAX_MESSAGE = 600_000
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
    return html(
        "data-edit='{}' data-key='{}' data-value='{}' data-rows='{}' data-open='{}' tabindex='0' "
        "role='button' aria-label='{}'",
        kind,
        key,
        value,
        rows,
        "click" if at_once else "double",
        label,
    )


def press(kind: str, key: str) -> str:
    """Attributes of an element that can be pressed; its text is "", "shift" or "ctrl", what was held."""
    return html("data-press='{}' data-key='{}'", kind, key)


class Editables:
    """All of one page."""

    def __init__(
        self, gui: viser.GuiApi, attempt: Attempt, do: Callable[[Callable[[], object]], None]
    ) -> None:
        """Listen to the page; `attempt` carries out an edit, whose refusal is shown where it was made, and
        `do` a press, whose refusal becomes a note."""
        self._attempt, self._do = attempt, do
        self._edits: dict[str, Act] = {}
        self._presses: dict[str, Act] = {}
        self.mailbox = Mailbox(gui, "finlabEditables", SCRIPT, (str, str, str), self._hear, MAX_MESSAGE)
        """Where the page tells what was edited or pressed."""

    def on(self, kind: str, act: Act) -> None:
        """The handler of edits of a kind."""
        self._edits[kind] = act

    def on_press(self, kind: str, act: Act) -> None:
        """The handler of presses of a kind."""
        self._presses[kind] = act

    def _hear(self, kind: str, key: str, text: str) -> tuple[str | None] | None:
        """Why something was refused, None where it was not; no answer without a handler."""
        if kind in self._presses:
            self._do(partial(self._presses[kind], key, text))
            return (None,)
        if kind not in self._edits:
            return None
        refusal = self._attempt(partial(self._edits[kind], key, text))
        return (None if refusal is None else str(refusal),)
