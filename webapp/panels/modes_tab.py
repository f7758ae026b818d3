"""Several answers to one wrench: its modes and where they come from, and those of other methods."""

import math
from functools import partial

import numpy as np
import viser
from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.physics.objective import REACHED
from finlab.research.mdn.method import TRACE_STEPS
from webapp.handles import add_html, placed, press
from webapp.markup.mode_plot import mode_plot
from webapp.markup.refinement import step_words, vain_sentence
from webapp.markup.verdict import Verdict, verdict_of
from webapp.markup.words import (
    error_digits,
    html,
    in_app,
    marker,
    source_words,
    three_digits,
    time_digits,
    unlearned_sentence,
)
from webapp.page import Page
from webapp.session.state import DRAWING, State, least_of
from webapp.tasks.comparing import Run
from webapp.tasks.solver import Modes
from webapp.theme import MODE_COLORS, css

BEYOND = (
    "This wrench is out of reach, so the network is not asked: there is one answer, by policy {}."
)
NOTHING = "No wrench is asked for, so there is nothing to share among the fins."
LEARNED = (
    "The paper's network draws samples; the best are refined by Adam on learned physics, which "
    "errs."
)
PROPOSED = (
    "The network proposes ways to share the wrench, drawn from its mixture; each is refined to "
    "the least effort near it and made exact by the fins' own laws."
)
IN_VAIN = (
    "The network proposes ways to share the wrench, drawn from its mixture. Each was refined, and "
    "none became exact, so only the answer is listed."
)
BESIDE = {
    "dual": " The answer, number 1, keeps watts least, and needs no network.",
    "mdn": " The answer, number 1, is the cheapest of them.",
}
ROW = (
    "<tr class='{} pick' {} tabindex='0'><td><span class='swatch mode' "
    "style='border-color:{}'>{}</span></td>"
    "<td class='words'>{}<div><span class='badge {}'>{}</span> <span "
    "class='dim'>{}</span></div></td>"
    "<td class='{}'>{}</td><td>{}</td>"
)
EFFORT = "<td>{}</td>"
PLOT_PX = 152
"""Height of the plot [px]."""


def add_candidates(page: Page) -> None:
    """Plot and table, the refinement as a picture, and how widely the mixture is drawn from."""
    session = page.session
    gui = page.gui
    jobs = page.jobs
    board = page.board
    page.add_html(lambda modes, mode, step: mode_plot(modes, mode, step, PLOT_PX))

    def choose(key: str, _modifier: str) -> None:
        session.show_mode(
            placed(key, 0 if jobs.answering.searching else len(jobs.answering.modes.visible))
        )

    page.presses.on("mode", choose)
    page.presses.on("play", lambda _key, _modifier: jobs.refining.toggle())
    page.presses.on("loop", lambda _key, _modifier: session.set_loop(not session.loops))
    page.add_html(_player)
    hint = "How many steps of refinement the samples have had, in the plot and on the robot."
    slider = gui.add_slider("Step", 0, TRACE_STEPS.steps, 1, TRACE_STEPS.steps, hint=hint)
    page.bind(slider, jobs.refining.hold, lambda step, modes: modes.steps if step is None else step)
    board.show(slider, visible=lambda modes: modes.steps > 0)
    add_html(gui, marker("fl-column"))
    hint = "How far samples stray from the means of the mixture's components: 0 is the means alone."
    warmth = gui.add_slider("Temperature", 0.0, 2.0, 0.01, 0.0, hint=hint)
    page.bind_number(warmth, partial(session.set_setting, "temperature"), _temperature)
    board.show(warmth, visible=lambda modes: bool(modes.refinement))
    solver = page.solver
    hint = "What method paper answers with: the shipped network, or one trained in runs."
    networks = gui.add_dropdown("Network", tuple(solver.networks()), hint=hint)
    page.bind(
        networks,
        partial(session.set_setting, "network"),
        lambda network: network or solver.first_network,
    )
    board.show(networks, visible=lambda method: method == "paper")
    page.add_html(_listed)
    add_saving(page)
    page.add_html(_origin_words)


