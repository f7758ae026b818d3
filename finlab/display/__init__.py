"""Shows values: numbers, columns, tables and sentences, as plain text and as HTML for notebooks.

Layouts, score cards, answers and judgements describe their tables by `Column`s, and so does the
app, which shows the same columns in its own style (`webapp/markup/tables.py`). A notebook gets
HTML with a picture, which `pictures` draws.
"""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

from finlab.assets import install_command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_NUMBER = "-"
"""What stands in place of a number that there is none of."""
SMALLEST_PLAIN = 1e-3
"""Size from which a number is written without an exponent."""
LARGEST_PLAIN = 1e4
"""Size up to which a number is written without an exponent."""
LARGEST_WITH_DECIMALS = 999.5
"""Size from which a number with three digits is rounded to a whole one of four."""
PREFIXES = ("", "k", "M", "G", "T")
"""SI prefixes of thousands."""
PREFIXED_UNITS = ("N", "N m", "W")
"""Units of columns that have an SI prefix where their numbers are large."""


def three_digits(value: float | None) -> str:
    """Returns a number with three significant digits: `2.32`, `0.0410`, `12.5`, `3.10e-05`.

    Args:
        value: the number; None, NaN and infinities are `NO_NUMBER`.
    """
    if value is None or not math.isfinite(value):
        return NO_NUMBER
    if value != 0.0 and not SMALLEST_PLAIN <= abs(value) < LARGEST_PLAIN:
        return f"{value:.2e}"
    if abs(value) >= LARGEST_WITH_DECIMALS:
        return f"{value:.0f}"
    # With # zeros at the end stay, and so does the point after three digits before it.
    return f"{value:#.3g}".rstrip(".")


class Prefix(NamedTuple):
    """An SI prefix."""

    symbol: str = ""
    factor: float = 1.0
    """What it stands for."""


NO_PREFIX = Prefix()
"""That of a unit as it is."""


def prefix_of(size: float) -> Prefix:
    """Returns the SI prefix with which quantities are told whose largest has a size: none below
    `LARGEST_PLAIN`, nor for NaN and infinities."""
    if not LARGEST_PLAIN <= size < math.inf:
        return NO_PREFIX
    # Logarithms are rounded: 1e6 is not to fall below its own prefix.
    order = min(int(math.log10(size) / 3.0 + 1e-9), len(PREFIXES) - 1)
    return Prefix(PREFIXES[order], 1000.0**order)


def with_unit(value: float, unit: str) -> str:
    """Returns three significant digits and a unit, with an SI prefix where the number would be
    long: `327 W`, `25.8 kW`."""
    prefix = prefix_of(abs(value))
    return f"{three_digits(value / prefix.factor)} {prefix.symbol}{unit}"


def percent(share: float | None) -> str:
    """Returns a share as a percentage without decimals: `48 %`; None is `NO_NUMBER`."""
    return NO_NUMBER if share is None else f"{100.0 * share:.0f} %"


def listed(items: Sequence[str]) -> str:
    """Returns `a`, `a and b`, `a, b and c`."""
    if len(items) == 1:
        return items[0]
    return f"{', '.join(items[:-1])} and {items[-1]}"


def as_sentence(words: str) -> str:
    """Returns a remark of the library as a sentence: with a capital letter and a full stop."""
    return f"{words[:1].upper()}{words[1:]}." if words else ""


@dataclass(frozen=True)
class Column:
    """A column of a table whose rows are items of one type."""

    name: str
    """What stands above it."""
    value: Callable[[Any], Any]
    """Item -> its text, or its number; None where it has none."""
    unit: str = ""
    """Of its numbers; none where they are words, shares, or counts."""
    digits: Callable[[Any], str] = three_digits
    """Number -> its text."""
    is_text: bool = False
    """Whether its cells are words, which stand at the left; numbers stand at the right."""
    hint: str = ""
    """What it says, where its name is too short for that; shown by the app beside a pointer."""

    @property
    def heading(self) -> str:
        """The name with the unit in brackets."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def cell(self, item: Any) -> str:
        """The text of its cell in the row of an item."""
        value = self.value(item)
        return value if isinstance(value, str) else self.digits(value)

    def prefixed(self, items: Sequence[Any]) -> Column:
        """The column as a table of these items has it: numbers of `PREFIXED_UNITS` with the SI
        prefix of their largest."""
        if self.unit not in PREFIXED_UNITS:
            return self
        sizes = [0.0]
        for item in items:
            value = self.value(item)
            if isinstance(value, (int, float)) and math.isfinite(value):
                sizes.append(abs(value))
        prefix = prefix_of(max(sizes))
        if prefix is NO_PREFIX:
            return self

        def scaled(item: Any) -> Any:
            value = self.value(item)
            return value / prefix.factor if isinstance(value, (int, float)) else value

        return replace(self, value=scaled, unit=f"{prefix.symbol}{self.unit}")


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


def table_of(columns: Sequence[Column], items: Iterable[Any], title: str = "") -> Table:
    """Returns a table with a row for each item."""
    all_items = list(items)
    shown = [column.prefixed(all_items) for column in columns]
    rows = []
    for item in all_items:
        rows.append([column.cell(item) for column in shown])
    heads = [column.heading for column in shown]
    return Table(heads, rows, [column.is_text for column in shown], title)


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
    line = _line_format(tuple(widths), tuple(words))
    return "\n".join([(line % tuple(cells)).rstrip() for cells in (head, *rows)])


@lru_cache(maxsize=256)
def _line_format(widths: Sequence[int], words: Sequence[bool]) -> str:
    """The format of a line, cached: tables that are printed again mostly have the same widths."""
    columns = []
    for width, is_words in zip(widths, words, strict=True):
        side = "-" if is_words else ""
        columns.append(f"%{side}{width}s")
    return "  ".join(columns)


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
