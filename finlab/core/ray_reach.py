"""Calls of the core for rays in the sets of wrenches that robots can push; `finlab.forces` asks
them for many robots at once."""

import ctypes
from typing import NamedTuple

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


class WithinBudgets(NamedTuple):
    """What `ray_reach_within` is told of sets, their powers and budgets."""

    tables: Array
    """Polygons and curves of the sides; the first number is not used."""
    sides: Array
    """Sides of all sets (S, 8), as `fl_power_side` of internal.h has them."""
    budget: Array
    """The most power of each bus (b,) [W]."""


def ray_reach_within(
    block: Array, within: WithinBudgets, own: Array, origin: Array, ray: Array, close: float
) -> tuple[Array, Array, Array, Array]:
    """Finds how far rays go within the wrenches that R robots can push within power budgets.

    Args:
        block: of `block_of_planes`.
        within: sets, powers and budgets.
        own: of each actuator (R, n, 16) its first side and how many sides it has, its bus or -1,
            and whether it works; then the wrench (2, 6) per newton along its two directions.
        origin: as for `ray_reach`.
        ray: as for `ray_reach`.
        close: as for `ray_reach`.

    Returns:
        Lengths, normals and forces as of `ray_reach`, and the multipliers (R, b) of the budgets at
        the normals, in the unit of the wrench over W.
    """
    core = library()
    count, n, _ = own.shape
    size = np.empty(count)
    normal = np.empty((count, 6))
    force = np.empty((count, n, 2))
    multiplier = np.empty((count, len(within.budget)))
    corners = np.zeros(len(within.sides), np.intc)
    work = ctypes.create_string_buffer(constant("sizeof fl_work"))
    core.fl_reach_within(
        block.ctypes.data,
        ctypes.addressof(work),
        within.tables.ctypes.data,
        within.sides.ctypes.data,
        within.budget.ctypes.data,
        len(within.budget),
        own.ctypes.data,
        origin.ctypes.data,
        ray.ctypes.data,
        count,
        min(close, LARGEST_CLOSE),
        corners.ctypes.data,
        size.ctypes.data,
        normal.ctypes.data,
        force.ctypes.data,
        multiplier.ctypes.data,
    )
    return np.where(size > -LARGEST_CLOSE, size, -np.inf), normal, force, multiplier
