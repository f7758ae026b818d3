"""The shipped robots that are of fins alone."""

from finlab.assets import shipped_layouts
from finlab.layout import load_layout

FIN_ROBOTS = {name: path for name, path in shipped_layouts().items() if load_layout(path).is_of_fins}
"""Names and layout files."""
