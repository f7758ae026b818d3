"""Let the robot swim: a scenario, a method, what goes wrong on the way, and what it took."""

from functools import partial
from typing import Any

import viser

from finlab.layout import Layout
from webapp.handles import add_html
from webapp.markup.html import html, marker
from webapp.markup.swim_card import swim_card
from webapp.markup.words import righting_sentences, trim_sentence
from webapp.page import Page
from webapp.panels.damage import Row, add_fin_buttons
from webapp.session.swim_plan import CHOICES, SCENARIOS, SPEEDS, SwimSettings
from webapp.session.targets import axis_reach
from webapp.tasks.moment import Moment
from webapp.tasks.swimmer import Swimmer


def _bind(page: Page, key: str, widget: Any) -> None:
    """A widget for a setting of swims."""
    page.bind(widget, partial(page.session.set_swim, key), lambda swim: getattr(swim, key))


def add_scenario(page: Page) -> None:
    """What is swum, in which water, by which methods."""
    gui = page.gui
    day = "A day that is not as the designer assumed; it sets path, water, body, sensors and actuators."
    days = gui.add_dropdown("Scenario", tuple(SCENARIOS), hint=day)
    _bind(page, "scenario", days)
    page.add_html(_about)
    _bind(page, "path", gui.add_dropdown("Path", CHOICES["path"], hint="Where to swim."))
    laws = "The paper's two beside ours: towards a waypoint; speed and depth by PID, which keeps no course."
    _bind(page, "controller", gui.add_dropdown("Controller", CHOICES["controller"], hint=laws))


def _about(swim: SwimSettings, method: str) -> str:
    """The day, and who allocates ten times a second."""
    about = swim.day.about
    return html("<div class='fl'>{} Method {}, as in the bar, allocates.</div>", about, method)


def add_run(page: Page) -> None:
    """Start, stop, and what can go wrong at any moment."""
    session, gui, swimming = page.session, page.gui, page.jobs.swimming

    def start() -> None:
        swimming.start(session.swim.plan(session.state))

    def hold() -> None:
        swimming.set_running(not swimming.running)

    add_html(gui, marker("fl-primary"))
    page.add_button("Start", start, icon=viser.Icon.PLAYER_PLAY, hint="From the beginning.")
    runs = {"Pause": hold, "Go on": hold, "Step": swimming.step, "End": page.scenery.end_swim}
    run = page.add_buttons("Run", runs, visible=False, hint="Step swims for 0.1 s; B pauses or goes on.")
    page.board.show(
        run,
        options=lambda paused: ("Go on" if paused else "Pause", "Step", "End"),
        visible=lambda swims: swims,
    )
    speed = "Simulated time per real time; a slow machine falls short of it."
    _bind(page, "speed", gui.add_slider("Speed", *SPEEDS, 0.1, 1.0, hint=speed))
    page.board.act(lambda swim: swimming.pace.set_speed(swim.speed))
    add_fin_buttons(
        page,
        "Break",
        "Press a number: break or mend that one while it swims.",
        "fl-breaks",
        lambda name: swimming.toggle(name, session.swim.announced),
        _breakable,
    )
    about = "The allocator knows at once. Off: a monitor has to detect it from the robot's motion."
    _bind(page, "announced", gui.add_checkbox("Announced", True, hint=about))


def _breakable(
    layout: Layout, failed: tuple[str, ...], swimmer: Swimmer | None, moment: Moment | None
) -> Row:
    if swimmer is None or moment is None:
        return layout.names, failed, ()
    return swimmer.fins, moment.lost, ()


def add_figures(page: Page) -> None:
    """What the swim took, and what can be downloaded of it."""
    page.add_html(swim_card)
    page.add_html(_trim)
    log = {"Log (NPZ)": partial(page.jobs.exports.swim, page.jobs.swimming)}
    save = page.add_buttons("Save", log, visible=False, hint="For numpy and `fit robot`.")
    page.board.show(save, visible=lambda swims: swims)


def _trim(able: Layout, failed: tuple[str, ...], layout: Layout) -> str:
    trim = trim_sentence(layout, axis_reach(able, failed))
    said = [*([] if trim is None else [trim]), *righting_sentences(layout)]
    return html("<div class='fl missing'>{}</div>", " ".join(said)) if said else ""
