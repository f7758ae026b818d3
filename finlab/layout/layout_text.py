"""A layout as a table of its actuators, for terminals and notebooks: `print(layout)` shows it."""

from collections.abc import Callable
from typing import Any, NamedTuple

from finlab.display import Block, Table

Layout = Any
"""`finlab.layout.Layout`, which prints itself by this module, so that this one cannot import it."""


class Column(NamedTuple):
    """A column of the table of actuators."""

    title: str
    """Its head, with the unit in brackets."""
    cell: Callable[[Any], str]
    """Actuator -> text of its cell."""
    is_text: bool = False
    """Whether its cells are words, which stand at the left; numbers stand at the right."""


COLUMNS = (
    Column("actuator", lambda actuator: actuator.name, is_text=True),
    Column("type", lambda actuator: actuator.type, is_text=True),
    Column("x [m]", lambda actuator: f"{actuator.position[0]:6.3f}"),
    Column("y [m]", lambda actuator: f"{actuator.position[1]:6.3f}"),
    Column("z [m]", lambda actuator: f"{actuator.position[2]:6.3f}"),
    Column("direction", lambda actuator: actuator.direction_words, is_text=True),
    Column("limits", lambda actuator: actuator.limits_words, is_text=True),
)
"""The columns from left to right; the first one says which actuator a row is of."""


def layout_blocks(layout: Layout) -> list[Block]:
    """Returns blocks of text that show a layout: its name and description, and a table."""
    head = [column.title for column in COLUMNS]
    rows = []
    for actuator in layout.actuators:
        rows.append([column.cell(actuator) for column in COLUMNS])
    is_text = [column.is_text for column in COLUMNS]
    title = f"{layout.name}: {layout.description}" if layout.description else layout.name
    return [title, Table(head, rows, is_text)]
