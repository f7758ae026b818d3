"""A log: what the robot could not, when, and what would have held it; each moment can be put on the
robot."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import viser
from markupsafe import Markup

from finlab.axes import MOTIONS, UNITS
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.log.judgement_text import (
    IMPULSE_COLUMNS,
    REPLAY_COSTS,
    REPLAY_NAMES,
    SPELL_COLUMNS,
    ImpulseRow,
    impulse_rows,
    judged_axis,
    missing_column,
)
from webapp.handles import add_html, button, placed, press, set_properties
from webapp.markup.plot import cost_axis, exact_axis, over_time
from webapp.markup.tables import cell_text, cells, head_row
from webapp.markup.words import html, in_app, marker, three_digits
from webapp.page import Page
from webapp.tasks.log_reading import SUFFIXES, worst_moment
from webapp.tasks.log_samples import SAMPLES
from webapp.theme import ASKED, DELIVERED, fin_color

if TYPE_CHECKING:
    from finlab.log import Judgement
    from finlab.log.judgement import Spell
    from finlab.log.judging import Progress

PLOTS_A_ROW = 4
"""Plots that stand beside each other in a window of usual width."""
INVITATION = (
    "Drop a log on the page: PX4 (.ulg), ArduSub (.bin, .tlog), a bag of ROS (.mcap, .db3, .bag), "
    "or a swim that was saved here (.npz). It is told when and on which axis the robot could not, "
    "and what would have held it."
)
"""What the tab says while there is no log."""
SAMPLE_WORDS = "None at hand? Open a sample, a dive of half a minute:"
"""What stands above the buttons of the samples."""
IMPROVED = "improved"
"""Robot of the replays on the improved layout."""
MIN_MOVE = 5e-4
"""Least distance [m], and least turn [rad], that counts as moved."""


def add_log(page: Page) -> None:
    """The file, by whose laws it is judged, and what came of it."""
    log = page.jobs.log
    gui = page.gui
    page.opening.add(SUFFIXES, log.open)
    add_html(gui, marker("fl-primary"))
    page.add_upload(
        "Open a log", page.opening.open, icon=viser.Icon.FOLDER_OPEN, mime_type=SUFFIXES
    )
    hint = (
        "Judge it by the robot of this page; else by the one that the log's own parameters "
        "describe."
    )
    by_page = gui.add_checkbox("By this page's robot", False, hint=hint)
    page.bind(by_page, log.choose_robot, lambda by_page: by_page)
    page.presses.on("sample", lambda key, _: log.open_sample(SAMPLES[placed(key, len(SAMPLES))]))
    page.presses.on("log-robot", lambda *_: log.jump(_moment_of(page)))
    page.presses.on("log-stop", lambda *_: log.stop())
    page.add_html(_summary)
    page.add_html(_whose_robot)
    page.add_html(moved_markup)
    improved = page.add_button(
        "Open the improved robot", partial(_open_improved, page), icon=viser.Icon.SPARKLES
    )
    page.board.show(
        improved, visible=lambda judgement: judgement is not None and judgement.improved is not None
    )


def _moment_of(page: Page) -> float:
    """The moment that was on the robot last, or else the worst one [s]."""
    log = page.jobs.log
    if log.moment is not None:
        return log.moment
    if log.shown is None:
        raise FinlabError("open a log first")
    return worst_moment(log.shown)


def _open_improved(page: Page) -> None:
    """The robot that would have held what the log's could not."""
    judgement = page.jobs.log.shown
    if judgement is not None and judgement.improved is not None:
        page.jobs.log.use(judgement.improved, f"Improved robot for {judgement.source}")


def _summary(
    judgement: "Judgement | None",
    judgement_stage: "Progress | str | None",
    judgement_error: str | None,
) -> str:
    """The judgement in a sentence, with its notes; why there is none, or how far it is."""
    progress = _progress_bar(judgement_stage)
    if judgement is None:
        if progress:
            return html("<div class='fl'>{}</div>", progress)
        sentence = html("<div>{}</div>", INVITATION)
        if judgement_error:
            sentence = html("<div class='missing'>{}</div>", in_app(judgement_error))
        return html("<div class='fl'>{}{}</div>", sentence, _sample_buttons())
    notes = []
    for note in (*judgement.asks, *judgement.notes):
        notes.append(html("<div class='said dim'>{}</div>", in_app(note)))
    # While methods are being asked nobody knows yet which of them would have held it.
    sentence = judgement.loss if progress else judgement.sentence
    return html(
        "<div class='fl'><b>{}</b><div class='said'>{}</div>{}{}</div>",
        judgement.source,
        sentence,
        progress,
        notes,
    )


def _sample_buttons() -> str:
    """A button for each sample."""
    buttons = []
    for k, sample in enumerate(SAMPLES):
        buttons.append(button(sample.words, "sample", str(k)))
    return html(
        "<div class='said dim'>{}</div><div class='fl-samples'>{}</div>", SAMPLE_WORDS, buttons
    )


