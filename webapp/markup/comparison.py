"""The table of compared methods."""

import math

from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.allocation.judging import REACHED
from webapp.markup.html import html
from webapp.markup.verdict import verdict_of
from webapp.markup.words import error_digits, listed, objective_of, three_digits, unlearned_sentence
from webapp.presses import press
from webapp.session.state import COMPARED
from webapp.tasks.comparison import Comparison
from webapp.theme import NEARLY, css

ERRORS = (1e-12, 10.0)
"""Errors [σ] at both ends of their bars."""
TIMES = (0.01, 1000.0)
"""Times [ms] at both ends of their bars."""


def comparison_table(comparison: Comparison, shown: str | None, stale: bool) -> str:
    """Error, power, effort and time of each method; the one whose arrows are shown is marked."""
    if comparison.state is None:
        return Markup(
            "<div class='fl dim'>Several methods on the same wrench: error, power, effort, time side by side."
            "</div>"
        )
    rows, others = [], []
    in_reach = any(
        isinstance(answer, Allocation) and answer.reachable for answer in comparison.answers.values()
    )
    for method in COMPARED:
        answer = comparison.answers.get(method)
        if isinstance(answer, Allocation) and answer.unknown_fins:
            words = unlearned_sentence(answer.layout, answer.unknown_fins)
            cells = html("<td colspan='4' class='words missing'>{}</td>", words)
        elif isinstance(answer, Allocation):
            color = css(verdict_of(answer, in_reach).color)
            cells = html(
                "<td>{}{}</td><td>{}</td><td>{}</td><td>{}{}</td>",
                error_digits(answer.err_norm),
                _bar(answer.err_norm, ERRORS, color),
                three_digits(answer.power),
                three_digits(answer.energy),
                three_digits(answer.solve_ms),
                _bar(answer.solve_ms, TIMES, "currentColor"),
            )
        else:
            cells = html("<td colspan='4' class='words dim'>{}</td>", "…" if answer is None else answer)
        if isinstance(answer, Allocation) and objective_of(answer) != comparison.state.objective:
            others.append(method)
        kind = "chosen" if method == shown else ""
        rows.append(
            html(
                "<tr class='{} pick' {} tabindex='0'><td>{}</td>{}</tr>",
                kind,
                press("overlay", method),
                method,
                cells,
            )
        )
    header = Markup(
        "<tr><th>method</th><th>error [σ]</th><th>power [W]</th><th>effort</th><th>time [ms]</th></tr>"
    )
    kept = f"Kept least: {comparison.state.objective}"
    if others:
        kept += f"; {listed(others)} keep{'s' * (len(others) == 1)} effort least whatever is asked"
    said = html(
        "<div class='said'><span class='given'>Green</span>: exact, up to {} σ. <span "
        "style='color:{}'>Ochre</span>: approximate, another method is exact. <span "
        "class='missing'>Orange</span>: out of reach of all. Bars are logarithmic. {}. "
        "Press a method to lay its forces over those of the robot; again, and they go.</div>",
        REACHED,
        css(NEARLY),
        kept,
    )
    note = (
        Markup("<div class='missing'>The question has changed since; compare again.</div>") if stale else ""
    )
    body = Markup().join(rows)
    return html("<div class='fl'><table class='methods'>{}{}</table>{}{}</div>", header, body, said, note)


def _bar(value: float, ends: tuple[float, float], color: str) -> str:
    """A thin bar under a number, as long as its logarithm between two ends."""
    low, high = (math.log10(end) for end in ends)
    share = (math.log10(max(value, ends[0])) - low) / (high - low)
    return html(
        "<span class='log'><i style='width:{:.0f}%;background:{}'></i></span>", 100 * min(share, 1.0), color
    )
