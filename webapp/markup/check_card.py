"""The card of quick checks below the editor of a layout."""

from html import escape

import numpy as np

from finlab.layout import Layout
from webapp.checks import Checks
from webapp.markup.fins import swatch
from webapp.state import AXIS_UNITS, AXIS_WORDS


def check_card(layout: Layout, checks: Checks) -> str:
    """Reach of each axis, what the worst single failure leaves of it, and warnings."""
    rows = []
    for k, word in enumerate(AXIS_WORDS):
        if checks.reach[k] < 1e-6:
            rows.append(f"<tr><td>{word}</td><td colspan='3' class='missing'>no authority</td></tr>")
            continue
        loss = "<td>–</td><td></td>"
        if np.isfinite(checks.remaining[k]):
            name = checks.costliest[k]
            fin = swatch(layout.index(name)) if name else "any"
            loss = f"<td>{100 * checks.remaining[k]:.0f} %</td><td>{fin}</td>"
        rows.append(f"<tr><td>{word}</td><td>±{checks.reach[k]:.2f} {AXIS_UNITS[k]}</td>{loss}</tr>")
    header = "<tr><th>axis</th><th>largest alone</th><th>left after a loss of</th><th></th></tr>"
    number = f"{checks.condition:.0f}" if np.isfinite(checks.condition) else "∞"
    summary = f"<b>{checks.rank} of 6</b> axes independent, condition number {number}."
    warnings = "".join(f"<div class='missing'>{escape(text)}</div>" for text in checks.warnings)
    table = f"<table>{header}{''.join(rows)}</table>"
    return f"<div class='fl'><div class='said'>{summary}</div>{warnings}{table}</div>"
