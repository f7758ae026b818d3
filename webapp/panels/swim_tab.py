"""Swims: a scenario, a method, what goes wrong on the way, what it took, and plots over time."""

import math
import time
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import viser

from finlab.arrays import Array
from finlab.display import listed
from finlab.layout import Layout
from finlab.layout.layout import MAX_ACTUATORS
from finlab.swim.vehicle.fossen import complete_body
from webapp.handles import add_html, set_properties
from webapp.markup.outcomes import swim_card
from webapp.markup.plot import cost_axis, exact_axis, over_time, positive_axis
from webapp.markup.words import (
    BODY_WORDS,
    html,
    marker,
    righting_sentences,
    trim_sentence,
    unsaid_of,
)
from webapp.page import Page
from webapp.panels.damage import Row, add_fin_buttons
from webapp.session.swim_plan import CHOICES, SCENARIOS, SPEEDS, SwimSettings
from webapp.session.targets import axis_reach
from webapp.tasks.swimmer import DEPTH_ERROR, ERROR, FORCES, POWER, SURGE, TIME, Moment, Swimmer
from webapp.theme import ASKED, DELIVERED, Rgb, fin_color


def _bind(page: Page, key: str, widget: Any) -> None:
    page.bind(widget, partial(page.session.set_swim, key), lambda swim: getattr(swim, key))


def add_scenario(page: Page) -> None:
    """What is swum, in which water, by which methods."""
    gui = page.gui
    day = (
        "A day that is not as the designer assumed; it sets path, water, body, sensors and "
        "actuators."
    )
    days = gui.add_dropdown("Scenario", tuple(SCENARIOS), hint=day)
    _bind(page, "scenario", days)
    page.add_html(swim_words)
    _bind(page, "path", gui.add_dropdown("Path", CHOICES["path"], hint="Where to swim."))
    laws = (
        "The paper's two beside ours: towards a waypoint; speed and depth by PID, which keeps no "
        "course."
    )
    _bind(page, "controller", gui.add_dropdown("Controller", CHOICES["controller"], hint=laws))


def swim_words(swim: SwimSettings, method: str, layout: Layout) -> str:
    """The day, who allocates ten times a second, and whose body swims where the robot's own is not
    described."""
    text = f"{swim.day.about} Method {method}, as in the bar, allocates."
    return html("<div class='fl'>{}{}</div>", text, _borrowed_body(layout))


def _borrowed_body(layout: Layout) -> str:
    """What the robot swims with in place of what nothing is said of; nothing where all is said."""
    unsaid = unsaid_of(layout)
    if not unsaid:
        return ""
    if len(unsaid) == len(BODY_WORDS):
        mass_kg = complete_body(layout).mass_kg
        sentence = f"Its body is not described: it swims with that of U-CAT, {mass_kg:g} kg."
    else:
        sentence = f"Not said of its body: {listed(unsaid)}. It swims with U-CAT's."
    remedy = "Estimate it from the hull in Design, at the robot's row."
    return html("<div class='missing'>{} {}</div>", sentence, remedy)


def add_run(page: Page) -> None:
    """Start, stop, and what can go wrong at any moment."""
    session = page.session
    gui = page.gui
    swimming = page.jobs.swimming

    def start() -> None:
        swimming.start(session.swim.plan(session.state))

    def hold() -> None:
        swimming.set_running(not swimming.running)

    page.add_html(lambda swim_goes_on: marker("fl-usual" if swim_goes_on else "fl-primary"))
    page.add_button("Start", start, icon=viser.Icon.PLAYER_PLAY, hint="From the beginning.")
    page.add_html(lambda swim_goes_on: marker("fl-verdict" if swim_goes_on else "fl-usual"))
    runs = {"Pause": hold, "Go on": hold, "Step": swimming.step, "End": page.scenery.end_swim}
    run = page.add_buttons("Run", runs, visible=False, hint=RUN_HINT)
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
    layout: Layout, lost: tuple[str, ...], swimmer: Swimmer | None, moment: Moment | None
) -> Row:
    if swimmer is None or moment is None:
        return layout.names, lost, ()
    return swimmer.fins, moment.lost, ()


