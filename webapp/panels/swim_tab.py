"""Let the robot swim: a scenario, a method, what goes wrong on the way, and what it took."""

from functools import partial
from typing import Any

import viser

from finlab.sim import PLANTS, SHIPPED
from webapp.handles import add_html, put
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.markup.swim_card import swim_card
from webapp.markup.words import trim_sentence
from webapp.page import Page
from webapp.panels.damage import FinButtons
from webapp.session.scenarios import SCENARIOS
from webapp.session.state import COMPARED
from webapp.session.swim_plan import SPEEDS
from webapp.session.targets import axis_reach


class SwimPanel:
    """A panel with settings of swims."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, self._gui = page, gui

    def _bind(self, key: str, widget: Any) -> None:
        """A widget for a setting of swims."""
        session = self._page.session
        self._page.bind(widget, partial(session.set_swim, key), lambda: getattr(session.swim, key))


class ScenarioPanel(SwimPanel):
    """What is swum, in which water, by which methods."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        super().__init__(gui, page)
        day = "A day that is not as the designer assumed; it sets path, water, body, sensors and fins."
        self._bind("scenario", gui.add_dropdown("Scenario", tuple(SCENARIOS), hint=day))
        self._about = gui.add_html("")
        self._bind("path", gui.add_dropdown("Path", tuple(SHIPPED), hint="Where to swim."))
        who = "Who allocates, ten times a second."
        self._bind("method", gui.add_dropdown("Swim with", COMPARED, hint=who))
        forces = "The fin law, its ripple, or what no layout says: soft fins, jets, inflow, offsets."
        self._bind("plant", gui.add_dropdown("Fin forces", tuple(PLANTS), hint=forces))

    def refresh(self) -> None:
        """Say what the scenario is about."""
        put(self._about, content=html("<div class='fl'>{}</div>", self._page.session.swim.day.about))


class RunPanel(SwimPanel):
    """Start, stop, and what can go wrong at any moment."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        super().__init__(gui, page)
        self._add_run()
        self._add_disturbances()

    def _add_run(self) -> None:
        page = self._page
        gui = self._gui
        add_html(gui, marker("fl-primary"))
        page.add_button("Start", self._start, icon=viser.Icon.PLAYER_PLAY, hint="From the beginning.")
        runs = {
            "Pause": self._hold,
            "Go on": self._hold,
            "Step": page.swimming.step,
            "End": page.scenery.end_swim,
        }
        self._run = page.add_buttons("Run", runs, hint="Step swims for 0.1 s; B pauses or goes on.")
        speed = "Simulated time per real time; a slow machine falls short of it."
        self._bind("speed", self._gui.add_slider("Speed", *SPEEDS, 0.1, 1.0, hint=speed))

    def _add_disturbances(self) -> None:
        """What can go wrong at any moment."""
        page = self._page
        self._fins = FinButtons(
            page,
            "Break a fin",
            "Press a fin's number: break or mend it while it swims.",
            "fl-breaks",
            lambda name: page.swimming.toggle(name, page.session.swim.announced),
        )
        about = "The allocator knows at once. Off: a monitor has to detect it from the robot's motion."
        self._bind("announced", self._gui.add_checkbox("Announced", True, hint=about))

    def _hold(self) -> None:
        self._page.swimming.set_running(not self._page.swimming.running)

    def _start(self) -> None:
        session = self._page.session
        session.state.layout.only_fins("a swim", horizontal=True)
        self._page.swimming.start(session.swim.plan(session.state))

    def refresh(self) -> None:
        swimming, settings = self._page.swimming, self._page.session.swim
        if swimming.pace.speed != settings.speed:
            swimming.pace.set_speed(settings.speed)
        swimmer = swimming.swimmer
        names = swimmer.fins if swimmer else self._page.session.state.layout.names
        lost = swimmer.shown.lost if swimmer else self._page.session.state.failed
        paused = swimming.active and not swimming.running and not swimming.done
        put(self._run, options=("Go on" if paused else "Pause", "Step", "End"))
        self._fins.refresh(names, lost)


class SwimCardPanel:
    """What the swim took, and what can be downloaded of it."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        self._card = gui.add_html("")
        page.add_buttons(
            "Save",
            {"Log (NPZ)": partial(page.exports.swim, page.swimming)},
            hint="For numpy and `fit robot`.",
        )

    def refresh(self) -> None:
        state = self._page.session.state
        trim = trim_sentence(state.layout, axis_reach(state.able, state.failed))
        warning = "" if trim is None else html("<div class='fl missing'>{}</div>", trim)
        put(self._card, content=swim_card(self._page.swimming) + warning)
