"""Calls of the core for rays in the sets of wrenches that robots can push; `finlab.forces` asks
them for many robots at once."""

import ctypes

import numpy as np

from finlab.arrays import Array
from finlab.core import library
from finlab.core.fields import actuators_of, constant, head_of, tables_begin

LARGEST_CLOSE = 1e30
"""Infinity in the core, which reads none."""


def block_of_planes(count: int) -> Array:
    """Returns a block that says of `count` actuators that they push in planes, and no more: the
    polygons of `ray_reach` are put behind it."""
    block = np.zeros(tables_begin(count))
    head_of(block)["n"] = count
    actuators_of(block)["rows"] = 2.0
    return block


def ray_reach(
    block: Array, own: Array, origin: Array, ray: Array, close: float
) -> tuple[Array, Array, Array]:
    """Finds how far rays go within the wrenches that R robots can push.

    Args:
        block: of `block_of_planes`, with the polygons of all robots behind it: how many corners,
            then these [N].
        own: of each actuator (R, n, 16) the offset of its polygon in the block, or 0 and radius
            [N], middle and half of a sector [rad]; then the wrench (2, 6) per newton along its two
            directions.
        origin: points (R, 6) where the rays begin, in any unit of the wrench.
        ray: (R, 6), in the same unit.
        close: how near to the end an answer has to be, in the same unit; infinity for one step.

    Returns:
        Lengths (R,) over those of the rays, never too short, minus infinity where a ray misses all
        wrenches; normals (R, 6) of the planes that prove them; and forces (R, n, 2) [N] there.
    """
    core = library()
    count, n, _ = own.shape
    size = np.empty(count)
    normal = np.empty((count, 6))
    force = np.empty((count, n, 2))
    work = ctypes.create_string_buffer(constant("sizeof fl_work"))
    core.fl_reach(
        block.ctypes.data,
        ctypes.addressof(work),
        own.ctypes.data,
        origin.ctypes.data,
        ray.ctypes.data,
        count,
        min(close, LARGEST_CLOSE),
        size.ctypes.data,
        normal.ctypes.data,
        force.ctypes.data,
    )
    return np.where(size > -LARGEST_CLOSE, size, -np.inf), normal, force
