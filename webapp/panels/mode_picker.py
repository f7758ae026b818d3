"""The plot of the modes, and a row of buttons to pick one; it stands on two tabs."""

from functools import partial

import viser

from webapp.handles import on_user_change, put
from webapp.markup.mode_plot import mode_plot
from webapp.markup.picking import marker
from webapp.panels.host import Host


class ModePicker:
    """Plot and buttons."""

    def __init__(self, gui: viser.GuiApi, host: Host, height: int, name: str) -> None:
        """Build them; `height` of the plot in pixels, `name` marks the buttons on the page."""
        self._host = host
        self._height = height
        self.name = name
        self._plot = gui.add_html("")
        gui.add_html(marker(name))
        self._choice = gui.add_button_group(
            "Mode", ("1",), hint="Which mode moves the fins; a click on a numbered dot does the same."
        )
        on_user_change(self._choice, self._choose)

    def _choose(self, entry: str) -> None:
        if entry.isdigit():
            self._host.do(partial(self._host.session.show_mode, int(entry) - 1))

    @property
    def shown(self) -> int:
        """The mode on the robot."""
        return min(self._host.session.mode, max(len(self._host.modes) - 1, 0))

    def refresh(self) -> None:
        """Write the modes of the newest answer."""
        best, modes = self._host.best, self._host.modes
        put(self._choice, options=tuple(str(k + 1) for k in range(len(modes))) or ("1",))
        plot = "" if best is None else mode_plot(best, modes, self.shown, self._height, self.name)
        put(self._plot, content=plot)
