"""Messages between the actuators of one robot, and between each actuator and the hull: features,
vectors, and what they add up to.

A model of interaction turns the features of a message into one factor for each of its vectors, such
as the networks of `finlab.interaction.learned`; the receiver adds its messages up.

The choice of frame matters: features are invariants in the frame of a source's jet (distances along
and across it in diameters, cosines, ratios), and a message is a sum of vectors along the pair's own
directions. So one model serves robots of any number of actuators. Rows are packed: the features,
then the vectors. The formulas, and their derivatives by the forces, are in
finlab/core/src/messages.c.
"""

import math
from typing import NamedTuple

import numpy as np

from finlab.arrays import AnyArray, Array
from finlab.core import library
from finlab.core.fields import struct
from finlab.interaction.interaction import DENSITY, MIN_DISC_AREA, MIN_JET_SPEED, JetGeometry

MIN_DIAMETER = 1e-3
"""Floor of the diameters and half axes that are divisors [m]."""
NORMAL_SOFTENING = 1e-9
"""Added to the squared gradient of the hull's ellipsoid: its centre has no normal."""


class RowSizes(NamedTuple):
    """How many numbers a packed row holds."""

    features: int
    """Number of features."""
    vectors: int
    """Number of vectors, of three components each."""
    forces: int
    """Of how many numbers of forces they depend."""

    @property
    def numbers(self) -> int:
        """Numbers of a row."""
        return self.features + 3 * self.vectors


ROW_SIZES = {"pair": RowSizes(11, 4, 6), "hull": RowSizes(7, 3, 3)}
"""Rows of pairs of actuators, and of an actuator and the hull; a pair depends on the forces of
source and receiver."""

ByKind = dict[str, Array]
"""Arrays of all messages of a robot, by the keys of `ROW_SIZES`."""


