"""Convex pieces of the forces that actuators can give, and tables of them from which the core takes
one piece of each actuator at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.ray_reach import block_of_planes
from finlab.forces.force_sets import ForceSets
from finlab.forces.power_sides import Sides

INSIDE = 1e-7
"""Distance by which a force may be outside of a part and still count as within, over the largest
force of its actuator [1]."""


class Piece(NamedTuple):
    """A convex set of forces of one actuator in its plane: a sector of a disc, or its hull, or a
    polygon."""

    radius: float
    """Largest force [N]."""
    center: float = 0.0
    """Middle of the arc of a sector [rad]."""
    half_angle: float = np.pi
    """Half of that arc [rad]; pi for a disc."""
    corners: Array | None = None
    """Corners (K, 2) [N] of a polygon, in place of the arc."""
    sides: Sides = ()
    """What its forces cost; none where no power budget counts."""

    @property
    def middle(self) -> Array:
        """A force (2,) [N] of the set: the middle of a polygon, and none of a sector."""
        return np.zeros(2) if self.corners is None else self.corners.mean(axis=0)

    def contains(self, force: Array) -> NDArray[np.bool_]:
        """Returns whether forces (R, 2) [N] are within the set, but for `INSIDE`."""
        margin = INSIDE * self.radius
        if self.corners is not None:
            edge = np.roll(self.corners, -1, axis=0) - self.corners
            length = np.linalg.norm(edge, axis=-1)
            offset = force[:, None, :] - self.corners
            # Counterclockwise corners: the inside is to the left of each edge.
            left = edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0]
            within: NDArray[np.bool_] = (left >= -margin * length).all(axis=-1)
            return within
        size = np.linalg.norm(force, axis=-1)
        angle = np.arctan2(force[:, 1], force[:, 0])
        turn = (angle - self.center + np.pi) % (2.0 * np.pi) - np.pi
        # Beyond the ends of the arc, the distance to the nearer radius counts.
        beyond = np.maximum(np.abs(turn) - self.half_angle, 0.0)
        distance = size * np.sin(np.minimum(beyond, 0.5 * np.pi))
        is_within: NDArray[np.bool_] = (size <= self.radius + margin) & (distance <= margin)
        return is_within

    def to_dict(self) -> dict[str, Any]:
        """Returns what a file holds of it."""
        if self.sides:
            return {"sides": [side.to_dict() for side in self.sides]}
        if self.corners is not None:
            return {"corners_n": self.corners.tolist()}
        return {
            "radius_n": self.radius,
            "center_rad": self.center,
            "half_angle_rad": self.half_angle,
        }


class PieceTable:
    """All pieces of n actuators, as the core reads them."""

    def __init__(self, pieces_of: Sequence[Sequence[Piece]]) -> None:
        """Takes the pieces of each actuator."""
        counts = [len(pieces) for pieces in pieces_of]
        self._begin = np.cumsum([0, *counts])[:-1]
        self._offset, self._block = _polygon_block(pieces_of)
        flat = [piece for pieces in pieces_of for piece in pieces]
        self._radius = np.array([piece.radius for piece in flat])
        self._center = np.array([piece.center for piece in flat])
        self._middle = np.array([piece.middle for piece in flat])
        self._half_angle = np.array(
            [piece.half_angle if piece.corners is None else 0.0 for piece in flat]
        )

    def sets(self, choice: NDArray[np.intp], effectiveness: Array) -> ForceSets:
        """Returns the sets of R robots.

        Args:
            choice: which of its pieces each actuator has (R, n).
            effectiveness: scaled wrench (R, n, 2, 6) per newton along both axes of each plane.
        """
        piece = self._begin + choice
        return ForceSets(
            effectiveness=effectiveness,
            radius=self._radius[piece],
            sector_center=self._center[piece],
            sector_half_angle=self._half_angle[piece],
            n_parts=np.ones_like(piece),
            polygon_offset=self._offset[piece],
            block=self._block,
        )

    def numbers(self, choice: NDArray[np.intp]) -> NDArray[np.intp]:
        """Returns the numbers (R, n) of chosen pieces (R, n) in the order of all."""
        return np.asarray(self._begin + choice)

    def middles(self, choice: NDArray[np.intp]) -> Array:
        """Returns a force (R, n, 2) [N] within each piece of a choice (R, n)."""
        return np.asarray(self._middle[self._begin + choice])


def _polygon_block(pieces_of: Sequence[Sequence[Piece]]) -> tuple[Array, Array]:
    """Offsets of the polygons of all pieces, 0 for sectors, and the block that holds them."""
    tables = [block_of_planes(len(pieces_of))]
    end_of_block = len(tables[0])
    offsets = []
    for pieces in pieces_of:
        for piece in pieces:
            if piece.corners is None:
                offsets.append(0.0)
                continue
            offsets.append(float(end_of_block))
            # A polygon in the block: the number of its corners, then their coordinates.
            tables.append(np.array([float(len(piece.corners))]))
            tables.append(piece.corners.ravel())
            end_of_block += 1 + piece.corners.size
    return np.array(offsets), np.concatenate(tables)
