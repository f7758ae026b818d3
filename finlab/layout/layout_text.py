"""A layout as a table of its actuators."""

from collections.abc import Callable
from typing import Any, NamedTuple

from finlab.display import Block, Table

Layout = Any
"""`finlab.layout.Layout`, which shows itself by what is here."""


class Column(NamedTuple):
    """A column of the table of actuators."""

    title: str
    """Its head, with the unit in brackets."""
    cell: Callable[[Any], str]
    """Actuator -> text of its cell."""
    is_text: bool = False
    """Whether its cells are words, which stand at the left; numbers stand at the right."""


COLUMNS = (
    Column("actuator", lambda part: part.name, is_text=True),
    Column("type", lambda part: part.type, is_text=True),
    Column("x [m]", lambda part: f"{part.position[0]:6.3f}"),
    Column("y [m]", lambda part: f"{part.position[1]:6.3f}"),
    Column("z [m]", lambda part: f"{part.position[2]:6.3f}"),
    Column("direction", lambda part: part.direction_words, is_text=True),
    Column("limits", lambda part: part.limits_words, is_text=True),
)
"""The columns from left to right; the first one says which actuator a row is of."""


def layout_blocks(layout: Layout) -> list[Block]:
    """Returns a layout in words, and a table of its actuators."""
    head = [column.title for column in COLUMNS]
    rows = [[column.cell(part) for column in COLUMNS] for part in layout.actuators]
    is_text = [column.is_text for column in COLUMNS]
    title = f"{layout.name}: {layout.description}" if layout.description else layout.name
    return [title, Table(head, rows, is_text)]
