"""Reports as lists of blocks, as Markdown or plain text, and numbers as people read them.

Experiments and the judgement of logs print themselves with it. A block is a table, or a string of
Markdown: a heading, a paragraph or a list. A paragraph *all in italics* is a remark in small.
"""

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from finlab.display import aligned

Row = dict[str, Any]
"""A row of a table: key -> plain value."""
TEXT_WIDTH = 110
"""Most characters in a line of plain text."""
SMALLEST_DECIMAL = 9.5e-5
"""Errors below this one are printed with an exponent."""
MAX_DECIMALS = 6
"""Most decimals of a number; smaller ones are printed with an exponent."""


def format_error(value: float) -> str:
    """Returns an error with two significant digits: 0.00029, 0.086, 1.8, 3.1e-7."""
    if 0 < abs(value) < SMALLEST_DECIMAL:
        mantissa, _, power = f"{value:.1e}".partition("e")
        return f"{mantissa}e{int(power)}"
    return format_digits(value, 2)


def format_digits(value: float, digits: int = 3) -> str:
    """Returns a number with significant digits: 2.86, 0.0857, 178; a dash where it is not finite.

    Args:
        value: the number.
        digits: how many digits are significant.
    """
    if value == 0:
        return "0"
    if not math.isfinite(value):
        return "–"
    # Rounded first: 9.996 is 10.0, not 10.00.
    rounded = float(f"{abs(value):.{digits - 1}e}")
    decimals = max(0, digits - 1 - math.floor(math.log10(rounded)))
    return f"{value:.{decimals}f}" if decimals <= MAX_DECIMALS else f"{value:.2e}"


def format_share(value: float) -> str:
    """Returns a share [1] as a percentage, with more digits the nearer it is to 100: 48.8 %,
    99.97 %, 100 %."""
    if value >= 1.0:
        return "100 %"
    missing = 100 * (1 - value)
    decimals = 1 if missing >= 1 else min(4, -math.floor(math.log10(missing)))
    return f"{100 * value:.{decimals}f} %"


FORMATS: dict[str, Callable[[Any], str]] = {
    "error": format_error,
    "three": format_digits,
    "share": format_share,
    "count": "{:,}".format,
    "ratio": "{:.3f}".format,
    "metres": "{:.4f}".format,
    "text": str,
    "code": "`{}`".format,
}
"""Format of a `Column` -> the function that makes text of a value."""


@dataclass(frozen=True)
class Column:
    """A column of a table: which key of its rows it shows, under which title, and how.

    Rows of experiments come from JSON files as well as from a run, so that a column names a key
    and a format, where one of `finlab.display` has functions of a typed item.
    """

    key: str
    """Key of the rows whose values it shows."""
    title: str
    """Its heading, without the unit."""
    format: str = "text"
    """How it shows a value, a key of `FORMATS`."""
    interval: str | None = None
    """Key of an interval [low, high] that stands behind the number."""
    unit: str = ""
    """Unit of the numbers; empty where they are shares, ratios or counts."""

    @property
    def heading(self) -> str:
        """The title with the unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    @property
    def is_number(self) -> bool:
        """Whether its cells stand to the right, as numbers do."""
        return self.format not in ("text", "code")


@dataclass(frozen=True)
class ReportTable:
    """A table; a row with `_kind` `ours` stands out."""

    columns: tuple[Column, ...]
    """Its columns, from left to right."""
    rows: Sequence[Row]
    """Its rows, from top to bottom; they may have more keys than columns show."""

    def cell(self, row: Row, column: Column) -> str:
        """Returns the text of a cell, with the interval of its number in brackets.

        Args:
            row: one of the rows.
            column: one of the columns.

        Returns:
            The text; empty where the row has no such key.
        """
        as_text = FORMATS[column.format]
        value = row.get(column.key)
        if value is None:
            return ""
        interval = row.get(column.interval or "")
        if not interval or None in interval:
            return as_text(value)
        low, high = interval
        return f"{as_text(value)} ({as_text(low)} – {as_text(high)})"


ReportBlock = str | ReportTable
"""A string is Markdown."""


def to_markdown(*blocks: ReportBlock) -> str:
    """Returns blocks as the Markdown of a page, tables with pipes; the method of rows that are ours
    is bold."""
    texts = [block if isinstance(block, str) else _markdown_table(block) for block in blocks]
    return "\n\n".join(texts) + "\n"


def _markdown_table(table: ReportTable) -> str:
    """A table in Markdown."""
    keys = [column.key for column in table.columns]
    bold = keys.index("method") if "method" in keys else 0
    lines = [[column.heading for column in table.columns]]
    lines.append(["---:" if column.is_number else "---" for column in table.columns])
    for row in table.rows:
        cells = [table.cell(row, column) for column in table.columns]
        if row.get("_kind") == "ours":
            cells[bold] = f"**{cells[bold]}**"
        lines.append(cells)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def to_text(*blocks: ReportBlock) -> str:
    """Returns blocks as plain text: headings without their marks, paragraphs in lines, tables with
    aligned columns."""
    return "\n\n".join(map(_plain_text, blocks))


def _plain_text(block: ReportBlock) -> str:
    """A block as plain text."""
    if isinstance(block, str):
        lines = []
        for line in block.splitlines():
            words = line.strip("#* ").replace("`", "")
            lines.append(textwrap.fill(words, TEXT_WIDTH))
        return "\n".join(lines)
    head = [column.heading for column in block.columns]
    rows = []
    for row in block.rows:
        rows.append([block.cell(row, column).replace("`", "") for column in block.columns])
    is_text = [not column.is_number for column in block.columns]
    return aligned(head, rows, is_text)
