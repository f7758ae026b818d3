"""The table of an answer's distinct modes."""

from html import escape

from finlab.allocation.allocation import Candidates
from webapp.figures import small, three_digits
from webapp.markup.picking import pick
from webapp.modes import Mode
from webapp.theme import css, mode_color


def mode_table(candidates: Candidates | None, modes: tuple[Mode, ...], shown: int | None, picker: str) -> str:
    """Error, energy and a name for each mode.

    Args:
        candidates: the answer's candidates.
        modes: its modes.
        shown: which mode moves the fins, None while another command does.
        picker: class of the marker before the buttons that a click on a row presses.
    """
    if candidates is None or not modes:
        return "<div class='fl dim'>This method gives one answer and no candidates.</div>"
    rows = []
    for k, mode in enumerate(modes):
        kind = "chosen" if k == shown else ""
        several = f" <span class='dim'>×{mode.size}</span>" if mode.size > 1 else ""
        rows.append(
            f"<tr class='{kind} pick' {pick(picker, k)}><td>{_swatch(k)}</td>"
            f"<td class='words'>{escape(mode.name)}{several}</td>"
            f"<td>{small(float(candidates.err_norm[mode.index]))}</td>"
            f"<td>{three_digits(float(candidates.energy[mode.index]))}</td></tr>"
        )
    header = "<tr><th>#</th><th class='words'>mode</th><th>error [σ]</th><th>energy</th></tr>"
    return f"<div class='fl'><table class='modes'>{header}{''.join(rows)}</table></div>"


def _swatch(k: int) -> str:
    return f"<span class='swatch mode' style='background:{css(mode_color(k))}'>{k + 1}</span>"
