"""The presenting view: the robot, one sentence, and the candidates, in large type; its other half
is `presenting.js`."""

import json

from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.allocation.report import is_proved_least, missing_words
from finlab.display import as_sentence
from webapp.handles import button
from webapp.markup.mode_plot import mode_plot
from webapp.markup.refinement import step_words, vain_sentence, wrench_words
from webapp.markup.verdict import WORKING, Verdict, verdict_of, verdict_sentence
from webapp.markup.words import html, three_digits
from webapp.page import Page
from webapp.session.looking import Display
from webapp.session.state import State
from webapp.tasks.solver import Modes
from webapp.viser_internals import run_file, run_script

PLOT_PX = 250
"""Height of the plot beside a width of 400 [px]; it is drawn as wide as there is room."""
STYLES = {
    Verdict.EXACT: "given",
    Verdict.APPROXIMATE: "near",
    Verdict.UNLEARNED: "near",
    Verdict.OUT_OF_REACH: "missing",
}
"""Verdict -> style class of its sentence."""
KEY = "presents"
"""Field of `Display` that says whether a page presents."""


def add_presenting(page: Page) -> None:
    """Let a page present what it shows."""
    session = page.session
    run_file(page.gui, "presenting.js")

    def fail(error: Exception | None) -> None:
        if error is not None and session.display.presents:
            session.set_display(KEY, False)

    def show(display: Display) -> None:
        presented.is_visible = display.presents
        run_script(page.gui, f"finlabPresenting.show({json.dumps(display.presents)});")

    page.board.group()
    page.board.act(show)
    presented = page.board.group(fail)  # made while it can be seen
    page.add_html(_presented)
    page.presses.on("present", lambda key, _: session.set_display(KEY, key == "on"), looks=True)


def begin_presenting(page: Page) -> None:
    """Let the browser say whether its address asks for it; called when it can be heard."""
    run_script(page.gui, "finlabPresenting.begin();")


def _presented(
    state: State,
    shown_allocation: Allocation | None,
    busy: bool,
    in_reach: bool,
    modes: Modes,
    mode: int,
    step: int | None,
    searching: bool,
) -> str:
    """What stands beside the robot."""
    answer = None if busy else shown_allocation
    plot = presented_plot(modes, mode, step) if not searching else Markup()
    leave = button("Leave (Esc)", "present", "off", Markup("class='leave'"))
    template = "<div class='fl fl-present'>{}<h1>{}</h1>{}{}</div>"
    return html(template, leave, state.layout.name, presented_words(answer, in_reach), plot)


def presented_words(answer: Allocation | None, in_reach: bool) -> str:
    """The verdict as one sentence, with what is asked and what it takes.

    Args:
        answer: what is on the robot; None while there is none.
        in_reach: whether any command of what works gives what is asked.
    """
    if answer is None:
        return html("<p class='sentence'>{}</p>", WORKING)
    asked = wrench_words(answer.target) or "nothing"
    verdict = verdict_of(answer, in_reach)
    if verdict is Verdict.EXACT:
        is_least = is_proved_least(answer)
        least = ", and no less would do" if is_least else ""
        words = f"The robot gives it with {three_digits(answer.power)} W{least}."
    else:
        missing = "" if answer.reachable else f" {as_sentence(missing_words(answer))}"
        words = f"{as_sentence(verdict_sentence(answer, in_reach))}{missing}"
    template = "<p>Asked: <b class='asked'>{}</b></p><p class='sentence {}' role='status'>{}</p>"
    return html(template, asked, STYLES[verdict], words)


def presented_plot(modes: Modes, mode: int, step: int | None) -> str:
    """The candidates, and what has become of the network's samples; arguments as for
    `mode_plot`."""
    plot = mode_plot(modes, mode, step, PLOT_PX)
    if not plot:
        return Markup()
    if modes.is_in_vain:
        words = vain_sentence(modes)
    elif modes.steps:
        words = html("<p class='dim'>{}</p>", step_words(modes, step))
    else:
        words = Markup()
    return html("{}{}", Markup(plot), words)