class Messages:
    """All messages of one robot of n actuators: p pairs of a source that has a jet and a receiver,
    and each actuator with the hull, where there is one."""

    def __init__(self, geometry: JetGeometry) -> None:
        """Takes the points and jets of the actuators, and the hull."""
        n = len(geometry.diameter)
        diameter = np.maximum(geometry.diameter, MIN_DIAMETER)
        has_jet = geometry.diameter > 0.0
        is_other = ~np.eye(n, dtype=bool)
        self.source, self.receiver = np.nonzero(is_other & has_jet[:, None])
        """Indices (p,) of the two actuators of each pair."""
        has_hull = bool(geometry.hull[1].all())
        self.counts = {"pair": len(self.source), "hull": n if has_hull else 0}
        """How many messages there are of each kind."""
        self._n = n
        self.table = self._table_of(geometry, diameter, has_hull)
        """The numbers that finlab/core/src/messages.c reads."""
        self._table_address = self.table.ctypes.data

    def _table_of(self, geometry: JetGeometry, diameter: Array, has_hull: bool) -> Array:
        """The numbers that finlab/core/src/messages.c reads."""
        center = geometry.hull[0]
        half_axes = np.maximum(geometry.hull[1], MIN_DIAMETER)
        robot = [self._n, len(self.source), has_hull, *half_axes, half_axes.mean()]

        area = 0.25 * np.pi * diameter**2 + MIN_DISC_AREA
        thrust_at_rest = 0.5 * DENSITY * area * MIN_JET_SPEED**2
        # Coordinates in which the ellipsoid is the unit sphere.
        hull_position = (geometry.position - center) / half_axes
        gradient = hull_position / half_axes
        gradient_size = np.sqrt((gradient**2).sum(axis=-1, keepdims=True) + NORMAL_SOFTENING)
        actuators = np.column_stack(
            [
                geometry.position,
                diameter,
                thrust_at_rest,
                hull_position,
                gradient / gradient_size,
                np.tanh(2.0 * geometry.diameter / half_axes.mean()),
            ]
        )

        displacement = geometry.position[self.receiver] - geometry.position[self.source]
        diameter_ratio = diameter[self.receiver] / diameter[self.source]
        pairs = np.column_stack(
            [
                self.source,
                self.receiver,
                displacement / diameter[self.source, None],
                diameter_ratio,
                np.log(diameter_ratio),
            ]
        )
        return np.concatenate([robot, actuators.ravel(), pairs.ravel()], dtype=np.float64)

    def rows(self, force: Array) -> ByKind:
        """Returns packed rows (..., m, f + 3 k) of forces (..., n, 3) [N], body frame."""
        return self._rows(force, False)[0]

    def rows_and_slopes(self, force: Array) -> tuple[ByKind, ByKind]:
        """Returns packed rows of forces, and their derivatives.

        Args:
            force: (..., n, 3) [N], body frame.

        Returns:
            Rows (..., m, f + 3 k), and their derivatives (..., m, d, f + 3 k) by the forces on
            which a message depends: of a pair those of source and receiver.
        """
        return self._rows(force, True)

    def _rows(self, force: Array, with_slopes: bool) -> tuple[ByKind, ByKind]:
        """Rows, and where they are asked for their slopes."""
        shape = force.shape[:-2]
        force = np.ascontiguousarray(force)
        rows = {}
        slopes = {}
        for kind, size in ROW_SIZES.items():
            count = self.counts[kind]
            rows[kind] = np.empty((*shape, count, size.numbers))
            slopes_shape = (*shape, count, size.forces, size.numbers)
            slopes[kind] = np.empty(slopes_shape if with_slopes else 0)
        library().fl_message_rows(
            self._table_address,
            force.ctypes.data,
            math.prod(shape),
            rows["pair"].ctypes.data,
            slopes["pair"].ctypes.data if with_slopes else None,
            rows["hull"].ctypes.data,
            slopes["hull"].ctypes.data if with_slopes else None,
        )
        return rows, slopes

    def wrench(self, rows: ByKind, factors: ByKind) -> Array:
        """Returns what messages add up to.

        Args:
            rows: of `rows`.
            factors: (..., m, k) of the rows' vectors, by a model.

        Returns:
            The wrench offset (..., 6) [N, N m].
        """
        return self._wrench(rows, factors, None, None)[0]

    def wrench_and_slope(
        self, rows: ByKind, slopes: ByKind, factors: ByKind, jacobians: ByKind
    ) -> tuple[Array, Array]:
        """Returns what messages add up to, and its derivatives.

        Args:
            rows: of `rows_and_slopes`.
            slopes: of `rows_and_slopes`.
            factors: (..., m, k) of the rows' vectors, by a model.
            jacobians: derivatives (..., m, k, f) of the factors by the features.

        Returns:
            The wrench offset (..., 6) [N, N m], and its derivatives (..., n, 3, 6) by the forces.
        """
        return self._wrench(rows, factors, slopes, jacobians)

    def _wrench(
        self, rows: ByKind, factors: ByKind, slopes: ByKind | None, jacobians: ByKind | None
    ) -> tuple[Array, Array]:
        """The offset, and where slopes are given its derivatives."""
        shape = rows["pair"].shape[:-2]
        offset = np.empty((*shape, 6))
        slope = np.empty((*shape, self._n, 3, 6) if slopes is not None else 0)
        records = np.zeros(2, struct("fl_messages"))
        arrays = []
        for record, kind in zip(records, ROW_SIZES, strict=True):
            fields = {"rows": rows[kind], "factors": factors[kind]}
            if slopes is not None and jacobians is not None:
                fields |= {"slopes": slopes[kind], "jacobians": jacobians[kind]}
            for name, array in fields.items():
                array = np.ascontiguousarray(array)
                arrays.append(array)  # which lives as long as the call
                record[name] = array.ctypes.data
        address = records.ctypes.data
        library().fl_message_wrench(
            self._table_address,
            math.prod(shape),
            address,
            address + records.strides[0],
            offset.ctypes.data,
            None if slopes is None else slope.ctypes.data,
        )
        return offset, slope


def unpack_rows(kind: str, rows: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Returns the contents of packed rows.

    Args:
        kind: which rows, a key of `ROW_SIZES`.
        rows: packed rows (..., f + 3 k).

    Returns:
        Features (..., f) and vectors (..., k, 3) [N].
    """
    size = ROW_SIZES[kind]
    features = rows[..., : size.features]
    vectors = rows[..., size.features :]
    return features, vectors.reshape(*rows.shape[:-1], size.vectors, 3)
