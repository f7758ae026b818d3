"""A robot's hull: its closed surface, from a shape or a mesh file, and what that says of the
body."""

from finlab.swim.hull.hydrodynamics import contradicts, displaced, estimated, lift_of
from finlab.swim.hull.surface import Surface, hull_of

__all__ = ["Surface", "contradicts", "displaced", "estimated", "hull_of", "lift_of"]
