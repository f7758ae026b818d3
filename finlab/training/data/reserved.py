"""Layouts that stay out of training: everything shipped in `layouts/`."""

import functools
import math

import numpy as np
from numpy.typing import NDArray

from finlab.assets import shipped_layouts
from finlab.layout.angles import wrapped
from finlab.layout.arrays import LayoutArrays, stack_layouts
from finlab.layout.load import load_layout

POSITION_TOLERANCE = 2e-3
"""Fins closer than this count as the same place [m]."""
ANGLE_TOLERANCE = math.radians(1.0)
"""Shafts closer than this count as the same direction [rad]."""


@functools.cache
def shipped_reserved() -> LayoutArrays:
    """Returns the layouts shipped with finlab, read once."""
    return stack_layouts([load_layout(path) for path in shipped_layouts().values()])


def find_reserved(layouts: LayoutArrays, reserved: LayoutArrays) -> NDArray[np.bool_]:
    """Returns which layouts of a batch (B,) are reserved, fins in any order.

    A layout is one of the reserved ones when it has as many fins, each of its fins lies at one of
    theirs, and each of theirs at one of its own.
    """
    # Such a layout is all but impossible to draw. Only where the first fin lies at a reserved one is it
    # compared in full.
    places = reserved.position[reserved.mask]
    away = np.abs(layouts.position[:, :1] - places)
    found = np.asarray((away <= POSITION_TOLERANCE).all(-1).any(-1))
    suspects = LayoutArrays._make(part[found] for part in layouts)
    found[found] = _same(suspects, reserved)
    return found


def _same(layouts: LayoutArrays, reserved: LayoutArrays) -> NDArray[np.bool_]:
    """`find_reserved`, by looking at each pair of fins."""
    # Axes: layouts of the batch, reserved layouts, fins of the first, fins of the second.
    place, angle = (part[:, None, :, None] for part in (layouts.position, layouts.mounting_angle))
    here = layouts.mask[:, None, :, None]
    away = np.linalg.norm(place - reserved.position[:, None], axis=-1)
    turn = np.abs(wrapped(angle - reserved.mounting_angle[:, None]))
    near = (away <= POSITION_TOLERANCE) & (turn <= ANGLE_TOLERANCE) & here & reserved.mask[:, None]
    every_own = (near.any(axis=3) | ~here[..., 0]).all(axis=2)
    every_theirs = (near.any(axis=2) | ~reserved.mask).all(axis=2)
    as_many = here.sum(axis=(2, 3)) == reserved.mask.sum(axis=1)
    return np.asarray((as_many & every_own & every_theirs).any(axis=1))
