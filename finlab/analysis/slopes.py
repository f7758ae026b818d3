"""Slopes of the goals of improving a layout.

A goal of directions is the least of the distances of all faces of the set of wrenches, each of
which changes with the effectiveness matrix by the product of its normal and the forces at its foot.
Least power changes by the product of the prices of a wrench and the forces that give it (the
envelope theorem, both).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation import Allocator
from finlab.analysis.authority import MotionAxis, named_axes
from finlab.analysis.goals import UNREACHED
from finlab.analysis.moves import Moves
from finlab.arrays import Array
from finlab.axes import AXES as WRENCH
from finlab.forces.force_sets import SCALE, ForceSets
from finlab.forces.reach import RANK_TOLERANCE, max_wrench_along, singular_values
from finlab.layout.effectiveness import moved_effectiveness

KEPT, DRAWN = 60, 8
"""Most faces that are followed, and random directions, both ways, that look for further ones in
each look."""
FREE = 1e-3  # share of the largest effect on a face's distance up to which a force counts as free
FIRST_WALKS = 4  # walks from face to face in the first look; in those that follow it is one
ALIKE = 1.0 - 1e-5  # cosine between the normals of one face
NUDGE = 1e-6  # share of the bounds by which numbers change for a slope


class Look(NamedTuple):
    """A goal at one vector."""

    vector: Array
    value: float
    seen: Any
    """What its slopes are made of."""


def nudged(moves: Moves, vector: Array) -> Array:
    """Vectors (2 D, D) about one, each number up, then each down."""
    change = NUDGE * np.diag(moves.upper - moves.lower)
    return np.concatenate([vector + change, vector - change])


def difference(values: Array) -> Array:
    """Slopes (D, ...) of values (2 D, ...) at `nudged` vectors."""
    half = len(values) // 2
    return np.asarray((values[:half] - values[half:]) / (2.0 * NUDGE))


class _Faces(NamedTuple):
    """K faces of the sets of wrenches of one robot or, after each loss, of several."""

    robot: NDArray[np.intp]
    sets: ForceSets
    normal: Array
    distance: Array
    force: Array
    """Planar forces (K, n, 2) [N] that give a wrench on the face."""

    def foot_force(self) -> Array:
        """Planar forces (K, n, 2) [N], of which those that the face leaves free may exceed their
        limits, that give the wrench at the face's foot: the slope of its distance is as if its
        normal did not turn."""
        effect = np.linalg.norm(self.sets.pull(self.normal), axis=-1) * self.sets.radius
        free = effect <= FREE * effect.max(-1, keepdims=True)
        columns = (self.sets.effectiveness * free[..., None, None]).reshape(
            len(free), -1, self.normal.shape[-1]
        )
        missing = self.distance[:, None] * self.normal - self.sets.wrench(self.force)
        rest = missing[:, None] @ np.linalg.pinv(columns, rcond=FREE)
        return self.force + rest.reshape(self.force.shape)


class Directions:
    """The weakest direction, after the worst loss or with all working."""

    def __init__(self, moves: Moves, axes: Sequence[MotionAxis], after_loss: bool) -> None:
        self._moves = moves
        self._places = [WRENCH.index(axis) for axis in named_axes(axes)]
        self._lost = np.arange(moves.layout.n) if after_loss else None
        self._drawn = np.random.default_rng(0)

    def _sets(self, vectors: Array) -> ForceSets:
        return self._moves.sets(vectors).along(self._places)

    def guess(self, vectors: Array) -> Array:
        """Returns what vectors (P, D) promise (P,): smallest singular values."""
        sets = self._left(self._sets(vectors))
        return np.asarray(singular_values(sets)[0][:, -1].reshape(len(vectors), -1).min(-1))

    def _left(self, sets: ForceSets) -> ForceSets:
        """Of P robots, what is left after each loss, if that counts."""
        if self._lost is not None:
            robots = len(sets.radius)
            sets = sets.repeat(len(self._lost))
            sets.lose(np.arange(len(sets.radius)), np.tile(self._lost, robots))
        return sets

    def look(self, vector: Array, before: Look | None = None) -> Look:
        """Returns the goal at a vector (D,), with the faces that were seen at another."""
        sets = self._left(self._sets(vector[None]))
        axes = len(self._places)
        robots = len(sets.radius)
        starts = self._drawn.standard_normal((robots, DRAWN if before else 2 * DRAWN, axes))
        if before is None:
            fixed = np.broadcast_to(np.eye(axes), (robots, axes, axes))
            starts = np.concatenate(
                [starts, fixed, singular_values(sets)[1].swapaxes(-1, -2)], axis=1
            )
        ends = np.concatenate([starts, -starts], axis=1).reshape(-1, axes)
        robot = np.repeat(np.arange(robots), len(ends) // robots)
        if before is not None:
            robot = np.append(robot, before.seen.robot)
            ends = np.concatenate([ends, before.seen.normal])
        rows = sets.take(robot)
        for _ in range(1 if before else FIRST_WALKS):
            ends /= np.linalg.norm(ends, axis=-1, keepdims=True)
            found = max_wrench_along(rows, ends)
            ends = found.normal
        ends = ends / np.linalg.norm(ends, axis=-1, keepdims=True)
        distance = rows.farthest(ends)[0]
        alike = (ends @ ends.T >= ALIKE) & (robot[:, None] == robot)
        order = np.argsort(distance, kind="stable")
        # Of faces that are alike the nearest counts.
        kept = order[np.tril(alike[np.ix_(order, order)], -1).sum(axis=1) == 0][:KEPT]
        faces = _Faces(robot[kept], rows.take(kept), ends[kept], distance[kept], found.force[kept])
        return Look(vector, float(distance[kept[0]]), faces)

    def slopes(self, look: Look) -> tuple[Array, Array]:
        """Returns the goal about a vector as the least of K linear functions of the change, a share
        of the bounds: values (K,) and slopes (K, D)."""
        faces = look.seen
        change = difference(self._sets(nudged(self._moves, look.vector)).effectiveness)
        slope = np.einsum(
            "kia,Diam,km->kD", faces.foot_force(), change, faces.normal, optimize=True
        )
        return faces.distance, slope


class Power:
    """Minus the mean least power of some wrenches (N, 6)."""

    def __init__(self, moves: Moves, mission: ArrayLike, flow: Array | None) -> None:
        self._moves = moves
        self._mission = np.asarray(mission, np.float64)
        self._flow = flow

    def guess(self, vectors: Array) -> Array:
        """Returns what vectors (P, D) promise (P,): minus squares of what is missing, and far
        behind of the least shares of the largest forces."""
        full = self._moves.sets(vectors).full_effectiveness()
        wanted = np.nan_to_num(self._mission) / SCALE
        share = wanted @ np.linalg.pinv(full, rcond=RANK_TOLERANCE)
        missing = wanted - share @ full
        return np.asarray(-(share**2).sum((-1, -2)) - (missing**2).sum((-1, -2)) / NUDGE)

    def look(self, vector: Array, before: Look | None = None) -> Look:
        """Returns the goal at a vector (D,)."""
        robot = Allocator(self._moves.moved(vector))
        answers = [robot.allocate(wrench, flow=self._flow) for wrench in self._mission]
        costs = [a.power if a.reachable else UNREACHED * (1.0 + a.err_norm) for a in answers]
        return Look(vector, -float(np.mean(costs)), answers)

    def slopes(self, look: Look) -> tuple[Array, Array]:
        """Returns value (1,) and slopes (1, D), as for `Directions`; of a wrench out of reach, of
        what is missing."""
        moves = self._moves
        total = np.zeros(len(look.vector))
        frames = moves.geometry(look.vector[None])[1][0]
        change = difference(
            moved_effectiveness(moves.layout, *moves.geometry(nudged(moves, look.vector)))
        )
        for answer in look.seen:
            prices = answer.prices
            if not answer.reachable:
                prices = UNREACHED * answer.unallocated / answer.scale**2 / answer.err_norm
            if prices is not None:
                own = np.einsum("nj,nij->ni", answer.forces, frames)
                gain = np.einsum("ni,Dnim,m->D", own, change, np.nan_to_num(prices), optimize=True)
                total += gain / len(look.seen)
        return np.array([look.value]), total[None]


Hill = Directions | Power
