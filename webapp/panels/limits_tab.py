"""What this layout can do: attainable sets in the view, and the score card."""

from functools import partial

import viser

from webapp.handles import Changes, on_user_change, put
from webapp.markup.figures import three_digits
from webapp.markup.picking import chosen_button, marker
from webapp.markup.score_card import score_table
from webapp.panels.host import Host
from webapp.panels.improve import ImprovePanel
from webapp.session.display import DRAWN
from webapp.session.looking import PINNED
from webapp.session.shipped import shipped

PICKER = "fl-drawn"
"""Marks the buttons for the set that is drawn."""
SAVED = "saved state"
"""Entry of the list of layouts for the one that was opened or saved last."""


class LimitsTab:
    """Switches and the card."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._chosen = gui.add_html(marker(PICKER))
        self._drawn = gui.add_button_group(
            "Draw the set of", tuple(DRAWN), hint="Everything that the fins can give, as a body in the view."
        )
        on_user_change(self._drawn, partial(self._set, "drawn"))
        self._alone = gui.add_checkbox(
            "Alone", True, hint="Forces without any torque, torques without any force; else they are free."
        )
        on_user_change(self._alone, partial(self._set, "alone"))
        self._beside = gui.add_dropdown(
            "Beside", (SAVED, *shipped()), hint="The layout that stands next to this one on the card."
        )
        on_user_change(self._beside, self._compare)
        self._pin = gui.add_button_group(
            "Put aside", ("Pin this layout",), hint="As it is now, to compare others with."
        )
        on_user_change(self._pin, lambda _: host.do(host.session.pin))
        self._card = gui.add_html("")
        self._improve = ImprovePanel(gui, host)
        self._changes = Changes()

    def _set(self, key: str, value: object) -> None:
        self._host.do(partial(self._host.session.set_display, key, value))

    def _compare(self, name: str) -> None:
        self._host.do(partial(self._host.session.compare_with, None if name == SAVED else name))

    def refresh(self) -> None:
        """Write the findings."""
        session = self._host.session
        names = (SAVED, *((PINNED,) if session.pinned is not None else ()), *shipped())
        put(self._beside, options=names)
        put(self._beside, value=session.beside or SAVED)
        self._improve.refresh()
        analyst, display = self._host.analyst, self._host.session.display
        put(self._chosen, content=chosen_button(PICKER, list(DRAWN).index(display.drawn)))
        put(self._alone, value=display.alone, visible=display.drawn != "none")
        found = analyst.findings
        if not self._changes(found, analyst.busy, analyst.error, session.beside):
            return
        if analyst.error is not None:
            put(self._card, content="<div class='fl missing'>This layout cannot be analysed.</div>")
        elif found is None:
            put(self._card, content="<div class='fl dim'>computing …</div>")
        else:
            note = "<span class='dim'>computing …</span> " if analyst.busy else ""
            if found.now is not None:
                unit = "N" if found.now.kind == "force" else "N m"
                gap = three_digits(found.now.gap)
                note += f"<span class='dim'>The body lacks at most {gap} {unit} of the true set.</span>"
            name = "before" if session.beside is None else session.beside
            table = score_table(found.question.layout, found.card, found.before, name)
            put(self._card, content=f"<div class='fl'>{note}</div>{table}")
