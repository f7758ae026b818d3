"""Always visible: undo and redo, and the corner of the 3D view with status and legend."""

import viser

from webapp.handles import on_user_change, put
from webapp.markup.corner import corner, swim_corner
from webapp.markup.tour_card import tour_card
from webapp.panels.host import Host
from webapp.scene.swim_scene import ARROWS_N


class Corner:
    """What lies over the 3D view."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build it, empty."""
        self._host = host
        self._content = gui.add_html("")

    def refresh(self) -> None:
        """Write the status line and the legend."""
        host, answering = self._host, self._host.answering
        raw = host.session.sample is not None or host.playback.frame is not None
        if host.swimming.swimmers:
            content = swim_corner(host.swimming, ARROWS_N)
        else:
            content = corner(
                host.session.state, host.scenery.legend, host.shown, host.busy, answering.error, raw
            )
        put(self._content, content=content)


class Header:
    """The top of the panel."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._history = gui.add_button_group(
            "Session", ("Undo", "Redo", "Tour"), hint="Ctrl+Z, Ctrl+Shift+Z, T."
        )
        on_user_change(self._history, self._step)
        self._card = gui.add_html("", visible=False)
        self._stops = gui.add_button_group(
            "Tour", ("Back", "Next", "End"), hint="T is next; ending brings your work back.", visible=False
        )
        on_user_change(self._stops, self._walk)

    def _step(self, button: str) -> None:
        session = self._host.session
        acts = {"Undo": session.undo, "Redo": session.redo, "Tour": session.next_stop}
        if button in acts:
            self._host.do(acts[button])

    def _walk(self, button: str) -> None:
        session = self._host.session
        acts = {"Back": session.previous_stop, "Next": session.next_stop, "End": session.end_tour}
        if button in acts:
            self._host.do(acts[button])

    def refresh(self) -> None:
        """Write what can be undone, and where the tour is."""
        history = self._host.session.history
        undo, redo = history.undo_name or "nothing", history.redo_name or "nothing"
        put(self._history, hint=f"Undo: {undo} (Ctrl+Z). Redo: {redo} (Ctrl+Shift+Z). T starts a tour.")
        stop = self._host.session.stop
        put(self._card, visible=stop is not None, content="" if stop is None else tour_card(stop))
        put(self._stops, visible=stop is not None)
