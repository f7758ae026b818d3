"""Always visible: undo and redo, and the corner of the 3D view with status and legend."""

import viser

from webapp.handles import on_user_change, put
from webapp.markup.corner import corner
from webapp.markup.style import STYLE
from webapp.panels.host import Host


class Header:
    """The top of the panel."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        gui.add_html(STYLE)
        self._corner = gui.add_html("")
        self._history = gui.add_button_group("History", ("Undo", "Redo"), hint="Ctrl+Z, Ctrl+Shift+Z")
        on_user_change(self._history, self._step)

    def _step(self, button: str) -> None:
        session = self._host.session
        self._host.do(session.undo if button == "Undo" else session.redo)

    def refresh(self) -> None:
        """Write the status line."""
        host, history = self._host, self._host.session.history
        put(
            self._corner,
            content=corner(host.session.state, host.newtons, host.shown, host.busy, host.error),
        )
        undo, redo = history.undo_name or "nothing", history.redo_name or "nothing"
        put(self._history, hint=f"Undo: {undo} (Ctrl+Z). Redo: {redo} (Ctrl+Shift+Z).")
