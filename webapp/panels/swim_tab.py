"""Watch the robot swim: a path, a method or two, fins that break; plots of what happens."""

import time
from functools import partial
from typing import Any

import numpy as np
import viser

from finlab.sim import PLANTS, SHIPPED, Trajectory
from webapp.handles import Changes, hold_kind, option_index, put
from webapp.markup.swim_card import swim_card
from webapp.page import Page
from webapp.panels.damage import FinButtons
from webapp.panels.line_plot import FIN_LINES, LinePlot, top_of
from webapp.session.files import read_path
from webapp.session.state import AXIS_UNITS, AXIS_WORDS, COMPARED
from webapp.session.swim_plan import ALONE, OWN, SPEEDS
from webapp.tasks.swimmer import ASKED as ASKED_COLUMN
from webapp.tasks.swimmer import DELIVERED as DELIVERED_COLUMN
from webapp.tasks.swimmer import ERROR, FORCES, TIME
from webapp.tasks.swimming import Swimming
from webapp.theme import ASKED, DELIVERED, OTHER, css

EVERY_S = 0.2
"""Least time between two drawings [s]."""
SMALL = 0.01
"""What the vertical axes show at least."""
PLOT_PX = 76
"""Height of a plot [px]: four fit below the buttons."""
CERTAIN = 114.0
"""End of the axis of probabilities [%]: some room above what is certain."""


class SwimTab:
    """Widgets of one tab."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build the widgets."""
        self._page = page
        self._own: Trajectory | None = None
        rival = "A second robot on the same path, with another method."
        forces = "The fin law, its ripple, or what no layout says: soft fins, jets, inflow, offsets."
        speed = "Simulated time per real time; a slow machine falls short of it."
        self._path = gui.add_dropdown("Path", tuple(SHIPPED), hint="Where to swim.")
        settings: dict[str, Any] = {
            "path": self._path,
            "method": gui.add_dropdown("Method", COMPARED, hint="Who allocates, ten times a second."),
            "rival": gui.add_dropdown("Beside", (ALONE, *COMPARED), hint=rival),
            "plant": gui.add_dropdown("Fin forces", tuple(PLANTS), hint=forces),
        }
        runs = {
            "Start": self._start,
            "Pause": self._hold,
            "Go on": self._hold,
            "Step": page.swimming.step,
            "End": page.scenery.end_swim,
        }
        self._run = page.add_buttons("Run", runs, hint="Step swims for 0.1 s; B pauses or goes on.")
        settings["speed"] = gui.add_slider("Speed", *SPEEDS, 0.1, 1.0, hint=speed)
        for key, widget in settings.items():
            page.bind(widget, partial(page.session.set_swim, key), partial(self._setting, key))
        follow = gui.add_checkbox("Follow", False, hint="The camera goes along with the first robot.")
        page.on_change(follow, page.scenery.swim.look)
        self._fins = FinButtons(
            page,
            "Break a fin",
            "Press a fin's number: break or mend it while it swims.",
            "fl-breaks",
            lambda name: page.swimming.toggle(name, page.session.swim.announced),
        )
        tells = "The allocator is told. Off: a monitor must find out from how the robot moves."
        page.bind(
            gui.add_checkbox("Announced", True, hint=tells),
            partial(page.session.set_swim, "announced"),
            partial(self._setting, "announced"),
        )
        self._card = gui.add_html("")
        self._plots = SwimPlots(gui)
        with gui.add_folder("More", expand_by_default=False):
            page.add_upload(
                "Open a path (CSV)",
                self._take_path,
                icon=viser.Icon.ROUTE,
                mime_type=".csv",
                hint="A table with the columns t [s], x, y, z [m].",
            )
            wrench = "Asked in blue, delivered in green, of the first robot."
            self._axis = gui.add_dropdown("Plot the wrench of", AXIS_WORDS, hint=wrench)
            hold_kind(self._axis)

    def _setting(self, key: str) -> object:
        return getattr(self._page.session.swim, key)

    def _take_path(self, name: str, content: bytes) -> None:
        self._own = read_path(name, content)
        put(self._path, options=(*SHIPPED, OWN))
        self._page.session.set_swim("path", OWN)

    def _hold(self) -> None:
        self._page.swimming.set_running(not self._page.swimming.running)

    def _start(self) -> None:
        session = self._page.session
        self._page.swimming.start(session.swim.plan(session.state, self._own))

    def refresh(self) -> None:
        """Write how the swim goes."""
        swimming, speed = self._page.swimming, self._page.session.swim.speed
        if swimming.pace.speed != speed:
            swimming.pace.set_speed(speed)
        swimmers = swimming.swimmers
        names = swimmers[0].fins if swimmers else self._page.session.state.layout.names
        lost = swimmers[0].shown.lost if swimmers else self._page.session.state.failed
        paused = swimming.active and not swimming.running and not swimming.done
        put(self._run, options=("Start", "Go on" if paused else "Pause", "Step", "End"))
        self._fins.refresh(names, lost)
        put(self._card, content=swim_card(swimming))
        self._plots.refresh(swimming, option_index(self._axis))


class SwimPlots:
    """Four plots over time."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Build them, empty."""
        self._drawn = 0.0
        self._changes = Changes()
        self._error = LinePlot(gui, (css(DELIVERED), css(OTHER)), "off [cm]", height=PLOT_PX)
        self._wrench = LinePlot(gui, (css(ASKED), css(DELIVERED)), "surge [N]", height=PLOT_PX)
        self._force = LinePlot(gui, FIN_LINES, "fins [N]", height=PLOT_PX)
        self._broken = LinePlot(gui, FIN_LINES, "broken %", "time [s]", height=PLOT_PX + 24)

    def refresh(self, swimming: Swimming, axis: int) -> None:
        """Draw errors, one axis of the wrench, forces and the monitor's doubts, but no more often than an eye
        can follow."""
        swimmers = swimming.swimmers
        moments = tuple(swimmer.shown for swimmer in swimmers)
        for plot in (self._error, self._wrench, self._force, self._broken):
            plot.show(bool(swimmers))
        soon = time.monotonic() - self._drawn < EVERY_S and swimming.running
        if not moments or soon or not len(moments[0].record) or not self._changes(axis, *moments):
            return
        self._drawn = time.monotonic()
        record = moments[0].record
        seconds = np.ascontiguousarray(record[:, TIME])
        lines = [
            100 * np.interp(seconds, m.record[:, TIME], m.record[:, ERROR]) for m in moments if len(m.record)
        ]
        self._error.draw(seconds, lines, (0.0, top_of(lines, SMALL)))
        both = [record[:, column + axis] for column in (ASKED_COLUMN, DELIVERED_COLUMN)]
        self._wrench.name(f"{AXIS_WORDS[axis]} [{AXIS_UNITS[axis]}]", "")
        self._wrench.draw(seconds, both, (-top_of([-both[0], -both[1]], SMALL), top_of(both, SMALL)))
        n_fins = len(swimmers[0].fins)
        forces = list(record[:, FORCES : FORCES + n_fins].T)
        self._force.draw(seconds, forces, (0.0, top_of(forces, SMALL)))
        doubts = list(100.0 * record[:, FORCES + n_fins :].T)
        self._broken.draw(seconds, doubts, (0.0, CERTAIN))