def _progress_bar(stage: "Progress | str | None") -> str:
    """How far a judgement is, with a button that ends it; nothing while none is under way."""
    if stage is None:
        return ""
    if isinstance(stage, str):
        return html("<div class='dim'>{} …</div>", stage.capitalize())
    words = f"{stage.stage.capitalize()}: {stage.n_done} of {stage.n_parts}"
    bar = "<progress max='{}' value='{}' aria-label='{}'></progress>"
    return html(
        "<div class='fl-progress'><div class='dim'>{}</div>{}{}</div>",
        words,
        html(bar, stage.n_parts, stage.n_done, words),
        button("Stop here", "log-stop"),
    )


def _whose_robot(judgement: "Judgement | None", layout: Layout, swims: bool) -> str:
    """Whose robot is in the view, with a button that puts the log's there."""
    if judgement is None:
        return ""
    name = layout.name
    swim = "The swim waits in Simulate." if swims else ""
    if layout == judgement.robot:
        sentence = html("The view shows the robot of the log, {}; Undo brings back yours.", name)
        return html("<div class='fl said dim'>{} {}</div>", sentence, swim)
    if judgement.improved is not None and layout == judgement.improved:
        sentence = html("The view shows the improved robot, {}.", name)
    else:
        sentence = html("The view shows {}, not the robot of the log.", name)
    return html(
        "<div class='fl said'>{} {} <div class='fl-samples'>{}</div></div>",
        sentence,
        swim,
        button("Show the log's robot", "log-robot"),
    )


def moved_markup(judgement: "Judgement | None") -> str:
    """Where the actuators of the improved robot stand, as seen from where they were.

    Args:
        judgement: of the log; None while there is none.
    """
    if judgement is None or judgement.improved is None:
        return ""
    rows = []
    for before in judgement.robot.actuators:
        after = judgement.improved.actuator(before.name)
        step = np.subtract(after.position, before.position)
        turn = angle_between(before.direction, after.direction)
        if float(np.linalg.norm(step)) < MIN_MOVE and turn < MIN_MOVE:
            continue
        cells_of_row = [f"{way:+.3f}".replace("-", "−") for way in step]
        cells_of_row.append(f"{np.degrees(turn):.0f}°")
        figures = html("{}", [html("<td>{}</td>", cell) for cell in cells_of_row])
        rows.append(html("<tr><td><span class='name'>{}</span></td>{}</tr>", before.name, figures))
    head = "<tr><th>moved</th><th>x [m]</th><th>y</th><th>z</th><th>turned</th></tr>"
    n_kept = judgement.robot.n - len(rows)
    kept = f" {n_kept} stay as they are." if n_kept else ""
    return html(
        "<div class='fl'><div class='said'>The improved robot is {}.{}{}</div><table "
        "class='fins'>{}{}</table></div>",
        judgement.improved.name,
        _gain_words(judgement),
        kept,
        Markup(head),
        rows,
    )


def _gain_words(judgement: "Judgement") -> str:
    """What the improved robot misses and takes on the same demands, beside the log's own; nothing
    until both have been asked."""
    undamaged = [replay for replay in judgement.replays if replay.lost is None]
    of_improved = {replay.name: replay for replay in undamaged if replay.robot == IMPROVED}
    for before in undamaged:
        after = of_improved.get(before.name)
        if before.robot == IMPROVED or after is None:
            continue
        axis = judged_axis(judgement)
        missing = [three_digits(replay.missing[axis]) for replay in (after, before)]
        watts = [three_digits(replay.watts) for replay in (after, before)]
        return (
            f" By {before.name} it misses {missing[0]} {UNITS[axis]} s of {MOTIONS[axis]} where "
            f"the log's robot misses {missing[1]}, at {watts[0]} W, not {watts[1]} W."
        )
    return ""


def angle_between(one: Sequence[float], other: Sequence[float]) -> float:
    """Returns the angle between two directions (3,) [rad]."""
    across = float(np.linalg.norm(np.cross(one, other)))
    along = float(np.dot(one, other))
    return float(np.arctan2(across, along))


def add_losses(page: Page) -> None:
    """What was lost on each axis, and when; a spell that is pressed is put on the robot."""

    def jump(key: str, _modifier: str) -> None:
        judgement = page.jobs.log.shown
        spells = () if judgement is None else judgement.spells
        page.jobs.log.jump(spells[placed(key, len(spells))].start)

    page.presses.on("spell", jump)
    slider = page.gui.add_slider(
        "Moment [s]", 0.0, 1.0, 0.1, 0.0, hint="Which moment is on the robot."
    )
    page.on_change(slider, page.jobs.log.jump)

    def set_range(judgement: "Judgement | None", log_moment: float | None) -> None:
        set_properties(slider, visible=judgement is not None)
        if judgement is None:
            return
        start, end = judgement.timeline.time[[0, -1]].tolist()
        value = start if log_moment is None else log_moment
        # In the slider's own steps, or its ends are written with digits that say nothing.
        low = round(start, 1)
        high = max(round(end, 1), low + 0.1)
        set_properties(slider, max=high, min=low, value=min(max(round(value, 1), low), high))

    page.board.act(set_range, slider)
    page.add_html(_losses)


