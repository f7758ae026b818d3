"""The goals of improving a layout with their slopes, as `climb` follows them.

A goal of directions is the least of the distances of all faces of the attainable set, each of which
changes with the effectiveness matrix by the product of its normal and the forces at its foot. Least
power changes by the product of the prices of a wrench and the forces that give it. Both follow from
the envelope theorem. `goals` has the same goals without slopes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation import Allocator
from finlab.analysis.authority import named_axes
from finlab.analysis.goals import UNREACHED
from finlab.analysis.moves import Moves
from finlab.arrays import Array
from finlab.axes import AXES as WRENCH
from finlab.axes import MotionAxis
from finlab.forces.force_sets import SCALE, ForceSets
from finlab.forces.reach import RANK_TOLERANCE, max_wrench_along, singular_values
from finlab.layout.effectiveness import moved_effectiveness

MAX_FACES = 60
"""Most faces that are followed."""
RANDOM_DIRECTIONS = 8
"""Random directions, both ways, in which further faces are sought at each evaluation."""
FREE_SHARE = 1e-3
"""Share of the largest effect on a face's distance up to which a force counts as free."""
FIRST_WALKS = 4
"""Walks from face to face at the first evaluation; later ones take one."""
SAME_FACE = 1.0 - 1e-5
"""Least cosine between the normals of one face."""
NUDGE = 1e-6
"""Share of the bounds by which numbers change for a difference quotient."""


class GoalPoint(NamedTuple):
    """A goal evaluated at one vector."""

    vector: Array
    """The vector of `Moves`, (D,)."""
    value: float
    """The goal there; more is better."""
    data: Any
    """What the goal computes its slopes from: faces, or answers."""


def nudged(moves: Moves, vector: Array) -> Array:
    """Returns vectors (2 D, D) near one (D,), each number up, then each down."""
    change = NUDGE * np.diag(moves.upper - moves.lower)
    return np.concatenate([vector + change, vector - change])


def difference(values: Array) -> Array:
    """Returns the slopes (D, ...) of values (2 D, ...) at `nudged` vectors, per share of the
    bounds."""
    half = len(values) // 2
    return np.asarray((values[:half] - values[half:]) / (2.0 * NUDGE))


class _Faces(NamedTuple):
    """K faces of the attainable sets of one robot or, after each loss, of several."""

    robot: NDArray[np.intp]
    """Index of the robot of each face (K,)."""
    sets: ForceSets
    """Force sets of these robots, K rows."""
    normal: Array
    """Unit normals (K, m) in the axes that count, scaled."""
    distance: Array
    """Distances from the origin (K,) [N, scaled]."""
    force: Array
    """Planar forces (K, n, 2) [N] that give a wrench on the face."""

    def foot_force(self) -> Array:
        """Returns planar forces (K, n, 2) [N] that give the wrench at the face's foot.

        Forces that the face leaves free may exceed their limits. With these forces the slope of the
        distance is as if the normal did not turn.
        """
        effect = np.linalg.norm(self.sets.pull(self.normal), axis=-1) * self.sets.radius
        is_free = effect <= FREE_SHARE * effect.max(-1, keepdims=True)
        columns = (self.sets.effectiveness * is_free[..., None, None]).reshape(
            len(is_free), -1, self.normal.shape[-1]
        )
        missing = self.distance[:, None] * self.normal - self.sets.wrench(self.force)
        correction = missing[:, None] @ np.linalg.pinv(columns, rcond=FREE_SHARE)
        return self.force + correction.reshape(self.force.shape)


