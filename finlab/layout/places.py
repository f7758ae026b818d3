"""The places of a robot's actuators, and of its hull, as an interaction takes them."""

import numpy as np

from finlab.actuators.actuator import Actuator
from finlab.actuators.propeller import Propeller
from finlab.interaction.interaction import Places
from finlab.layout.layout import Layout

USUAL_ADVANCE = 1.26
"""What speed takes from a propeller of which nothing is known: Kt 0.4 at rest, none at J = 0.8."""


def places_of(layout: Layout) -> Places:
    """Returns the places of a layout's actuators. A hull of another shape counts as the ellipsoid
    of its size, a mesh, whose size no layout says, as none; fins lose nothing to speed that is
    known."""
    hull = layout.body.hull if layout.body else None
    size = hull.size_m if hull is not None and hull.size_m else (0.0, 0.0, 0.0)
    center = hull.center_m if hull is not None else (0.0, 0.0, 0.0)
    advance = [_advance(part) for part in layout.actuators]
    diameter = [part.jet for part in layout.actuators]
    half = 0.5 * np.array(size)
    return Places(
        layout.position, np.array(diameter), np.array(advance), np.stack([np.array(center), half])
    )


def _advance(part: Actuator) -> float:
    guess = USUAL_ADVANCE if isinstance(part, Propeller) else 0.0
    return guess if part.advance is None else part.advance
