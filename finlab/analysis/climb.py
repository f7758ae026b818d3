"""Climbs of a goal along its slopes, within bounds, and the slopes of the goals of improving a layout.

A goal of directions is the least of the distances of all faces of the set of wrenches, each of which changes
with the effectiveness matrix by the product of its normal and the forces at its foot. Least power changes by
the product of the prices of a wrench and the forces that give it (the envelope theorem, both).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.optimize import LinearConstraint, linprog, minimize

from finlab.allocation import Allocator
from finlab.analysis.goals import UNREACHED
from finlab.analysis.moves import Moves
from finlab.arrays import Array
from finlab.forces.force_sets import ForceSets
from finlab.forces.reach import COARSE, Largest, max_wrench_along, singular_values
from finlab.layout.effectiveness import moved_effectiveness
from finlab.physics.objective import REACHED

KEPT, DRAWN = 40, 8
"""Most faces that are followed, and random directions, both ways, that look for further ones in each look."""
ALIKE = 1.0 - 1e-5  # cosine between the normals of one face
NUDGE = 1e-6  # share of the bounds by which numbers change for a slope
FIRST, WIDEST, LEAST = 0.1, 0.3, 2e-4
"""Radii of the trust region, as shares of the bounds: the first, the largest, and the one at which a climb ends."""
SETTLED = 2e-4  # gain of a step, as a share of the value, at which a climb ends


class Look(NamedTuple):
    """A goal at one vector."""

    vector: Array
    value: float
    seen: Any
    """What its slopes are made of."""


class Slopes(NamedTuple):
    """A goal about a vector: the least of K linear functions of the change, as a share of the bounds."""

    value: Array
    """(K,)."""
    slope: Array
    """(K, D)."""


class Hill(Protocol):
    """A goal with slopes."""

    def look(self, vector: Array, before: Look | None = None) -> Look:
        """Returns the goal at a vector (D,), with what was seen at another."""

    def slopes(self, look: Look) -> Slopes:
        """Returns its slopes there."""


def _nudged(moves: Moves, vector: Array) -> Array:
    """Vectors (2 D, D) about one, each number up, then each down."""
    change = NUDGE * np.diag(moves.upper - moves.lower)
    return np.concatenate([vector + change, vector - change])


def _difference(values: Array) -> Array:
    """Slopes (D, ...) of values (2 D, ...) at `_nudged` vectors."""
    half = len(values) // 2
    return np.asarray((values[:half] - values[half:]) / (2.0 * NUDGE))


class _Faces(NamedTuple):
    """Some faces of the sets of wrenches of one robot or, after each loss, of several."""

    robot: Array
    normal: Array
    distance: Array
    force: Array


class Directions:
    """The weakest direction, after the worst loss or with all working."""

    def __init__(self, moves: Moves, places: Sequence[int], after_loss: bool) -> None:
        self._moves, self._places = moves, list(places)
        self._lost = np.arange(moves.layout.n) if after_loss else None
        self._drawn = np.random.default_rng(0)

    def _sets(self, vectors: Array) -> ForceSets:
        return self._moves.sets(vectors).along(self._places)

    def look(self, vector: Array, before: Look | None = None) -> Look:
        """See `Hill`."""
        sets = self._sets(vector[None])
        if self._lost is not None:
            sets = sets.repeat(len(self._lost))
            sets.lose(self._lost, self._lost)
        axes, robots = len(self._places), len(sets.radius)
        starts = self._drawn.standard_normal((robots, DRAWN, axes))
        if before is None:
            fixed = np.broadcast_to(np.eye(axes), (robots, axes, axes))
            vectors = singular_values(sets)[1].swapaxes(-1, -2)
            starts = np.concatenate([starts, starts[:, ::-1, ::-1], fixed, vectors], axis=1)
        starts = np.concatenate([starts, -starts], axis=1)
        robot = np.repeat(np.arange(robots), starts.shape[1])
        ends = self._walked(sets.take(robot), starts.reshape(-1, axes), 1 if before else 3).normal
        if before is not None:
            robot = np.append(robot, before.seen.robot)
            ends = np.concatenate([ends, before.seen.normal])
        rows = sets.take(robot)
        found = self._walked(rows, ends, 1)
        ends = found.normal / np.linalg.norm(found.normal, axis=-1, keepdims=True)
        distance = rows.farthest(ends)[0]
        kept: list[int] = []
        for k in np.argsort(distance, kind="stable"):
            same = [j for j in kept if robot[j] == robot[k]]
            if not same or (ends[same] @ ends[k]).max() < ALIKE:
                kept.append(int(k))
            if len(kept) == KEPT:
                break
        faces = _Faces(robot[kept], ends[kept], distance[kept], found.force[kept])
        return Look(vector, float(distance[kept[0]]), faces)

    @staticmethod
    def _walked(rows: ForceSets, ends: Array, times: int) -> Largest:
        """The faces that lie along directions, or along the normals of those."""
        for _ in range(times):
            found = max_wrench_along(rows, ends / np.linalg.norm(ends, axis=-1, keepdims=True), COARSE)
            ends = found.normal
        return found

    def slopes(self, look: Look) -> Slopes:
        """See `Hill`."""
        faces = look.seen
        change = _difference(self._sets(_nudged(self._moves, look.vector)).effectiveness)
        slope = np.einsum("kia,Diam,km->kD", faces.force, change, faces.normal, optimize=True)
        return Slopes(faces.distance, slope)


class Power:
    """Minus the mean least power of some wrenches (N, 6)."""

    def __init__(self, moves: Moves, mission: Array, flow: Array | None) -> None:
        self._moves, self._mission, self._flow = moves, mission, flow

    def look(self, vector: Array, before: Look | None = None) -> Look:
        """See `Hill`."""
        robot = Allocator(self._moves.moved(vector))
        answers = [robot.allocate(wrench, flow=self._flow) for wrench in self._mission]
        costs = [a.power if a.reachable else UNREACHED * (1.0 + a.err_norm) for a in answers]
        return Look(vector, -float(np.mean(costs)), answers)

    def slopes(self, look: Look) -> Slopes:
        """See `Hill`; of a wrench out of reach, by how far its direction is gone."""
        moves, total = self._moves, np.zeros(len(look.vector))
        frames = moves.geometry(look.vector[None])[1][0]
        change = _difference(moved_effectiveness(moves.layout, *moves.geometry(_nudged(moves, look.vector))))
        for wrench, answer in zip(self._mission, look.seen, strict=True):
            if answer.prices is None:
                continue
            own = np.einsum("nj,nij->ni", answer.forces, frames)
            gain = np.einsum("ni,Dnim,m->D", own, change, np.nan_to_num(answer.prices), optimize=True)
            if not answer.reachable:
                worth = float(np.nan_to_num(answer.prices) @ np.nan_to_num(wrench))
                size = UNREACHED * float(np.linalg.norm(np.nan_to_num(wrench) / answer.scale))
                gain = gain * (size / worth) if abs(worth) > 1e-9 else 0.0 * gain
            total += gain / len(self._mission)
        return Slopes(np.array([look.value]), total[None])


@dataclass
class Climb:
    """One climb, from where it begins."""

    hill: Hill
    moves: Moves
    gaps: Callable[[Array], Array]
    """What is left (P, C) [m] of distances that vectors (P, D) have to keep."""
    broken: Callable[[Array], Array]
    """How far vectors (P, D) break any rule (P,) [m]."""
    at: Look
    radius: float = FIRST
    steps: int = 0
    _slopes: Slopes | None = None
    _curve: Array | None = None

    @property
    def done(self) -> bool:
        """Whether no step is left that gains."""
        return self.radius < LEAST

    def step(self) -> None:
        """One step, if it gains; else a smaller trust region."""
        self.steps += 1
        if self._slopes is None:
            self._slopes = self.hill.slopes(self.at)
            if self._curve is None and len(self._slopes.value) == 1:
                self._curve = np.zeros((len(self.at.vector),) * 2)
        move, gain = self._best(self._slopes)
        if gain <= SETTLED * abs(self.at.value):
            self.radius = 0.0
            return
        width = self.moves.upper - self.moves.lower
        vector = self._keeping(np.clip(self.at.vector + move * width, self.moves.lower, self.moves.upper))
        if vector is None:
            self.radius *= 0.3
            return
        trial, slopes = self.hill.look(vector, self.at), None
        won = trial.value - self.at.value
        if self._curve is not None:
            slopes = self.hill.slopes(trial)
            self._bend((vector - self.at.vector) / width, self._slopes.slope[0] - slopes.slope[0])
        if won > 0.1 * gain or won > 10.0 * SETTLED * abs(self.at.value):
            self.radius = min(2.0 * self.radius, WIDEST) if won > 0.5 * gain else self.radius
            self.at, self._slopes = trial, slopes
        else:
            self.radius *= 0.4
            if self._curve is None:  # faces that were seen there first count here, too
                self.at, self._slopes = self.hill.look(self.at.vector, trial), None

    def _bend(self, step: Array, turn: Array) -> None:
        """Learn the curvature (BFGS, damped) from a step and how much less it is worth at its end."""
        assert self._curve is not None
        if not self._curve.any():
            self._curve = np.eye(len(step)) * max(float(turn @ step / (step @ step)), 1e-3)
        ahead = self._curve @ step
        bent, got = float(step @ ahead), float(step @ turn)
        if got < 0.2 * bent:
            share = 0.8 * bent / (bent - got)
            turn = share * turn + (1.0 - share) * ahead
        self._curve += np.outer(turn, turn) / (step @ turn) - np.outer(ahead, ahead) / bent

    def _best(self, slopes: Slopes) -> tuple[Array, float]:
        """The change (D,) within the trust region that gains most by the slopes, and how much."""
        width, size = self.moves.upper - self.moves.lower, len(self.at.vector)
        low = np.maximum((self.moves.lower - self.at.vector) / width, -self.radius)
        high = np.minimum((self.moves.upper - self.at.vector) / width, self.radius)
        left = self.gaps(self.at.vector[None])[0]
        near = left < 2.0 * self.radius * width.max()
        apart = _difference(self.gaps(_nudged(self.moves, self.at.vector))).T[near]
        if self._curve is not None:
            return self._bent(slopes.slope[0], low, high, apart, left[near])
        rows = np.concatenate([np.c_[-slopes.slope, np.ones(len(slopes.value))], np.c_[-apart, 0.0 * left[near]]])
        ends = np.concatenate([slopes.value, np.maximum(left[near], 0.0)])
        box = np.c_[np.append(low, -np.inf), np.append(high, np.inf)]
        best = linprog(np.append(np.zeros(size), -1.0), A_ub=rows, b_ub=ends, bounds=box, method="highs")
        if best.x is None:
            return np.zeros(size), 0.0
        return best.x[:size], float(best.x[size] - slopes.value.min())

    def _bent(self, slope: Array, low: Array, high: Array, apart: Array, left: Array) -> tuple[Array, float]:
        """The same of one slope and the curvature that is known."""
        curve = self._curve
        rules = [LinearConstraint(apart, -np.maximum(left, 0.0), np.inf)] if len(left) else []
        best = minimize(
            lambda p: (0.5 * p @ curve @ p - slope @ p, curve @ p - slope),
            np.zeros(len(slope)),
            jac=True,
            method="SLSQP" if rules else "L-BFGS-B",
            bounds=np.c_[low, high],
            constraints=rules,
        )
        return np.clip(best.x, low, high), -float(best.fun)

    def _keeping(self, vector: Array) -> Array | None:
        """Of a step to a vector, what keeps all rules: all of it, or the numbers that each do; None where
        nothing does."""
        if self.broken(vector[None])[0] <= 0.0:
            return vector
        step = vector - self.at.vector
        kept = step * (self.broken(self.at.vector + np.diag(step)) <= 0.0)
        for share in (1.0, 0.5, 0.25):
            tried = self.at.vector + share * kept
            if kept.any() and self.broken(tried[None])[0] <= 0.0:
                return np.asarray(tried)
        return None
