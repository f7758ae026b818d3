"""A document as a list of blocks, the same in Markdown or as plain text, and numbers as people read
them.

A heading, a paragraph or a list is a string of Markdown; a paragraph *all in italics* is a remark
in small.
"""

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from finlab.display import aligned

Row = dict[str, Any]
WIDTH = 110
"""Of plain text."""


def error(value: float) -> str:
    """Two significant digits: 0.00029, 0.086, 1.8, 3.1e-7."""
    if 0 < abs(value) < 9.5e-5:
        mantissa, _, power = f"{value:.1e}".partition("e")
        return f"{mantissa}e{int(power)}"
    return three(value, 2)


def three(value: float, count: int = 3) -> str:
    """Three significant digits, or another number of them: 2.86, 0.0857, 178."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "–"
    # Rounded first: 9.996 is 10.0, not 10.00.
    rounded = float(f"{abs(value):.{count - 1}e}")
    digits = max(0, count - 1 - math.floor(math.log10(rounded)))
    return f"{value:.{digits}f}" if digits < 7 else f"{value:.2e}"


def share(value: float) -> str:
    """As a percentage, with more digits the nearer it is to 100: 48.8 %, 99.97 %, 100 %."""
    if value >= 1.0:
        return "100 %"
    missing = 100 * (1 - value)
    digits = 1 if missing >= 1 else min(4, -math.floor(math.log10(missing)))
    return f"{100 * value:.{digits}f} %"


FORMATS: dict[str, Callable[[Any], str]] = {
    "error": error,
    "three": three,
    "share": share,
    "count": "{:,}".format,
    "ratio": "{:.3f}".format,
    "metres": "{:.4f}".format,
    "text": str,
    "code": "`{}`".format,
}
"""Name -> how a value is shown."""


@dataclass(frozen=True)
class Column:
    """A column of a table: which key of its rows it shows, under which title, and how.

    Rows of experiments come from JSON files as well as from a run, so that a column names a key
    and a format, where one of `finlab.display` has functions of a typed item.
    """

    key: str
    title: str
    format: str = "text"
    interval: str | None = None
    """Key of an interval [low, high] that stands behind the number."""
    unit: str = ""
    """Of the numbers; none where they are shares, ratios or counts."""

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
    rows: Sequence[Row]

    def cell(self, row: Row, column: Column) -> str:
        """The text of a row's cell, its interval in brackets behind it; empty where the row has no
        such key."""
        show = FORMATS[column.format]
        value = row.get(column.key)
        ends = row.get(column.interval or "")
        if value is None:
            return ""
        return (
            f"{show(value)} ({show(ends[0])} – {show(ends[1])})"
            if ends and None not in ends
            else show(value)
        )


ReportBlock = str | ReportTable
"""A string is Markdown."""


def to_markdown(*blocks: ReportBlock) -> str:
    """Blocks as the Markdown of a page, tables with pipes; rows that are ours in bold."""
    return (
        "\n\n".join(block if isinstance(block, str) else _text_table(block) for block in blocks)
        + "\n"
    )


def _text_table(table: ReportTable) -> str:
    keys = [column.key for column in table.columns]
    named = keys.index("method") if "method" in keys else 0
    lines = [[column.heading for column in table.columns]]
    lines.append(["---:" if column.is_number else "---" for column in table.columns])
    for row in table.rows:
        cells = [table.cell(row, column) for column in table.columns]
        if row.get("_kind") == "ours":
            cells[named] = f"**{cells[named]}**"
        lines.append(cells)
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def to_text(*blocks: ReportBlock) -> str:
    """Headings without their marks, paragraphs in lines, tables with aligned columns."""
    return "\n\n".join(map(_plain, blocks))


def _plain(block: ReportBlock) -> str:
    if isinstance(block, str):
        lines = (line.strip("#* ").replace("`", "") for line in block.splitlines())
        return "\n".join(textwrap.fill(line, WIDTH) for line in lines)
    head = [column.heading for column in block.columns]
    cells = [
        [block.cell(row, column).replace("`", "") for column in block.columns] for row in block.rows
    ]
    return aligned(head, cells, [not column.is_number for column in block.columns])
