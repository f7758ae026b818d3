"""Boxes in which no actuator may stand, and the places that they leave of a larger box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.analysis.climb import Rule
from finlab.arrays import Array
from finlab.errors import LayoutError


@dataclass(frozen=True)
class KeepOut:
    """A box in which no actuator may stand, body frame; on its faces they may. Checked on
    construction."""

    x: tuple[float, float]
    """Its ends forward [m]."""
    y: tuple[float, float]
    """Its ends to the left [m]."""
    z: tuple[float, float]
    """Its ends upward [m]."""

    def __post_init__(self) -> None:
        for name in ("x", "y", "z"):
            low, high = getattr(self, name)
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise LayoutError(
                    f"keep-out, {name}: expected two numbers, smaller first, got {low} {high}"
                )

    @property
    def ends(self) -> Array:
        """Least and largest coordinates (3, 2) [m]."""
        return np.array([self.x, self.y, self.z])

    def depth(self, position: Array) -> Array:
        """Returns how deep points (..., 3) [m] are within the box (...) [m]; 0 outside of it."""
        low, high = self.ends.T
        to_nearest_face = np.minimum(position - low, high - position).min(axis=-1)
        return np.asarray(np.maximum(to_nearest_face, 0.0))


def keep_out_rule(keep_outs: Sequence[KeepOut], rows: Sequence[int]) -> Rule:
    """Returns the rule of a search that some actuators stand in no keep-out.

    Args:
        keep_outs: the boxes.
        rows: indices of the actuators that move.
    """
    moving = list(rows)

    def violation(position: Array, frames: Array) -> Array:
        depths = [box.depth(position[:, moving]).sum(axis=-1) for box in keep_outs]
        return np.asarray(np.sum(depths, axis=0))

    return violation


def extreme_places(box: Array, keep_outs: Sequence[KeepOut]) -> Array:
    """Returns places whose convex hull is that of all places in a box and in no keep-out.

    What the keep-outs leave is a union of boxes between the coordinates of their faces, so its
    extreme points are on the grid of these coordinates. A point between two others of a line of the
    grid is none.

    Args:
        box: least and largest coordinates (3, 2) [m].
        keep_outs: boxes in which nothing may stand.

    Returns:
        Places (K, 3) [m]; none where the keep-outs leave nothing.
    """
    coordinates = []
    for axis in range(3):
        low, high = box[axis]
        faces = [end for keep_out in keep_outs for end in keep_out.ends[axis]]
        within = [face for face in faces if low < face < high]
        coordinates.append(np.unique([low, high, *within]))
    grid = np.stack(np.meshgrid(*coordinates, indexing="ij"), axis=-1)
    is_allowed = np.ones(grid.shape[:3], bool)
    for keep_out in keep_outs:
        is_allowed &= keep_out.depth(grid) <= 0.0
    is_extreme = is_allowed.copy()
    for axis in range(3):
        is_extreme &= _first_along(is_allowed, axis) | _last_along(is_allowed, axis)
    return np.asarray(grid[is_extreme])


def _first_along(is_allowed: NDArray[np.bool_], axis: int) -> NDArray[np.bool_]:
    """Which points (X, Y, Z) are the first allowed ones of their lines along an axis."""
    count = np.cumsum(is_allowed, axis=axis)
    return np.asarray(is_allowed & (count == 1))


def _last_along(is_allowed: NDArray[np.bool_], axis: int) -> NDArray[np.bool_]:
    """The same of the last ones."""
    return np.flip(_first_along(np.flip(is_allowed, axis), axis), axis)
