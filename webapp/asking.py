"""Questions that a page asks its user before it goes on, on a card over the view; `cards.js` draws it."""

import json
from collections.abc import Callable, Mapping

import viser

from webapp.presses import Presses
from webapp.viser_internals import run_file, run_script


class Asking:
    """The question of one page; a newer one takes its place."""

    def __init__(self, gui: viser.GuiApi, presses: Presses) -> None:
        """Hear the answers."""
        self._gui = gui
        self._acts: list[Callable[[], object]] = []
        presses.on("answer", self._answer)
        run_file(gui, "cards.js")

    def ask(self, title: str, text: str, answers: Mapping[str, Callable[[], object]]) -> None:
        """Show a title, a sentence, and a button for each answer that does something; another one leaves all
        as it is."""
        self._acts = list(answers.values())
        told = json.dumps([title, text, [*answers, "Cancel"]])
        run_script(self._gui, f"finlabCards.ask(...{told});")

    def _answer(self, key: str, _text: str) -> None:
        acts, self._acts = self._acts, []
        if key.isdecimal() and int(key) < len(acts):
            acts[int(key)]()
