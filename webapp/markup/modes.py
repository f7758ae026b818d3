"""The modes of an answer as a table."""

from html import escape

from webapp.editables import press
from webapp.markup.words import error_digits, source_words, three_digits
from webapp.tasks.mode_names import Modes
from webapp.theme import css, mode_color


def mode_table(modes: Modes, searching: bool, shown: int) -> str:
    """Name and origin, error, power, effort and use of the limits of each mode.

    Args:
        modes: an answer's modes.
        searching: whether more may be found.
        shown: which mode moves the fins.
    """
    if not modes.shown:
        return "<div class='fl dim'>This method gives one answer and no candidates.</div>"
    rows = []
    for k, (mode, name) in enumerate(modes.shown):
        kind = "chosen" if k == shown else ""
        origin = f"<div class='dim'>{escape(source_words(mode.sources))}</div>"
        rows.append(
            f"<tr class='{kind} pick' {press('mode', str(k))} tabindex='0'><td>{_swatch(k)}</td>"
            f"<td class='words'>{escape(name)}{origin}</td>"
            f"<td>{error_digits(mode.err_norm)}</td><td>{three_digits(mode.power)}</td>"
            f"<td>{three_digits(mode.energy)}</td><td>{100 * mode.saturation:.0f} %</td></tr>"
        )
    header = (
        "<tr><th>#</th><th class='words'>mode</th><th>error [σ]</th><th>power&nbsp;[W]</th><th>effort</th>"
        "<th title='largest share of a range of amplitude or frequency that is used'>used</th></tr>"
    )
    left = modes.count - len(modes.shown)
    told = "looking for more …" if searching else f"{left} more are known; they come after these."
    more = f"<div class='said dim'>{told}</div>" if searching or left > 0 else ""
    return f"<div class='fl'><table class='modes'>{header}{''.join(rows)}</table>{more}</div>"


def _swatch(k: int) -> str:
    return f"<span class='swatch mode' style='border-color:{css(mode_color(k))}'>{k + 1}</span>"
