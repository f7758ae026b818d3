"""The modes of an answer as a table."""

from markupsafe import Markup

from webapp.markup.html import html
from webapp.markup.words import error_digits, source_words, three_digits
from webapp.presses import press
from webapp.tasks.mode_names import Modes
from webapp.theme import css, mode_color


def mode_table(modes: Modes, searching: bool, mode: int) -> str:
    """Name and origin, error, power, effort and use of the limits of each mode.

    Args:
        modes: an answer's modes.
        searching: whether more may be found.
        mode: which of them moves the fins.
    """
    if not modes.shown:
        return ""
    rows = []
    for k, (way, name) in enumerate(modes.shown):
        kind = "chosen" if k == mode else ""
        origin = html("<div class='dim'>{}</div>", source_words(way.sources))
        rows.append(
            html(
                "<tr class='{} pick' {} tabindex='0'><td>{}</td><td class='words'>{}{}</td><td>{}"
                "</td><td>{}</td><td>{}</td><td>{:.0f} %</td></tr>",
                kind,
                press("mode", str(k)),
                _swatch(k),
                name,
                origin,
                error_digits(way.err_norm),
                three_digits(way.power),
                three_digits(way.effort),
                100 * way.saturation,
            )
        )
    header = Markup(
        "<tr><th>#</th><th class='words'>mode</th><th>error</th><th>power&nbsp;[W]</th><th>effort</th>"
        "<th title='largest share of a range of amplitude or frequency that is used'>used</th></tr>"
    )
    left = modes.count - len(modes.shown)
    told = "looking for more …" if searching else f"{left} more are known; they come after these."
    more = html("<div class='said dim'>{}</div>", told) if searching or left > 0 else ""
    return html("<div class='fl'><table class='modes'>{}{}</table>{}</div>", header, rows, more)


def _swatch(k: int) -> str:
    return html("<span class='swatch mode' style='border-color:{}'>{}</span>", css(mode_color(k)), k + 1)
