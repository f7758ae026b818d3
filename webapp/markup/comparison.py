"""The table of compared methods."""

from html import escape

from finlab.allocation.allocation import Allocation
from webapp.comparison import COMPARED, Comparison
from webapp.figures import small, three_digits
from webapp.markup.picking import pick


def comparison_table(comparison: Comparison, shown: str | None, stale: bool, picker: str) -> str:
    """Error, energy and time of each method; the one whose arrows are shown is marked."""
    if comparison.state is None:
        return (
            "<div class='fl dim'>Several methods on the same wrench: error, energy, time side by side.</div>"
        )
    rows = []
    for k, method in enumerate(COMPARED):
        answer = comparison.answers.get(method)
        if isinstance(answer, Allocation):
            cells = (
                f"<td>{small(answer.err_norm)}</td><td>{three_digits(answer.energy)}</td>"
                f"<td>{three_digits(answer.solve_ms)}</td>"
            )
        else:
            cells = f"<td colspan='3' class='words dim'>{'…' if answer is None else escape(answer)}</td>"
        kind = "chosen" if method == shown else ""
        rows.append(f"<tr class='{kind} pick' {pick(picker, k + 1)}><td>{method}</td>{cells}</tr>")
    header = "<tr><th>method</th><th>error [σ]</th><th>energy</th><th>time [ms]</th></tr>"
    note = "<div class='missing'>The question has changed since; compare again.</div>" if stale else ""
    body = "".join(rows)
    return f"<div class='fl'><table class='methods'>{header}{body}</table>{note}</div>"