class WeakestDirection:
    """The weakest direction, after the worst loss or with all working."""

    def __init__(self, moves: Moves, axes: Sequence[MotionAxis], after_loss: bool) -> None:
        """Takes the moves.

        Args:
            moves: how the actuators may move.
            axes: the axes whose directions count.
            after_loss: whether the goal is the least after the loss of any one actuator.
        """
        self._moves = moves
        self._axes = [WRENCH.index(axis) for axis in named_axes(axes)]
        self._losses = np.arange(moves.layout.n) if after_loss else None
        self.n_axes = len(self._axes)
        self.after_loss = after_loss
        self._random = np.random.default_rng(0)

    def _sets(self, vectors: Array) -> ForceSets:
        """Force sets of the actuators moved by vectors (P, D), in the axes that count."""
        return self._moves.sets(vectors).along(self._axes)

    def columns(self, vectors: Array) -> Array:
        """Returns the scaled wrenches (P, n, m) of 1 N of each actuator along the first direction
        of its plane, the only one of a thruster."""
        return np.asarray(self._sets(vectors).effectiveness[:, :, 0])

    def guess(self, vectors: Array) -> Array:
        """Returns a quick measure (P,) to rank vectors (P, D) by: smallest singular values."""
        sets = self._after_losses(self._sets(vectors))
        return np.asarray(singular_values(sets)[0][:, -1].reshape(len(vectors), -1).min(-1))

    def _after_losses(self, sets: ForceSets) -> ForceSets:
        """The sets of P robots after each loss (P n), where losses count; else the sets."""
        if self._losses is not None:
            robots = len(sets.radius)
            sets = sets.repeat(len(self._losses))
            sets.lose(np.arange(len(sets.radius)), np.tile(self._losses, robots))
        return sets

    def evaluate(self, vector: Array, previous: GoalPoint | None = None) -> GoalPoint:
        """Returns the goal at a vector.

        Args:
            vector: (D,).
            previous: the goal at another vector, whose faces are followed to this one; with None
                faces are sought anew, by more walks.
        """
        sets = self._after_losses(self._sets(vector[None]))
        n_axes = len(self._axes)
        robots = len(sets.radius)
        n_random = RANDOM_DIRECTIONS if previous else 2 * RANDOM_DIRECTIONS
        starts = self._random.standard_normal((robots, n_random, n_axes))
        if previous is None:
            fixed = np.broadcast_to(np.eye(n_axes), (robots, n_axes, n_axes))
            starts = np.concatenate(
                [starts, fixed, singular_values(sets)[1].swapaxes(-1, -2)], axis=1
            )
        normals = np.concatenate([starts, -starts], axis=1).reshape(-1, n_axes)
        robot = np.repeat(np.arange(robots), len(normals) // robots)
        if previous is not None:
            robot = np.append(robot, previous.data.robot)
            normals = np.concatenate([normals, previous.data.normal])
        rows = sets.take(robot)
        for _ in range(1 if previous else FIRST_WALKS):
            normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
            supports = max_wrench_along(rows, normals)
            normals = supports.normal
        normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
        distance = rows.farthest(normals)[0]
        is_same = (normals @ normals.T >= SAME_FACE) & (robot[:, None] == robot)
        order = np.argsort(distance, kind="stable")
        # Of directions with the same face the nearest counts.
        has_nearer = np.tril(is_same[np.ix_(order, order)], -1).sum(axis=1) > 0
        chosen = order[~has_nearer][:MAX_FACES]
        faces = _Faces(
            robot=robot[chosen],
            sets=rows.take(chosen),
            normal=normals[chosen],
            distance=distance[chosen],
            force=supports.force[chosen],
        )
        return GoalPoint(vector, float(distance[chosen[0]]), faces)

    def slopes(self, point: GoalPoint) -> tuple[Array, Array]:
        """Returns the goal near a point as the least of K linear functions of the change: values
        (K,) and slopes (K, D) per share of the bounds."""
        faces = point.data
        change = difference(self._sets(nudged(self._moves, point.vector)).effectiveness)
        slope = np.einsum(
            "kia,Diam,km->kD", faces.foot_force(), change, faces.normal, optimize=True
        )
        return faces.distance, slope


class MissionPower:
    """Minus the mean least power of some wrenches."""

    def __init__(self, moves: Moves, mission: ArrayLike, flow: Array | None) -> None:
        """Takes the moves.

        Args:
            moves: how the actuators may move.
            mission: wrenches (N, 6) [N, N m].
            flow: velocity (6,) relative to the water [m/s, rad/s]; None at rest.
        """
        self._moves = moves
        self._mission = np.asarray(mission, np.float64)
        self._flow = flow

    def guess(self, vectors: Array) -> Array:
        """Returns a quick measure (P,) to rank vectors (P, D) by: minus the squares of the missing
        wrenches, and with a small weight of the least shares of the largest forces."""
        full = self._moves.sets(vectors).full_effectiveness()
        demand = np.nan_to_num(self._mission) / SCALE
        share = demand @ np.linalg.pinv(full, rcond=RANK_TOLERANCE)
        missing = demand - share @ full
        return np.asarray(-(share**2).sum((-1, -2)) - (missing**2).sum((-1, -2)) / NUDGE)

    def evaluate(self, vector: Array, previous: GoalPoint | None = None) -> GoalPoint:
        """Returns the goal at a vector (D,)."""
        robot = Allocator(self._moves.moved(vector))
        answers = [robot.allocate(wrench, flow=self._flow) for wrench in self._mission]
        costs = [a.power if a.reachable else UNREACHED * (1.0 + a.err_norm) for a in answers]
        return GoalPoint(vector, -float(np.mean(costs)), answers)

    def slopes(self, point: GoalPoint) -> tuple[Array, Array]:
        """Returns value (1,) and slopes (1, D), as for `WeakestDirection`; of a wrench out of reach
        those of the missing wrench."""
        moves = self._moves
        total = np.zeros(len(point.vector))
        frames = moves.geometry(point.vector[None])[1][0]
        change = difference(
            moved_effectiveness(moves.layout, *moves.geometry(nudged(moves, point.vector)))
        )
        for answer in point.data:
            multipliers = answer.multipliers
            if not answer.reachable:
                multipliers = UNREACHED * answer.unallocated / answer.scale**2 / answer.err_norm
            if multipliers is not None:
                force = np.einsum("nj,nij->ni", answer.forces, frames)
                effect = np.einsum(
                    "ni,Dnim,m->D", force, change, np.nan_to_num(multipliers), optimize=True
                )
                total += effect / len(point.data)
        return np.array([point.value]), total[None]


SlopedGoal = WeakestDirection | MissionPower
"""A goal with slopes."""
