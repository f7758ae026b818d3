"""Geometry of a layout for an interaction: points and jets of its actuators, its hull as an
ellipsoid.

The plant hands it to the layout's `InteractionModel`.
"""

import numpy as np

from finlab.actuators.actuator import Actuator
from finlab.actuators.propeller import Propeller
from finlab.interaction.interaction import JetGeometry
from finlab.layout.layout import Layout

TYPICAL_ADVANCE = 1.26
"""`Actuator.advance` of a propeller of which nothing is known: Kt = 0.4 at rest, none at J = 0.8
[1]."""


def jet_geometry_of(layout: Layout) -> JetGeometry:
    """Returns points and jets of a layout's n actuators, and its hull.

    A hull of another shape counts as the ellipsoid of its size, a mesh, whose size no layout says,
    as none. Of fins no loss of thrust by speed is known.
    """
    hull = layout.body.hull if layout.body else None
    size = hull.size_m if hull is not None and hull.size_m else (0.0, 0.0, 0.0)
    center = hull.center_m if hull is not None else (0.0, 0.0, 0.0)
    half_axes = 0.5 * np.array(size)
    return JetGeometry(
        position=layout.position,
        diameter=np.array([actuator.jet for actuator in layout.actuators]),
        advance=np.array([_advance(actuator) for actuator in layout.actuators]),
        hull=np.stack([np.array(center), half_axes]),
    )


def _advance(actuator: Actuator) -> float:
    """Relative loss of thrust per relative speed, estimated where it is unknown [1]."""
    if actuator.advance is not None:
        return actuator.advance
    return TYPICAL_ADVANCE if isinstance(actuator, Propeller) else 0.0
