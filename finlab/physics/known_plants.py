"""The plant of a layout, made once."""

from functools import lru_cache

from finlab.actuators.fin.models import file_stamps
from finlab.layout import Layout
from finlab.physics.plant import Plant


def plant_of(layout: Layout) -> Plant:
    """Returns the plant of a layout, kept from the last time it was asked for.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    return _made(layout, file_stamps(layout))


@lru_cache(maxsize=256)
def _made(layout: Layout, stamps: tuple[tuple[int, int] | None, ...]) -> Plant:
    """A plant; tables whose files have changed are read again."""
    return Plant(layout)
