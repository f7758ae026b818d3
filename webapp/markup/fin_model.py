"""What a fin is known by, in words: a law with its numbers, or a table and what it is worth."""

import math
from html import escape

from finlab.errors import DataError
from finlab.layout.fin import Fin, FinModelSpec
from finlab.physics import make_law
from finlab.physics.table import TableLaw
from finlab.physics.table_file import DOUBT

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
    return f"<div class='fl'>{words}</div>"


def _law_words(model: FinModelSpec) -> str:
    said = LAWS[model.type]
    return f"<div class='dim'>{said[0].upper()}{said[1:]}.</div>"


def _table_words(fin: Fin, doubts: bool) -> str:
    try:
        law = make_law(fin.model)
    except DataError as error:
        return f"<b>table</b>: <span class='missing'>{escape(str(error))}</span>"
    assert isinstance(law, TableLaw)
    (low_a, high_a), (low_f, high_f), (low_d, high_d) = law.covers
    turn = "all round" if law.periodic else f"from {math.degrees(low_d):.0f}° to {math.degrees(high_d):.0f}°"
    covers = f"A {low_a:.2f} to {high_a:.2f} rad, f {low_f:.2f} to {high_f:.2f} Hz, {turn}"
    power = "with the power that was measured" if law.has_power else "power as of U-CAT's fin"
    doubt = next((note for note in law.notes if note.startswith(DOUBT)), None)
    said = "" if doubt is None or not doubts else f"<div class='missing'>This fin is {escape(doubt)}.</div>"
    if fin.limits.amplitude[1] > high_a + BEYOND or fin.limits.frequency[1] > high_f + BEYOND:
        most_a, most_f = fin.limits.amplitude[1], fin.limits.frequency[1]
        said += (
            f"<div class='missing'>The fin may be asked for {most_a:.2f} rad and {most_f:.2f} Hz: beyond "
            "what was measured the force counts as at the edge.</div>"
        )
    fitted = next((note for note in law.notes if note.startswith("fitted to ")), None)
    origin = f", {escape(fitted.split(',')[0])}" if fitted else " of forces"
    return f"<b>table</b>{origin}.{said}<div class='dim'>{covers}; {power}.</div>"
