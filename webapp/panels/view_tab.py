"""How the robot is shown: motion, what is drawn, and theme."""

from functools import partial
from html import escape

import viser

from webapp.handles import put
from webapp.page import Page
from webapp.session.display import NEWTONS

SWITCHES = {
    "frozen": ("Freeze", "Fins hold still at their zero direction (P)."),
    "fans": ("Sweep fans", "The angle that each fin sweeps."),
    "labels": ("Fin numbers", "A number at the root of each fin."),
    "graph": (
        "Fin graph",
        "Edges between working fins; with the method mdn, thick where its network lets one look at another.",
    ),
    "dimensions": ("Dimensions", "Coordinates of the selected fin."),
    "ghost": ("Ghost", "Where moved fins stood when the layout was opened or saved."),
    "center": ("Centre of gravity", "Mark it, and look through the hull."),
    "shadows": ("Shadows", "Slow without a graphics card."),
    "dark": ("Dark", "Dark theme."),
}
"""Field of `Display`, label and hint of each switch."""


def _scale_entry(newtons: float) -> str:
    return f"0.1 m = {newtons:g} N" if newtons else "automatic"


SCALES = {_scale_entry(newtons): newtons for newtons in (0.0, *NEWTONS)}
"""Entries of the arrow scale and their forces [N]."""


class ViewPanel:
    """Switches."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        speed = gui.add_slider("Motion speed", 0.05, 1.0, 0.05, 0.5, hint="1 is real time.")
        page.bind_number(
            speed, partial(page.session.set_display, "speed"), lambda: page.session.display.speed, digits=3
        )
        page.bind(
            gui.add_dropdown("Arrow scale", tuple(SCALES), hint="Force of an arrow of 0.1 m."),
            lambda entry: page.session.set_display("newtons", SCALES.get(entry)),
            lambda: _scale_entry(page.session.display.newtons),
        )
        for key, (label, hint) in SWITCHES.items():
            page.bind_display(gui.add_checkbox(label, False, hint=hint), key)
        self._graph = gui.add_html("")

    def refresh(self) -> None:
        """Say what the graph shows."""
        reply = self._page.answering.reply
        plain = self._page.session.display.graph and reply is not None and reply.proposal is None
        method = "" if reply is None else reply.answer.method
        put(self._graph, content=f"<div class='fl dim'>{_graph_words(method)}</div>", visible=plain)


def _graph_words(method: str) -> str:
    name = escape(method)
    return f"Method {name} looks at no graph, so all edges are alike; the network of mdn has attention."
