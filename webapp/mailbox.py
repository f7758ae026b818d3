"""Messages from a script in the page to the server: numbered words in a hidden box, each heard once and
answered."""

import json
from collections.abc import Callable, Sequence
from typing import Any

import viser

from webapp.handles import add_html, on_user_change
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.viser_internals import run_script, uuid_of


class Mailbox:
    """The box of one script on one page."""

    def __init__(
        self,
        gui: viser.GuiApi,
        name: str,
        script: str,
        kinds: Sequence[type],
        hear: Callable[..., tuple[Any, ...] | None],
        longest: int,
    ) -> None:
        """Put it into the page.

        Args:
            gui: the page's.
            name: of the object with `start` and `answer` that the script makes.
            script: what runs in the page.
            kinds: of the parts of a word, behind its number.
            hear: gets these parts, and gives what is answered; None where nothing is.
            longest: message that is read; pages may send anything.
        """
        self._gui, self._name, self._script = gui, name, script
        self._kinds, self._hear = [int, *kinds], hear
        self._last = 0
        hidden = "<style>div:has(>.{}) + div {{ display: none; }}</style>{}"
        add_html(gui, html(hidden, name, marker(name)))
        self._box = gui.add_text(name, "")
        on_user_change(self._box, lambda text: self.read(text) if 0 < len(text) <= longest else None)

    def start(self, *arguments: object) -> None:
        """Let the page's half begin, with the box and what else it has to know."""
        told = json.dumps([uuid_of(self._box), *arguments])
        run_script(self._gui, f"{self._script}\n{self._name}.start(...{told});")

    def tell(self, what: str, argument: object) -> None:
        """Let the page's half do something."""
        run_script(self._gui, f"{self._name}.{what}({json.dumps(argument)});")

    def read(self, message: str) -> None:
        """Messages of the page that are not answered yet, oldest first."""
        try:
            words = json.loads(message)
        except (ValueError, RecursionError):
            return
        answers = []
        for word in words if isinstance(words, list) else []:
            if not (isinstance(word, list) and [type(part) for part in word] == self._kinds):
                continue
            number, *parts = word
            if number > self._last:
                self._last = number
                answer = self._hear(*parts)
                if answer is not None:
                    answers.append((number, *answer))
        if answers:
            self.tell("answer", answers)
