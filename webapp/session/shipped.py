"""The layouts that travel with finlab, read once."""

from functools import cache

from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout


@cache
def shipped() -> dict[str, Layout]:
    """Shipped layouts by the name that the command line knows them by."""
    return {name: load_layout(path) for name, path in shipped_layouts().items()}


def shipped_name(layout: Layout) -> str | None:
    """The name of the shipped layout that this one equals, None if it is none of them."""
    return next((name for name, known in shipped().items() if known == layout), None)
