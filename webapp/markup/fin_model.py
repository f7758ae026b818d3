"""What a fin is known by, in words: a law with its numbers, or a table and what it is worth."""

import math

from finlab.actuators.fin.table import TableLaw
from finlab.actuators.fin.table_file import DOUBT
from finlab.errors import DataError
from finlab.layout.fin import Fin, FinModelSpec
from finlab.physics import make_law
from webapp.markup.html import html

BEYOND = 0.01
"""Amplitude [rad] or frequency [Hz] by which limits may lie beyond a table without a word."""
LAWS = {
    "drag": "a stiff blade in quasi-steady drag (U-CAT's own law)",
    "lighthill": "a fin after Lighthill's elongated-body theory",
    "soft": "a soft fin that saturates, then declines",
}
"""Fin models with a formula, in words."""


def model_card(fin: Fin, doubts: bool = True) -> str:
    """The model of a fin; without `doubts` where they stand elsewhere already."""
    words = _table_words(fin, doubts) if fin.model.type == "table" else _law_words(fin.model)
    return html("<div class='fl'>{}</div>", words)


def _law_words(model: FinModelSpec) -> str:
    said = LAWS[model.type]
    return html("<div class='dim'>{}{}.</div>", said[0].upper(), said[1:])


def _table_words(fin: Fin, doubts: bool) -> str:
    try:
        law = make_law(fin.model)
    except DataError as error:
        return html("<b>table</b>: <span class='missing'>{}</span>", str(error))
    assert isinstance(law, TableLaw)
    (low_a, high_a), (low_f, high_f), (low_d, high_d) = law.covers
    turn = "all round" if law.periodic else f"from {math.degrees(low_d):.0f}° to {math.degrees(high_d):.0f}°"
    covers = f"A {low_a:.2f} to {high_a:.2f} rad, f {low_f:.2f} to {high_f:.2f} Hz, {turn}"
    power = "with the power that was measured" if law.has_power else "power as of U-CAT's fin"
    doubt = next((note for note in law.notes if note.startswith(DOUBT)), None)
    said = "" if doubt is None or not doubts else html("<div class='missing'>This fin is {}.</div>", doubt)
    if fin.limits.amplitude[1] > high_a + BEYOND or fin.limits.frequency[1] > high_f + BEYOND:
        most_a, most_f = fin.limits.amplitude[1], fin.limits.frequency[1]
        said += html(
            "<div class='missing'>The fin may be asked for {:.2f} rad and {:.2f} Hz: beyond "
            "what was measured the force counts as at the edge.</div>",
            most_a,
            most_f,
        )
    fitted = next((note for note in law.notes if note.startswith("fitted to ")), None)
    origin = f", {fitted.split(',')[0]}" if fitted else " of forces"
    return html("<b>table</b>{}.{}<div class='dim'>{}; {}.</div>", origin, said, covers, power)