def _losses(judgement: "Judgement | None", log_moment: float | None) -> str:
    """Impulses of each axis, and spells in which something was lost; that of the moment on the
    robot is marked."""
    if judgement is None:
        return html(
            "<div class='fl dim'>{}</div>", "What was lost on each axis, and when, is listed here."
        )
    tables = []
    impulses = impulse_rows(judgement)
    if impulses:
        tables.append(_impulse_table(impulses))
    if judgement.spells:
        tables.append(_spell_table(judgement.spells, log_moment))
    return html("<div class='fl'>{}</div>", tables)


def _impulse_table(impulses: list[ImpulseRow]) -> str:
    """What each axis was asked for, what was missing of that, and for how long. The panel has no
    room for a column of units: they stand beside the names."""
    name, _unit, *figures = IMPULSE_COLUMNS
    rows = []
    for impulse in impulses:
        words = html("{} <span class='dim'>{}</span>", impulse.motion, impulse.unit)
        rows.append(html("<tr><td>{}</td>{}</tr>", words, cells(figures, impulse)))
    return html("<table>{}{}</table>", head_row((name, *figures)), rows)


def _spell_table(spells: Sequence["Spell"], log_moment: float | None) -> str:
    """A row for each time in which something was lost, which can be pressed."""
    rows = []
    for k, spell in enumerate(spells):
        is_chosen = log_moment is not None and spell.start <= log_moment <= spell.end
        style = "chosen" if is_chosen else ""
        target = press("spell", str(k))
        template = "<tr class='pick {}' tabindex='0' {}>{}</tr>"
        rows.append(html(template, style, target, cells(SPELL_COLUMNS, spell)))
    return html("<table>{}{}</table>", head_row(SPELL_COLUMNS), rows)


def plot_rows(judgement: "Judgement") -> int:
    """Rows that the plots of a log take, in a window of usual width."""
    return 1 if len(judgement.demanded_axes) < PLOTS_A_ROW else 2


def log_plots(judgement: "Judgement | None", log_moment: float | None) -> str:
    """Demand and what was delivered over time, of each axis that was asked for, and actuators at
    their limits.

    Args:
        judgement: of the log; None while there is none.
        log_moment: the moment that is on the robot [s], at which an upright line stands.
    """
    if judgement is None:
        return html(
            "<div class='fl dim fl-timeline'>{}</div>", "The log is plotted here over time."
        )
    timeline = judgement.timeline
    step = judgement.seconds / len(timeline.time)
    times: Any = np.append(timeline.time, timeline.time[-1] + step)
    across = exact_axis("time [s]", times)
    plots = []
    for k in judgement.demanded_axes:
        curves = [timeline.demand[:, k], timeline.given[:, k]]
        up = cost_axis(f"{MOTIONS[k]} [{UNITS[k]}]", np.append((-1e-3, 1e-3), curves), 4)
        colors = (ASKED, DELIVERED)
        words = ("asked", "given")
        plots.append(over_time(across, timeline.time, up, curves, colors, words, log_moment))
    shares = list(100.0 * timeline.limits.T)
    up = cost_axis("at a limit [%]", np.array((0.0, 100.0)), 4)
    fin_colors = [fin_color(k) for k in range(judgement.robot.n)]
    plots.append(over_time(across, timeline.time, up, shares, fin_colors, (), log_moment))
    return html("<div class='fl fl-timeline'>{}</div>", plots)


def replays_table(judgement: "Judgement | None") -> str:
    """The same demands asked of other methods and policies, with each actuator lost, of a better
    robot."""
    if judgement is None:
        return html(
            "<div class='fl dim'>{}</div>",
            "Other methods and policies are asked the log's demands here.",
        )
    # The drawer has room for one axis.
    axis = judged_axis(judgement)
    missing = replace(missing_column(axis), name=f"{MOTIONS[axis]} missing")
    columns = (*REPLAY_NAMES, missing, *REPLAY_COSTS)
    rows = []
    for replay in judgement.replays:
        style = "given" if replay == judgement.held_by else ""
        template = "<tr>{}<td class='{}'>{}</td>{}</tr>"
        names = cells(REPLAY_NAMES, replay)
        costs = cells(REPLAY_COSTS, replay)
        rows.append(html(template, names, style, cell_text(missing, replay), costs))
    head = head_row(columns)
    legend = Markup(
        "<div class='said'><span class='given'>Green</span>: holds what was lost, at least "
        "power.</div>"
    )
    return html(
        "<div class='fl fl-timeline'><table class='methods'>{}{}</table>{}</div>",
        head,
        rows,
        legend if judgement.held_by else "",
    )
