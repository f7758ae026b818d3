"""A layout as a table of its actuators, for terminals and notebooks: `print(layout)` shows it."""

from typing import Any

from finlab.display import Block, Column, table_of

Layout = Any
"""`finlab.layout.Layout`, which prints itself by this module, so that this one cannot import it."""


def _metres(value: float) -> str:
    """A coordinate [m], to the millimetre."""
    return f"{value:6.3f}"


COLUMNS = (
    Column("actuator", lambda actuator: actuator.name, is_text=True),
    Column("type", lambda actuator: actuator.type, is_text=True),
    Column("x", lambda actuator: actuator.position[0], "m", _metres),
    Column("y", lambda actuator: actuator.position[1], "m", _metres),
    Column("z", lambda actuator: actuator.position[2], "m", _metres),
    Column("direction", lambda actuator: actuator.direction_words, is_text=True),
    Column("limits", lambda actuator: actuator.limits_words, is_text=True),
)
"""The columns from left to right; the first one says which actuator a row is of."""


def layout_blocks(layout: Layout) -> list[Block]:
    """Returns a layout in words, and a table of its actuators.

    The app's list of actuators (`webapp/panels/actuator_list.py`) is narrower and has columns of
    its own: directions as an azimuth and a rise in degrees, and no limits, which stand in the
    inspector.
    """
    title = f"{layout.name}: {layout.description}" if layout.description else layout.name
    blocks: list[Block] = [title, table_of(COLUMNS, layout.actuators)]
    if layout.parts_notes:
        blocks.append("\n".join(layout.parts_notes))
    return blocks
