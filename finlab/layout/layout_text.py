"""A layout as a table of its actuators."""

from typing import Any

from finlab.display import Block, Table

Layout = Any
"""`finlab.layout.Layout`, which shows itself by what is here."""
COLUMNS = ("actuator", "type", "x [m]", "y [m]", "z [m]", "direction", "limits")
WORDS = (True, True, False, False, False, True, True)


def layout_blocks(layout: Layout) -> list[Block]:
    """Returns a layout in words, and a table of its actuators."""
    rows = [
        (
            part.name,
            part.type,
            *(f"{x:6.3f}" for x in part.position),
            part.direction_words,
            part.limits_words,
        )
        for part in layout.actuators
    ]
    title = f"{layout.name}: {layout.description}" if layout.description else layout.name
    return [title, Table(COLUMNS, rows, WORDS)]
