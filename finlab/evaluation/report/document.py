"""A document as a list of blocks: written once, turned into HTML and into Markdown by two small writers.

Texts may hold `code`, **bold** and [links](address), as in Markdown, and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from finlab.evaluation.plots.style import Picture
from finlab.evaluation.report.numbers import FORMATS

Row = dict[str, Any]


@dataclass(frozen=True)
class Heading:
    """A title; those of level 2 make the list of contents."""

    text: str
    """Its words."""
    level: int = 2
    """2 or 3."""


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str
    """Its words."""
    small: bool = False
    """Whether it is a remark under a table."""


@dataclass(frozen=True)
class Bullets:
    """A list."""

    items: tuple[str, ...]
    """Its entries."""


@dataclass(frozen=True)
class Card:
    """One number of the summary."""

    value: str
    """The number, in a few characters."""
    label: str
    """What it is."""
    detail: str
    """What it is compared with."""


@dataclass(frozen=True)
class Cards:
    """The numbers that stand on top."""

    cards: tuple[Card, ...]
    """At most four in a line."""


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    key: str
    """Of the rows."""
    title: str
    """In words, with the unit."""
    format: str = "text"
    """Key of `FORMATS`."""
    interval: str | None = None
    """Key of an interval [low, high] that stands below the number in small."""


@dataclass(frozen=True)
class Table:
    """A table; a row may carry `_kind`: `ours` (stands out) or `printed` (figures from the paper)."""

    columns: tuple[Column, ...]
    """From left to right."""
    rows: Sequence[Row]
    """From top to bottom."""

    def cell(self, row: Row, column: Column) -> tuple[str, str]:
        """A cell's text and the small text below it."""
        show = FORMATS[column.format]
        value, ends = row.get(column.key), row.get(column.interval or "")
        if value is None:
            return "", ""
        small = f"{show(ends[0])} – {show(ends[1])}" if ends else ""
        return show(value), small


@dataclass(frozen=True)
class Figure:
    """A picture."""

    name: str
    """Of its file, without the ending."""
    svg: str
    """The picture itself."""
    caption: str
    """What is to be seen."""

    @classmethod
    def drawn(cls, name: str, picture: Picture, caption: str) -> Figure:
        """Of a picture that was drawn with matplotlib."""
        return cls(name, picture.svg(name), caption)


@dataclass(frozen=True)
class Fold:
    """Blocks that are hidden until one asks for them."""

    title: str
    """What is inside."""
    blocks: tuple[Block, ...]
    """What is inside."""


Block = Heading | Text | Bullets | Cards | Table | Figure | Fold


@dataclass(frozen=True)
class Document:
    """A whole page."""

    title: str
    """Its name."""
    subtitle: str
    """One line about it."""
    blocks: tuple[Block, ...]
    """From top to bottom."""


def figures_of(blocks: Sequence[Block]) -> list[Figure]:
    """Every picture, folded ones included."""
    found: list[Figure] = []
    for block in blocks:
        if isinstance(block, Figure):
            found.append(block)
        elif isinstance(block, Fold):
            found += figures_of(block.blocks)
    return found
