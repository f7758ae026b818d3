"""Words from the page's own markup to the server: a script writes them into a hidden text box."""

from collections.abc import Callable
from typing import Any

import viser

from webapp.markup.picking import marker

MAX_LENGTH = 60
"""Longest word that is heard; pages may send anything."""


class Channel:
    """A hidden text box behind a marker."""

    def __init__(self, gui: viser.GuiApi, name: str, hear: Callable[[list[str]], None]) -> None:
        """Build it; `hear` gets the comma-separated parts of each word on the event loop."""
        gui.add_html(f"<style>div:has(>.{name}) + div {{ display: none; }}</style>{marker(name)}")
        self._box = gui.add_text(name, "")

        @self._box.on_update
        async def _changed(event: Any) -> None:
            word = event.target.value
            if event.client is not None and isinstance(word, str) and 0 < len(word) <= MAX_LENGTH:
                hear(word.split(","))


def send(name: str, word: str) -> str:
    """A line of script that sends `word`, an expression of script, through the channel.

    The box belongs to a framework that only notices what is set by the element's own setter.
    """
    return (
        f"const box = document.querySelector('div:has(>.{name}) + div input');"
        "Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(box, "
        f"{word}); box.dispatchEvent(new Event('input', {{bubbles: true}}));"
    )
