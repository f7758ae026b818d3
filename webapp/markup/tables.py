"""Tables of the library's columns, in the style of the page.

Results say which columns they have (`finlab.display.Column`), such as a score card in
`finlab/analysis/card_text.py`; the command line prints them, and the panels show them by this
module.
"""

from collections.abc import Iterable
from typing import Any

from finlab.display import NO_NUMBER, Column
from webapp.markup.words import DASH, html, without_powers


def head_row(columns: Iterable[Column]) -> str:
    """The row of the heads of some columns, with what they say in a tooltip."""
    heads = []
    for column in columns:
        style = "words" if column.is_text else ""
        heads.append(html("<th class='{}' title='{}'>{}</th>", style, column.hint, column.heading))
    return html("<tr>{}</tr>", heads)


def cells(columns: Iterable[Column], item: Any) -> str:
    """The cells of some columns in the row of an item."""
    markup = []
    for column in columns:
        style = "words" if column.is_text else ""
        markup.append(html("<td class='{}'>{}</td>", style, cell_text(column, item)))
    return html("{}", markup)


def cell_text(column: Column, item: Any) -> str:
    """The text of a cell; numbers have a real minus sign, SI prefixes where they are large, and a
    dash where there is none."""
    text = column.cell(item)
    if column.is_text:
        return text
    return DASH if text == NO_NUMBER else without_powers(text).replace("-", "−")
