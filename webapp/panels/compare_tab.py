"""Several methods on the same wrench."""

import viser
from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.allocation.yardstick import REACHED
from webapp.handles import add_html
from webapp.markup.html import html, marker
from webapp.markup.verdict import Verdict, verdict_of
from webapp.markup.words import error_digits, three_digits, unlearned_sentence
from webapp.page import Page
from webapp.session.state import least_of
from webapp.tasks.comparison import Run

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
    page.add_html(lambda run, state: comparison_table(run, run.state not in (None, state)))


def comparison_table(run: Run, stale: bool) -> str:
    """Error, power, effort and time of each method."""
    if run.state is None:
        return Markup(
            "<div class='fl dim'>Several methods on the same wrench: error, power, effort, time side by side."
            "</div>"
        )
    rows = []
    answers = dict(run.answers)
    in_reach = any(isinstance(answer, Allocation) and answer.reachable for answer in answers.values())
    for method in run.methods:
        answer = answers.get(method)
        if isinstance(answer, Allocation) and answer.unknown_fins:
            words = unlearned_sentence(answer.layout, answer.unknown_fins)
            cells = html("<td colspan='4' class='words missing'>{}</td>", words)
        elif isinstance(answer, Allocation):
            figures = (answer.power, answer.effort, answer.solve_ms)
            kind = KINDS[verdict_of(answer, in_reach)]
            error = html("<td class='{}'>{}</td>", kind, error_digits(answer.err_norm))
            cells = error + Markup().join(html("<td>{}</td>", three_digits(value)) for value in figures)
        else:
            cells = html("<td colspan='4' class='words dim'>{}</td>", answer or ("…" if run.running else "–"))
        rows.append(html("<tr><td>{}</td><td>{}</td>{}</tr>", method, least_of(method), cells))
    header = Markup(
        "<tr><th>method</th><th>least</th><th>error</th><th>power [W]</th><th>effort</th><th>time [ms]</th>"
        "</tr>"
    )
    said = html(
        "<div class='said'><span class='given'>Green</span>: exact, an error of at most {}. <span "
        "class='near'>Ochre</span>: approximate, another method is exact. <span "
        "class='missing'>Orange</span>: out of reach of all.</div>",
        REACHED,
    )
    note = (
        Markup("<div class='missing'>The question has changed since; compare again.</div>") if stale else ""
    )
    body = Markup().join(rows)
    return html("<div class='fl'><table class='methods'>{}{}</table>{}{}</div>", header, body, said, note)