def _listed(modes: Modes, mode: int, searching: bool) -> str:
    """The table; the drawer is dimmed (`habits.js`) while what it shows belongs to an earlier
    question."""
    asking = "asking" if searching else ""
    return html("<div class='fl-modes {}'>{}</div>", asking, mode_table(modes, mode))


def add_saving(page: Page) -> None:
    """The ways as a file."""

    def save() -> None:
        best = page.jobs.answering.shown_answer().best
        modes = page.jobs.answering.modes
        if best is not None and modes.visible and not page.jobs.answering.searching:
            page.designs.save_modes(best, modes)

    button = page.add_button(
        "Save as CSV",
        save,
        icon=viser.Icon.DOWNLOAD,
        hint="All candidates: error, watts, and the command and force of each actuator.",
    )
    page.board.show(button, disabled=lambda modes: not modes.visible)


def _temperature(state: State) -> float:
    default_temperature = DRAWING.get(state.method, DRAWING["mdn"]).temperature
    return default_temperature if state.temperature is None else state.temperature


def _player(modes: Modes, step: int | None, playing: bool, loops: bool) -> str:
    """Buttons that play the refinement, what its present step has made of the samples, and why none
    of them gives the wrench where that is so."""
    if not modes.steps:
        return ""
    why = vain_sentence(modes) if modes.is_in_vain else ""
    play = ("❚❚", "Pause") if playing else ("▶", "Play")
    row = (
        "<div class='fl fl-player'><button {} title='let the samples travel to where they end'>{} "
        "{}</button>"
        "<button {} aria-pressed='{}' title='begin anew at the "
        "end'>Loop</button><span>{}</span></div>{}"
    )
    return html(
        row,
        press("play", ""),
        *play,
        press("loop", ""),
        str(loops).lower(),
        step_words(modes, step),
        why,
    )


def _origin_words(method: str, best: Allocation | None, in_reach: bool, modes: Modes) -> str:
    """Where the answer and its modes come from, or why there is but one."""
    sentence = LEARNED
    if method != "paper":
        aside = BESIDE.get(method, f" The answer, number 1, is that of method {method}.")
        sentence = IN_VAIN if modes.is_in_vain else PROPOSED + aside
        if best is not None and not in_reach:
            sentence = BEYOND.format(best.policy.kind)
        elif best is not None and not np.nan_to_num(best.target).any():
            sentence = NOTHING
    return html("<div class='fl dim'>{}</div>", sentence)


def mode_table(modes: Modes, mode: int) -> str:
    """Name and origin, error, power, effort and use of the limits of each mode; `mode` moves the
    fins."""
    if not modes.visible:
        return ""
    of_fins = any([not math.isnan(named.mode.effort) for named in modes.visible])
    rows = []
    for k, (candidate, name, badge) in enumerate(modes.visible):
        rows.append(
            html(
                ROW + (EFFORT if of_fins else "") + "<td>{:.0f} %</td></tr>",
                "chosen" if k == mode else "",
                press("mode", str(k)),
                css(MODE_COLORS[k]),
                k + 1,
                name,
                badge,
                badge,
                source_words(candidate.sources),
                "missing" if candidate.err_norm > REACHED else "",
                error_digits(candidate.err_norm),
                three_digits(candidate.power),
                *([three_digits(candidate.effort)] if of_fins else []),
                100 * candidate.saturation,
            )
        )
    header = html(
        "<tr><th>#</th><th class='words'>mode</th><th>error</th><th>power&nbsp;[W]</th>{}"
        "<th title='largest share that an actuator uses: a fin of its range of amplitude or "
        "frequency, another one of its full thrust'>used</th></tr>",
        Markup("<th>effort</th>" * of_fins),
    )
    remaining = modes.count - len(modes.visible)
    remark = f"{remaining} more are known; they come after these."
    remark_html = html("<div class='said dim'>{}</div>", remark) if remaining > 0 else ""
    return html(
        "<div class='fl'><table class='modes'>{}{}</table>{}</div>", header, rows, remark_html
    )


