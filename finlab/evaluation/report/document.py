"""A document as a list of blocks: turned into Markdown by `markdown`, and into plain text by `text`.

A heading, a paragraph or a list is a string of Markdown; a paragraph *all in italics* is a remark in small.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from finlab.evaluation.plots.style import Picture
from finlab.evaluation.report.numbers import FORMATS

Row = dict[str, Any]


@dataclass(frozen=True)
class Column:
    """A column of a table."""

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
        """Whether it stands to the right."""
        return self.format not in ("text", "code")


@dataclass(frozen=True)
class Table:
    """A table; a row with `_kind` `ours` stands out."""

    columns: tuple[Column, ...]
    rows: Sequence[Row]

    def cell(self, row: Row, column: Column) -> str:
        """A cell's text, its interval in brackets."""
        show = FORMATS[column.format]
        value, ends = row.get(column.key), row.get(column.interval or "")
        if value is None:
            return ""
        return (
            f"{show(value)} ({show(ends[0])} – {show(ends[1])})" if ends and None not in ends else show(value)
        )


@dataclass(frozen=True)
class Figure:
    """A picture, drawn when the page is written; printed text does without."""

    name: str
    """Of its file, without the ending."""
    draw: Callable[[], Picture]
    caption: str


Block = str | Table | Figure
"""A string is Markdown."""


@dataclass(frozen=True)
class Document:
    """A whole page."""

    title: str
    subtitle: str
    blocks: tuple[Block, ...]