def add_figures(page: Page) -> None:
    """What the swim took, and what can be downloaded of it."""
    page.add_html(swim_card)
    page.add_html(_trim)
    log = {"Log (NPZ)": partial(page.designs.swim, page.jobs.swimming)}
    save = page.add_buttons("Save", log, visible=False, hint="For numpy; Log opens it as well.")
    page.board.show(save, visible=lambda swims: swims)


def _trim(able: Layout, lost: tuple[str, ...], layout: Layout) -> str:
    trim = trim_sentence(layout, axis_reach(able, lost))
    sentences = [*([] if trim is None else [trim]), *righting_sentences(layout)]
    return html("<div class='fl missing'>{}</div>", " ".join(sentences)) if sentences else ""


RUN_HINT = (
    "Step swims for 0.1 s; B pauses or goes on. End goes back to the design and drops plots and "
    "figures: save the swim before, at Figures."
)
"""What the page says of the buttons of a swim."""
FIN_LINES = tuple(fin_color(i) for i in range(MAX_ACTUATORS))
EVERY_S = 0.2
"""Least time between two drawings [s]."""
SMALL = 0.01
"""What a vertical axis shows at least, in its unit."""
TICKS = 3
MAX_POINTS = 2000
"""About how many forces are drawn; a longer record, or one of more actuators, is thinned out."""
FIRST_S = 8.0
"""Least end of the axes of time [s]; it doubles as time goes on."""
SMOOTH_S = 1.0
"""Time over which plotted power is averaged."""
UNSWUM = (
    "Once a swim is started, its distance from the path, power, wrench, forces and what is found "
    "broken are plotted here over time."
)


def add_timeline(page: Page) -> None:
    """What is said before a swim, and six plots over time."""
    content = add_html(page.gui, "")
    drawn_at = 0.0

    def draw(swimmer: Swimmer | None, moment: Moment | None, paused: bool) -> None:
        """No more often than an eye can follow."""
        nonlocal drawn_at
        now = time.monotonic()
        if swimmer is None:
            set_properties(
                content, content=html("<div class='fl fl-timeline fl-unswum dim'>{}</div>", UNSWUM)
            )
        elif moment is None or not len(moment.record):
            return
        elif paused or moment.done or now - drawn_at >= EVERY_S:
            drawn_at = now
            plots = timeline(moment.record, len(swimmer.fins), swimmer.duration_s)
            set_properties(content, content=html("<div class='fl fl-timeline'>{}</div>", plots))

    page.board.act(draw)


def timeline(record: Array, n: int, duration_s: float) -> list[str]:
    """Errors, power, surge asked and delivered, forces, and the monitor's doubts, as plots.

    Args:
        record: rows (N, 9 + 2 n) of a swim, as `tasks/swimmer.py` describes them.
        n: number of actuators.
        duration_s: of the whole swim [s].
    """
    rows = np.nan_to_num(record[:: 1 + len(record) * n // MAX_POINTS])
    seconds = rows[:, TIME]
    power = rows[:, POWER]
    if len(rows) > 1:
        ones = np.ones(max(1, min(len(rows), round(SMOOTH_S / float(seconds[1] - seconds[0])))))
        power = np.convolve(power, ones, "same") / np.convolve(np.ones(len(rows)), ones, "same")
    last = float(seconds[-1])
    end = max(last, min(duration_s, 2.0 ** math.ceil(math.log2(max(last, FIRST_S)))))
    across = exact_axis("time [s]", np.array([0.0, end]))

    plot = partial(over_time, across, seconds)

    def sizes(word: str, lines: Sequence[Array], colors: Sequence[Rgb] = (DELIVERED,)) -> str:
        return plot(positive_axis(word, np.append(SMALL, lines), TICKS), lines, colors)

    surge = list(rows[:, SURGE : SURGE + 2].T)
    ends = cost_axis("surge [N]", np.append((-SMALL, SMALL), surge), TICKS)
    return [
        sizes("off the path [m]", [rows[:, ERROR]]),
        sizes("off in depth [m]", [rows[:, DEPTH_ERROR]]),
        sizes("power [W]", [power]),
        plot(ends, surge, (ASKED, DELIVERED), ("asked", "delivered")),
        sizes("forces [N]", list(rows[:, FORCES : FORCES + n].T), FIN_LINES),
        sizes("broken [%]", list(100.0 * rows[:, FORCES + n :].T), FIN_LINES),
    ]
