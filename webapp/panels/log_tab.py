"""A log: what the robot could not, when, and what would have held it; each moment can be put on the
robot."""

from typing import TYPE_CHECKING, Any

import numpy as np
import viser
from markupsafe import Markup

from finlab.analysis import AXES as MOTIONS
from finlab.axes import AXES
from webapp.handles import add_html, placed, press, set_properties
from webapp.markup.plot import cost_axis, exact_axis, over_time
from webapp.markup.words import html, in_app, marker, row, three_digits
from webapp.page import Page
from webapp.session.state import AXIS_UNITS
from webapp.tasks.log_reading import SUFFIXES
from webapp.theme import ASKED, DELIVERED, fin_color

if TYPE_CHECKING:
    from finlab.log import Judgement

ACROSS = 4
"""Plots that stand beside each other."""
FIRST = (
    "Drop a log on the page: PX4 (.ulg), ArduSub (.bin), or a bag of ROS (.mcap, .db3, .bag). It "
    "is told "
    "when and on which axis the robot could not, and what would have held it."
)


def add_log(page: Page) -> None:
    """The file, by whose laws it is judged, and what is said of it."""
    log = page.jobs.log
    gui = page.gui
    page.opening.add(SUFFIXES, log.open)
    add_html(gui, marker("fl-primary"))
    page.add_upload(
        "Open a log", page.opening.open, icon=viser.Icon.FOLDER_OPEN, mime_type=SUFFIXES
    )
    about = (
        "Judge it by the robot of this page; else by the one that the log's own parameters "
        "describe."
    )
    page.bind(
        gui.add_checkbox("This robot", False, hint=about), log.choose_robot, lambda by_page: by_page
    )
    page.add_html(_summary)
    better = page.add_button(
        "Open the improved robot", lambda: _improve(page), icon=viser.Icon.SPARKLES
    )
    page.board.show(
        better, visible=lambda judgement: judgement is not None and judgement.improved is not None
    )


def _improve(page: Page) -> None:
    judgement = page.jobs.log.answer
    if judgement is not None and judgement.improved is not None:
        page.jobs.log.use(judgement.improved, f"Robot for {judgement.source}")


def _summary(
    judgement: "Judgement | None", judgement_progress: str | None, judgement_error: str | None
) -> str:
    if judgement_progress is not None:
        return html("<div class='fl dim'>{} …</div>", judgement_progress.capitalize())
    if judgement is None:
        sentence = (
            html("<div class='missing'>{}</div>", in_app(judgement_error))
            if judgement_error
            else FIRST
        )
        return html("<div class='fl'>{}</div>", sentence)
    notes = [
        html("<div class='said dim'>{}</div>", in_app(note))
        for note in (*judgement.asks, *judgement.notes)
    ]
    return html(
        "<div class='fl'><b>{}</b><div class='said'>{}</div>{}</div>",
        judgement.source,
        judgement.sentence,
        notes,
    )


def add_losses(page: Page) -> None:
    """What was lost on each axis, and when; a spell that is pressed is put on the robot."""

    def jump(key: str, _held: str) -> None:
        judgement = page.jobs.log.answer
        spells = () if judgement is None else judgement.spells
        page.jobs.log.jump(spells[placed(key, len(spells))].start)

    page.presses.on("spell", jump)
    slider = page.gui.add_slider(
        "Moment [s]", 0.0, 1.0, 0.1, 0.0, hint="Which moment is on the robot."
    )
    page.on_change(slider, page.jobs.log.jump)

    def place(judgement: "Judgement | None", log_moment: float | None) -> None:
        set_properties(slider, visible=judgement is not None)
        if judgement is not None:
            first, last = judgement.timeline.time[[0, -1]].tolist()
            set_properties(
                slider,
                max=max(last, first + 0.1),
                min=first,
                value=first if log_moment is None else log_moment,
            )

    page.board.act(place, slider)
    page.add_html(_losses)


