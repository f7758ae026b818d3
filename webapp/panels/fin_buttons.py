"""A button for each fin in its colour: grey with a cross where it has failed, hollow where it is held."""

from collections.abc import Callable, Sequence

import viser

from webapp.handles import numbered, on_user_change, put
from webapp.markup.picking import button_colors
from webapp.theme import DEAD, css, fin_color


class FinButtons:
    """A row of numbers."""

    def __init__(
        self, gui: viser.GuiApi, label: str, hint: str, marker: str, press: Callable[[str], None]
    ) -> None:
        """Build the row; `marker` is its name on the page, `press` gets the name of a fin."""
        self._marker, self._press = marker, press
        self._names: Sequence[str] = ()
        self._paint = gui.add_html("")
        self._buttons = gui.add_button_group(label, ("1",), hint=hint)
        on_user_change(self._buttons, self._pressed)

    def _pressed(self, button: str) -> None:
        index = numbered(button, len(self._names))
        if index is not None:
            self._press(self._names[index])

    def refresh(self, names: Sequence[str], failed: Sequence[str] = (), held: Sequence[str] = ()) -> None:
        """Write the row for fins in their order."""
        self._names = names
        put(
            self._buttons,
            options=tuple(f"{i + 1} ✕" if n in failed else f"{i + 1}" for i, n in enumerate(names)),
        )
        colors = [
            (css(DEAD), "#fff")
            if n in failed
            else ("transparent", "inherit")
            if n in held
            else (css(fin_color(i)), "#111")
            for i, n in enumerate(names)
        ]
        put(self._paint, content=button_colors(self._marker, colors))
