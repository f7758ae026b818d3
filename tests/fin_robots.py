"""The shipped robots that are of fins with horizontal shafts alone."""

from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout


def _is_one(layout: Layout) -> bool:
    return layout.is_of_fins and all(fin.mounting_angle is not None for fin in layout.fins)


FIN_ROBOTS = {name: path for name, path in shipped_layouts().items() if _is_one(load_layout(path))}
"""Names and layout files."""
