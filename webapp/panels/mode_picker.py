"""The plot of the modes, and a row of buttons to pick one; it stands on two tabs."""

from functools import partial

import viser

from webapp.handles import Changes, numbered, on_user_change, put
from webapp.markup.mode_plot import SAMPLES, mode_plot
from webapp.markup.picking import chosen_button, marker
from webapp.panels.channel import Channel
from webapp.panels.host import Host


class ModePicker:
    """Plot and buttons."""

    def __init__(self, gui: viser.GuiApi, host: Host, height: int, name: str) -> None:
        """Build them; `height` of the plot in pixels, `name` marks the buttons on the page."""
        self._host = host
        self._height = height
        self.name = name
        self._changes = Changes()
        self._plot = gui.add_html("")
        Channel(gui, f"{name}-{SAMPLES}", self._choose_sample)
        self._chosen = gui.add_html(marker(name))
        self._choice = gui.add_button_group(
            "Mode",
            ("1",),
            hint="Which mode moves the fins. A click on a dot does it too, on a small one for a raw sample.",
        )
        on_user_change(self._choice, self._choose)

    def _choose(self, entry: str) -> None:
        index = numbered(entry, len(self._host.answering.modes.shown))
        if index is not None:
            self._host.do(partial(self._host.session.show_mode, index))

    def _choose_sample(self, word: list[str]) -> None:
        best = self._host.answering.best
        count = 0 if best is None or best.samples is None else len(best.samples.energy)
        if word[0].isdecimal() and int(word[0]) < count:
            self._host.do(partial(self._host.session.show_sample, int(word[0])))

    @property
    def shown(self) -> int | None:
        """The mode on the robot; None while a raw sample is."""
        session, modes = self._host.session, self._host.answering.modes.shown
        return None if session.sample is not None else min(session.mode, max(len(modes) - 1, 0))

    def refresh(self) -> None:
        """Write the modes of the newest answer."""
        answering, sample = self._host.answering, self._host.session.sample
        best, modes = answering.best, answering.modes
        if not self._changes(best, modes, self.shown, sample):
            return
        put(self._choice, options=tuple(str(k + 1) for k in range(len(modes.shown))) or ("1",))
        put(self._chosen, content=chosen_button(self.name, self.shown))
        plot = ""
        if best is not None:
            plot = mode_plot(best, modes, self.shown, sample, self._height, self.name)
        put(self._plot, content=plot)