KINDS = {Verdict.EXACT: "given", Verdict.APPROXIMATE: "near", Verdict.OUT_OF_REACH: "missing"}


def add_comparison(page: Page) -> None:
    """A button and a table."""
    add_html(page.gui, marker("fl-primary"))
    run = page.add_button(
        "Compare the methods",
        lambda: page.jobs.comparison.start(page.session.state),
        icon=viser.Icon.SCALE,
        hint="For the present wrench and failures.",
    )
    page.board.show(run, disabled=lambda run: run.running)
    about = "The answers so far stay."
    cancel = page.add_button("Cancel", page.jobs.comparison.cancel, icon=viser.Icon.X, hint=about)
    page.board.show(cancel, visible=lambda run: run.running)
    add_html(page.gui, marker("fl-column"))
    page.add_html(lambda run, state: comparison_table(run, run.answers_other_than(state)))


LEFT_OUT = {
    "policy:": "knows policy closest alone",
    "of thrusters only": "is for thrusters alone",
    "with a mounting angle only": "is for level shafts",
    "of fins only": "is for fins alone",
    "CasADi": "CasADi is not installed",
    "checkpoint": "has no network here",
    "flow": "knows no moving water",
    "power:": "keeps no power budget",
}
"""Words of the reason why a method has no answer -> what the table says of it, in four words."""
NO_ANSWER = "has no answer here"
"""What it says of any other reason."""


def why_left_out(reason: str) -> str:
    """Why a method has no answer, in four words; its row's hint has the whole `reason`."""
    for word, words in LEFT_OUT.items():
        if word in reason:
            return words
    return NO_ANSWER


def comparison_table(run: Run, stale: bool) -> str:
    """Error, power, effort and time of each method."""
    if run.state is None:
        return Markup(
            "<div class='fl dim'>Several methods on the same wrench: error, power, effort, time "
            "side by side."
            "</div>"
        )
    rows = []
    answers = dict(run.answers)
    in_reach = any(
        isinstance(answer, Allocation) and answer.reachable for answer in answers.values()
    )
    for method in run.methods:
        answer = answers.get(method)
        if isinstance(answer, Allocation) and answer.unknown_fins:
            words = unlearned_sentence(answer.layout, answer.unknown_fins)
            cells = html("<td colspan='4' class='words missing'>{}</td>", words)
        elif isinstance(answer, Allocation):
            figures = (
                three_digits(answer.power),
                three_digits(answer.effort),
                time_digits(answer.solve_ms),
            )
            kind = KINDS[verdict_of(answer, in_reach)]
            error = html("<td class='{}'>{}</td>", kind, error_digits(answer.err_norm))
            cells = error + Markup().join(html("<td>{}</td>", text) for text in figures)
        elif isinstance(answer, str):
            template = "<td colspan='4' class='words dim' title='{}'>{}</td>"
            cells = html(template, in_app(answer), why_left_out(answer))
        else:
            waiting = "…" if run.running else "–"
            cells = html("<td colspan='4' class='words dim'>{}</td>", waiting)
        rows.append(html("<tr><td>{}</td><td>{}</td>{}</tr>", method, least_of(method), cells))
    header = Markup(
        "<tr><th>method</th><th>least</th><th>error</th><th>power [W]</th><th>effort</th><th>time "
        "[ms]</th>"
        "</tr>"
    )
    colors = html(
        "<div class='said'><span class='given'>Green</span>: exact, an error of at most {}. <span "
        "class='near'>Ochre</span>: approximate, another method is exact. <span "
        "class='missing'>Orange</span>: out of reach of all. In reach policies are alike.</div>",
        REACHED,
    )
    note = (
        Markup("<div class='missing'>The question has changed since; compare again.</div>")
        if stale
        else ""
    )
    body = Markup().join(rows)
    return html(
        "<div class='fl'><table class='methods'>{}{}</table>{}{}</div>", header, body, colors, note
    )