def _losses(judgement: "Judgement | None", log_moment: float | None) -> str:
    if judgement is None:
        return html(
            "<div class='fl dim'>{}</div>", "What was lost on each axis, and when, is listed here."
        )
    each = zip(
        MOTIONS, AXIS_UNITS, judgement.asked, judgement.missing, judgement.lost_s, strict=True
    )
    rows = [
        row(
            html("{} <span class='dim'>{} s</span>", motion, unit),
            *map(three_digits, (asked, missing, lost)),
        )
        for motion, unit, asked, missing, lost in each
        if asked > 0.0
    ]
    head = Markup("<tr><th>impulse</th><th>asked</th><th>missing</th><th>lost [s]</th></tr>")
    spells = [
        html(
            "<tr class='pick {}' tabindex='0' {}><td>{:.1f} … {:.1f}</td><td class='words'>{}</td>"
            "<td class='words dim'>{}</td></tr>",
            "chosen" if log_moment is not None and spell.start <= log_moment <= spell.end else "",
            press("spell", str(k)),
            spell.start,
            spell.end,
            ", ".join(spell.axes),
            ", ".join(spell.limits),
        )
        for k, spell in enumerate(judgement.spells)
    ]
    when = Markup(
        "<tr><th>when [s]</th><th class='words'>lost</th><th class='words'>at a limit</th></tr>"
    )
    tables = [
        html("<table>{}{}</table>", *each) for each in ((head, rows), (when, spells)) if each[1]
    ]
    return html("<div class='fl'>{}</div>", tables)


def _asked_axes(judgement: "Judgement") -> list[int]:
    return np.flatnonzero(np.array(judgement.asked) > 1e-3 * max(judgement.asked)).tolist()


def plot_rows(judgement: "Judgement") -> int:
    """Rows that the plots of a log take, in a window of usual width."""
    return 1 if len(_asked_axes(judgement)) < ACROSS else 2


def log_plots(judgement: "Judgement | None", log_moment: float | None) -> str:
    """Demand and what was given over time, of each axis that was asked for, and actuators at their
    limits."""
    if judgement is None:
        return html(
            "<div class='fl dim fl-timeline'>{}</div>", "The log is plotted here over time."
        )
    line = judgement.timeline
    parts = []
    ends: Any = np.append(line.time, line.time[-1] + judgement.seconds / len(line.time))
    across = exact_axis("time [s]", ends)
    for k in _asked_axes(judgement):
        both = [line.demand[:, k], line.given[:, k]]
        up = cost_axis(f"{MOTIONS[k]} [{AXIS_UNITS[k]}]", np.append((-1e-3, 1e-3), both), 4)
        words = ("asked", "given")
        parts.append(over_time(across, line.time, up, both, (ASKED, DELIVERED), words, log_moment))
    shares = list(100.0 * line.limits.T)
    up = cost_axis("at a limit [%]", np.array((0.0, 100.0)), 4)
    colors = [fin_color(k) for k in range(judgement.robot.n)]
    parts.append(over_time(across, line.time, up, shares, colors, (), log_moment))
    return html("<div class='fl fl-timeline'>{}</div>", parts)


def replays_table(judgement: "Judgement | None") -> str:
    """The same demands asked of other methods and policies, with each actuator lost, of a better
    robot."""
    if judgement is None:
        return html(
            "<div class='fl dim'>{}</div>",
            "Other methods and policies are asked the log's demands here.",
        )
    lost = AXES.index(judgement.axis) if judgement.axis else int(np.argmax(judgement.asked))
    rows = [
        html(
            "<tr><td>{}</td><td class='words'>{}</td><td "
            "class='{}'>{}</td><td>{}</td><td>{}</td></tr>",
            each.robot if each.lost is None else f"without {each.lost}",
            each.name,
            "given" if each == judgement.held_by else "",
            three_digits(each.missing[lost]),
            three_digits(each.watts),
            three_digits(each.saturated_s),
        )
        for each in judgement.replays
    ]
    head = html(
        "<tr><th>robot</th><th class='words'>method</th><th>{} missing [{} s]</th><th>power "
        "[W]</th>"
        "<th>short [s]</th></tr>",
        MOTIONS[lost],
        AXIS_UNITS[lost],
    )
    sentence = Markup(
        "<div class='said'><span class='given'>Green</span>: holds what was lost, at least "
        "power.</div>"
    )
    return html(
        "<div class='fl fl-timeline'><table class='methods'>{}{}</table>{}</div>",
        head,
        rows,
        sentence if judgement.held_by else "",
    )
