"""Where one thruster may stand and point, and its longest wrench by a metric, certified.

The wrench b of 1 N at place p along direction u is linear in each of them, b = G(p) u. So |C b|^2
is convex in the place, and its largest value is at an extreme place. Over all directions it is the
largest eigenvalue of G^T C^2 G; over a range of them, branch and bound over cells of both angles
encloses it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.analysis.keep_out import KeepOut, extreme_places
from finlab.analysis.moves import Bounds, turn_matrices
from finlab.arrays import Array
from finlab.axes import MIRROR_SIGNS
from finlab.errors import LayoutError
from finlab.forces.force_sets import SCALE

HALF_TURN = math.pi - 1e-9
"""Range of both angles from which on they point everywhere, up to the sign [rad]."""
FIRST_CELLS = 8
"""Cells along each angle at first."""
TOLERANCE = 1e-4
"""Share of the largest value by which an upper bound may exceed it."""
MAX_SPLITS = 30
"""Most times that cells are halved; each leaves a bound that holds."""
MAX_CELLS = 200_000
"""Most cells that are kept: further splits are left out."""


class Longest(NamedTuple):
    """The longest wrench of a pose set by a metric."""

    bound: float
    """No pose has a larger |C b|^2."""
    columns: Array
    """The longest wrench that was found at each place (K, m)."""


@dataclass(frozen=True)
class PoseSet:
    """Places and directions of one thruster. Equal sets compare equal."""

    places: tuple[tuple[float, float, float], ...]
    """Extreme places [m]."""
    axis: tuple[float, float, float] | None
    """Where it points at both angles 0; None where it may point anywhere."""
    turn: tuple[float, float]
    """Range of its turn about the vertical [rad]."""
    tilt: tuple[float, float]
    """Range of its tilt [rad]."""
    torque_per_newton: float
    """Reaction torque of its propeller per force [m]."""
    is_mirrored: bool
    """Whether it is the image of these places and directions in the plane y = 0."""

    @staticmethod
    def within(
        bounds: Bounds,
        axis: Array,
        azimuth: float,
        torque_per_newton: float,
        keep_outs: Sequence[KeepOut] = (),
        is_mirrored: bool = False,
    ) -> PoseSet:
        """Returns the poses within bounds.

        Args:
            bounds: bounds of its place and angles, or those of the thruster that it mirrors.
            axis: direction (3,) at the start, of that thruster as well.
            azimuth: what `Bounds.mounting_angle` is at the start [rad].
            torque_per_newton: its reaction torque per force [m].
            keep_outs: boxes in which it may not stand.
            is_mirrored: whether it mirrors another one.

        Raises:
            LayoutError: the keep-outs leave no place.
        """
        low, high = bounds.mounting_angle
        turn = (low - azimuth, high - azimuth)
        box = bounds.pairs[:3]
        if is_mirrored:
            # Keep-outs are not mirrored: the places are those of the image.
            box = np.sort(box * MIRROR_SIGNS[:, None], axis=1)
        places = extreme_places(box, keep_outs)
        if not len(places):
            raise LayoutError("keep-outs: expected some place of the bounds to be left, got none")
        points_anywhere = (
            turn[1] - turn[0] >= HALF_TURN and bounds.tilt[1] - bounds.tilt[0] >= HALF_TURN
        )
        if points_anywhere:
            axis_left, turn, tilt, is_mirrored = None, (0.0, 0.0), (0.0, 0.0), False
        else:
            axis_left, tilt = tuple(axis.tolist()), bounds.tilt
        return PoseSet(
            places=tuple(tuple(place) for place in places.tolist()),
            axis=axis_left,
            turn=turn,
            tilt=tilt,
            torque_per_newton=torque_per_newton,
            is_mirrored=is_mirrored,
        )

    @staticmethod
    def of_one(position: Array, axis: Array, torque_per_newton: float) -> PoseSet:
        """Returns the set of one pose: place (3,) [m] and direction (3,)."""
        place = tuple(position.tolist())
        still = (0.0, 0.0)
        return PoseSet((place,), tuple(axis.tolist()), still, still, torque_per_newton, False)

    @property
    def is_single(self) -> bool:
        """Whether it is one pose."""
        angles = (*self.turn, *self.tilt)
        is_still = self.axis is not None and angles == (self.turn[0],) * 2 + (self.tilt[0],) * 2
        return is_still and len(self.places) == 1

    def wrench_maps(self, rows: Sequence[int]) -> Array:
        """Returns the scaled wrenches G (K, m, 3) of 1 N along x, y and z at each place, in some
        rows of the wrench."""
        place = np.array(self.places)
        # tau = p x u + k u, with the reaction torque k u about the force.
        torque = -np.cross(np.eye(3), place[:, None]) + self.torque_per_newton * np.eye(3)
        force = np.broadcast_to(np.eye(3), torque.shape)
        wrench = np.concatenate([force, torque], axis=-1) / SCALE
        return np.asarray(np.swapaxes(wrench, -1, -2)[:, list(rows)])

    def directions(self, angles: Array) -> Array:
        """Returns unit vectors (S, 3) at turns and tilts (S, 2) [rad]."""
        axis = np.array([self.axis])
        turned = axis @ turn_matrices(axis, angles[:, :1], angles[:, 1:])[:, 0]
        signs = MIRROR_SIGNS if self.is_mirrored else np.ones(3)
        return np.asarray(turned[:, 0] * signs)

    def longest(self, metric: Array, rows: Sequence[int]) -> Longest:
        """Returns the longest wrench by a metric.

        Args:
            metric: symmetric matrix C (m, m).
            rows: rows of the wrench (m).
        """
        maps = self.wrench_maps(rows)
        metric_maps = metric @ maps
        # |C G u|^2 = u^T A u
        form = np.swapaxes(metric_maps, -1, -2) @ metric_maps
        if self.axis is None:
            values, vectors = np.linalg.eigh(form)
            columns = (maps @ vectors[..., -1:])[..., 0]
            return Longest(float(values[:, -1].max()), columns)
        return self._longest_within(form, maps)

    def _longest_within(self, form: Array, maps: Array) -> Longest:
        """The longest wrench over a range of directions, by branch and bound; forms A (K, 3, 3) and
        maps G (K, m, 3) of the places."""
        values = np.linalg.eigvalsh(form)
        curvature = values[:, -1] - values[:, 0]
        cells = _Cells.first(len(form), self.turn, self.tilt)
        best_value = np.full(len(form), -np.inf)
        best_direction = np.zeros((len(form), 3))
        settled = -np.inf
        for _ in range(MAX_SPLITS):
            direction = self.directions(cells.center)
            pulled = np.einsum("sij,sj->si", form[cells.place], direction)
            value = (direction * pulled).sum(axis=-1)
            # The slope of u^T A u along the sphere.
            slope = 2.0 * np.linalg.norm(pulled - value[:, None] * direction, axis=-1)
            # Along a great circle its second derivative is at most twice the spread of eigenvalues.
            radius = cells.radius
            upper = value + slope * radius + curvature[cells.place] * radius**2
            upper = np.minimum(upper, values[cells.place, -1])
            order = np.argsort(value, kind="stable")
            better = order[value[order] > best_value[cells.place[order]]]
            # Of several at one place the last one stays, which is the best.
            best_value[cells.place[better]] = value[better]
            best_direction[cells.place[better]] = direction[better]
            is_open = upper > (1.0 + TOLERANCE) * best_value.max()
            settled = max(settled, float(upper[~is_open].max(initial=-np.inf)))
            left = float(upper[is_open].max(initial=-np.inf))
            if not is_open.any() or 4 * int(is_open.sum()) > MAX_CELLS:
                break
            cells = cells.split(is_open)
        columns = np.einsum("kij,kj->ki", maps, best_direction)
        return Longest(max(settled, left), columns)


class _Cells(NamedTuple):
    """Cells of turn and tilt at places."""

    place: NDArray[np.intp]
    """Index of the place of each cell (S,)."""
    center: Array
    """Its turn and tilt (S, 2) [rad]."""
    half: Array
    """Half of its widths (S, 2) [rad]."""

    @staticmethod
    def first(n_places: int, turn: tuple[float, float], tilt: tuple[float, float]) -> _Cells:
        """Returns an even grid of cells for each place."""
        low, high = np.array([turn, tilt]).T
        half = 0.5 * (high - low) / FIRST_CELLS
        steps = 2.0 * np.arange(FIRST_CELLS) + 1.0
        turns, tilts = np.meshgrid(low[0] + steps * half[0], low[1] + steps * half[1])
        center = np.stack([turns.ravel(), tilts.ravel()], axis=-1)
        place = np.repeat(np.arange(n_places), len(center))
        halves = np.broadcast_to(half, (len(place), 2))
        return _Cells(place, np.tile(center, (n_places, 1)), halves)

    @property
    def radius(self) -> Array:
        """Largest angles between directions of each cell and that of its centre (S,) [rad]: turns
        and tilts move a direction by no more than their own angle."""
        return np.asarray(self.half.sum(axis=-1))

    def split(self, is_open: NDArray[np.bool_]) -> _Cells:
        """Returns the quarters of some cells, by a mask (S,)."""
        quarter = 0.5 * self.half[is_open]
        signs = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
        center = self.center[is_open][:, None] + signs * quarter[:, None]
        place = np.repeat(self.place[is_open], len(signs))
        halves = np.repeat(quarter, len(signs), axis=0)
        return _Cells(place, center.reshape(-1, 2), halves)
