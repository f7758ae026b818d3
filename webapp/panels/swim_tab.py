"""Let the robot swim: a scenario, a method or two, what goes wrong on the way, and what it took."""

from functools import partial
from typing import Any

import viser

from finlab.sim import PLANTS, SHIPPED, Trajectory
from webapp.handles import add_html, put
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.markup.scenario import scenario_card
from webapp.markup.swim_card import swim_card
from webapp.markup.words import trim_sentence
from webapp.page import Page
from webapp.panels.damage import FinButtons
from webapp.session.files import is_path, read_path
from webapp.session.scenarios import SCENARIOS
from webapp.session.state import COMPARED
from webapp.session.swim_plan import ALONE, CONTROLLERS, NUMBERS, OWN, SPEEDS
from webapp.session.targets import axis_reach


class SwimPanel:
    """A panel with settings of swims."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, self._gui = page, gui

    def _bind(self, key: str, widget: Any, live: bool = False, digits: int | None = None) -> None:
        """A widget for a setting of swims; what is `live` acts on the robots that swim, too. Numbers show
        so many digits behind the point."""
        session = self._page.session
        act = partial(self._meet, key) if live else partial(session.set_swim, key)

        def value() -> Any:
            return getattr(session.swim, key)

        if digits is None:
            self._page.bind(widget, act, value)
        else:
            self._page.bind_number(widget, act, value, digits)

    def _meet(self, key: str, value: Any) -> None:
        """Another water or buoyancy, at once."""
        session = self._page.session
        session.set_swim(key, value)
        self._page.swimming.meet(session.swim.water, session.swim.truth["buoyancy"])


class ScenarioPanel(SwimPanel):
    """What is swum, in which water, by which methods."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        super().__init__(gui, page)
        day = "A day that is not as the designer assumed; it sets path, water, body, sensors and fins."
        self._bind("scenario", gui.add_dropdown("Scenario", tuple(SCENARIOS), hint=day), live=True)
        self._about = gui.add_html("")
        self._path = gui.add_dropdown("Path", tuple(SHIPPED), hint="Where to swim.")
        self._bind("path", self._path)
        rival = "A second robot on the same path, with another method."
        who = "Who allocates, ten times a second."
        self._bind("method", gui.add_dropdown("Swim with", COMPARED, hint=who))
        self._bind("rival", gui.add_dropdown("Beside", (ALONE, *COMPARED), hint=rival))
        self._add_more()

    def _add_more(self) -> None:
        gui, page = self._gui, self._page
        with gui.add_folder("More", expand_by_default=False):
            steers = "Tracking learns the current and other forces; waypoint is the paper's way."
            self._bind("controller", gui.add_dropdown("Controller", CONTROLLERS, hint=steers))
            forces = "The fin law, its ripple, or what no layout says: soft fins, jets, inflow, offsets."
            self._bind("plant", gui.add_dropdown("Fin forces", tuple(PLANTS), hint=forces))
            for key, label, step, hint in (
                ("pack_wh", "Battery [Wh]", 1.0, "What is in it, for how long and how far it lasts."),
                (
                    "electronics_w",
                    "Other load [W]",
                    0.5,
                    "Computer, sensors, lights: what takes power besides the fins.",
                ),
            ):
                first = getattr(page.session.swim, key)
                self._bind(key, gui.add_number(label, first, step=step, hint=hint), digits=3)
            page.opening.add(".csv", self._open_path, knows=is_path)
            page.add_upload(
                "Open a path (CSV)",
                self._open_path,
                icon=viser.Icon.ROUTE,
                mime_type=".csv",
                hint="A table with the columns t [s], x, y, z [m].",
            )

    def _open_path(self, name: str, content: bytes) -> None:
        self._page.reading.read(partial(read_path, name, content), self._take_path)

    def _take_path(self, path: Trajectory) -> None:
        self._page.swimming.own_path = path
        put(self._path, options=(*SHIPPED, OWN))
        self._page.session.set_swim("path", OWN)
        self._page.session.show_task("Simulate")

    def refresh(self) -> None:
        """Say what is true and what the robot believes."""
        put(self._about, content=scenario_card(self._page.session.swim))


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
        self._bind("speed", self._gui.add_slider("Speed", *SPEEDS, 0.1, 1.0, hint=speed), digits=2)

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
        now = "At once, while it swims."
        for key, label, step, hint in (
            ("current_cm_s", "Current [cm/s]", 0.1, f"How fast the water flows. {now}"),
            ("heading_deg", "flows to [°]", 1.0, f"0 is the world's x, 90 its y. {now}"),
            ("waves_cm", "Waves [cm]", 1.0, f"Significant height; period 3 s; they fade with depth. {now}"),
            ("buoyancy_percent", "Buoyancy [%]", 0.1, f"More than it should have; it rises by itself. {now}"),
        ):
            slider = self._gui.add_slider(label, *NUMBERS[key], step, 0.0, hint=hint)
            self._bind(key, slider, live=True, digits=3)

    def _hold(self) -> None:
        self._page.swimming.set_running(not self._page.swimming.running)

    def _start(self) -> None:
        session = self._page.session
        session.state.layout.only_fins("a swim", horizontal=True)
        self._page.swimming.start(session.swim.plan(session.state, self._page.swimming.own_path))

    def refresh(self) -> None:
        swimming, settings = self._page.swimming, self._page.session.swim
        if swimming.pace.speed != settings.speed:
            swimming.pace.set_speed(settings.speed)
        swimmers = swimming.swimmers
        names = swimmers[0].fins if swimmers else self._page.session.state.layout.names
        lost = swimmers[0].shown.lost if swimmers else self._page.session.state.failed
        paused = swimming.active and not swimming.running and not swimming.done
        put(self._run, options=("Go on" if paused else "Pause", "Step", "End"))
        self._fins.refresh(names, lost)


class SwimCardPanel:
    """What the swim took, and what can be downloaded of it."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        self._card = gui.add_html("")
        table = {"Table (CSV)": lambda: page.exports.swim(page.swimming.records())}
        page.add_buttons("Save", table, hint="The log with units.")

    def refresh(self) -> None:
        state = self._page.session.state
        trim = trim_sentence(state.layout, axis_reach(state.able, state.failed))
        warning = "" if trim is None else html("<div class='fl missing'>{}</div>", trim)
        put(self._card, content=swim_card(self._page.swimming, self._page.session.swim) + warning)
