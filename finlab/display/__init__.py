"""Shows values: tables and sentences as plain text, and as HTML with a picture for notebooks.

Layouts, score cards and answers make blocks of text and tables; `pictures` draws.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, NamedTuple

from finlab.assets import install_command

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Table(NamedTuple):
    """A table of texts."""

    head: Sequence[str]
    """Names of the columns."""
    rows: Sequence[Sequence[str]]
    """Cells, row by row."""
    words: Sequence[bool]
    """Whether each column holds words, which are aligned to the left; numbers are to the right."""
    title: str = ""
    """A line above the table."""


Block = Table | str
"""A table, or lines of text."""


def text(blocks: Iterable[Block]) -> str:
    """Returns blocks as plain text, with an empty line between them."""
    return "\n\n".join(map(_text, blocks))


def _text(block: Block) -> str:
    """A block as plain text."""
    if isinstance(block, str):
        return block
    table = aligned(block.head, block.rows, block.words)
    return f"{block.title}\n{table}" if block.title else table


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool]) -> str:
    """Returns a table as plain text, its cells padded with spaces.

    Args:
        head: names of the columns.
        rows: cells, row by row.
        words: whether each column is aligned to the left.
    """
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        columns = zip(cells, widths, words, strict=True)
        return "  ".join(
            cell.ljust(width) if is_words else cell.rjust(width)
            for cell, width, is_words in columns
        ).rstrip()

    return "\n".join(map(line, [head, *rows]))


def html(blocks: Iterable[Block], picture: Callable[[], Figure]) -> str:
    """Returns blocks as HTML, with a picture as PNG inside it, or how to install matplotlib.

    Names in blocks may come from a stranger: all text is escaped.

    Args:
        blocks: texts and tables.
        picture: draws the picture.
    """
    return "".join([*map(_html, blocks), _image(picture)])


def _html(block: Block) -> str:
    """A block as HTML."""
    if isinstance(block, str):
        return f"<p>{escape(block)}</p>".replace("\n", "<br>")
    sides = ["left" if words else "right" for words in block.words]
    title = f"<caption>{escape(block.title)}</caption>" if block.title else ""
    lines = [_row("th", block.head, sides), *(_row("td", row, sides) for row in block.rows)]
    return f"<table>{title}{''.join(lines)}</table>"


def _row(tag: str, cells: Sequence[str], sides: Sequence[str]) -> str:
    row = zip(cells, sides, strict=True)
    cells_html = (f"<{tag} style='text-align:{side}'>{escape(cell)}</{tag}>" for cell, side in row)
    return f"<tr>{''.join(cells_html)}</tr>"


def _image(picture: Callable[[], Figure]) -> str:
    from finlab.display.figures import figure_bytes

    try:
        content = b64encode(figure_bytes(picture, "png")).decode()
    except ImportError:
        return _html(f"A picture needs matplotlib; run: {install_command('plot')}")
    return f"<img alt='picture' src='data:image/png;base64,{content}'>"
