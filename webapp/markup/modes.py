"""The table of an answer's distinct candidates."""

from html import escape

from finlab.allocation.allocation import Candidates
from webapp.words import mode_names

MOST_ROWS = 8
"""Candidates that are listed."""


def mode_table(candidates: Candidates | None, shown: int) -> str:
    """Error, energy and a name for each candidate; the shown one is marked."""
    if candidates is None or len(candidates.energy) == 0:
        return "<div class='fl dim'>This method gives one answer and no candidates.</div>"
    rows = []
    for k, name in enumerate(mode_names(candidates)[:MOST_ROWS]):
        kind = "chosen" if k == shown else ""
        rows.append(
            f"<tr class='{kind}'><td>{k + 1}</td><td class='words'>{escape(name)}</td>"
            f"<td>{_error(candidates.err_norm[k])}</td><td>{candidates.energy[k]:.3f}</td></tr>"
        )
    header = "<tr><th>#</th><th class='words'>mode</th><th>error</th><th>energy</th></tr>"
    return f"<div class='fl'><table class='modes'>{header}{''.join(rows)}</table></div>"


def _error(value: float) -> str:
    return f"{value:.4f}" if value >= 5e-5 else "0.0000"
