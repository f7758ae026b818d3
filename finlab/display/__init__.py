"""Tables and sentences as plain text, and as HTML with a picture for notebooks."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, NamedTuple

from finlab.assets import install

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Table(NamedTuple):
    """Cells under a head."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Sequence[bool]
    """Which columns are words, to the left; the others are numbers, to the right."""
    title: str = ""


Block = Table | str
"""A table, or lines of text."""


def text(blocks: Iterable[Block]) -> str:
    """Returns blocks as plain text, with an empty line between them."""
    return "\n\n".join(map(_text, blocks))


def _text(block: Block) -> str:
    if isinstance(block, str):
        return block
    table = aligned(block.head, block.rows, block.words)
    return f"{block.title}\n{table}" if block.title else table


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[bool]) -> str:
    """Cells under a head, padded with spaces: columns of words to the left, others to the right."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        each = zip(cells, widths, words, strict=True)
        return "  ".join(
            cell.ljust(width) if left else cell.rjust(width) for cell, width, left in each
        ).rstrip()

    return "\n".join(map(line, [head, *rows]))


def html(blocks: Iterable[Block], picture: Callable[[], Figure]) -> str:
    """Returns blocks as HTML and a picture as PNG inside it; without matplotlib, how to install it.
    Names in blocks may come from a stranger: all text is escaped."""
    return "".join([*map(_html, blocks), _image(picture)])


def _html(block: Block) -> str:
    if isinstance(block, str):
        return f"<p>{escape(block)}</p>".replace("\n", "<br>")
    sides = ["left" if words else "right" for words in block.words]
    title = f"<caption>{escape(block.title)}</caption>" if block.title else ""
    lines = [_row("th", block.head, sides), *(_row("td", row, sides) for row in block.rows)]
    return f"<table>{title}{''.join(lines)}</table>"


def _row(tag: str, cells: Sequence[str], sides: Sequence[str]) -> str:
    row = zip(cells, sides, strict=True)
    parts = (f"<{tag} style='text-align:{side}'>{escape(cell)}</{tag}>" for cell, side in row)
    return f"<tr>{''.join(parts)}</tr>"


def _image(picture: Callable[[], Figure]) -> str:
    from finlab.display.figures import figure_bytes

    try:
        content = b64encode(figure_bytes(picture, "png")).decode()
    except ImportError:
        return _html(f"A picture needs matplotlib; run: {install('plot')}")
    return f"<img alt='picture' src='data:image/png;base64,{content}'>"
