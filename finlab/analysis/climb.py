"""A climb of one goal along its slopes, within bounds and rules, by steps within a trust region."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, linprog, minimize

from finlab.analysis.moves import Moves
from finlab.analysis.slopes import Hill, Look, difference, nudged
from finlab.arrays import Array

CLEARANCE = (
    0.10  # least distance between two actuators [m]; those that are closer already need not part
)
# cost of actuators that are too close or break another rule, per metre; far beyond any goal
PENALTY = 1e3
ROUNDING = 1e-9  # distance [m] that counts for nothing
FIRST, WIDEST, LEAST = 0.1, 0.3, 2e-5
"""Radii of the trust region, shares of the bounds: at first, at most, and where a climb ends."""
SETTLED = 1e-5  # gain of a step, as a share of the value, at which a climb ends

Rule = Callable[[Array, Array], Array]
"""How far actuators at positions (P, n, 3) [m] with own axes (P, n, 3, 3) break a rule (P,) [m]; 0
where they keep it."""


class Rules:
    """What vectors have to keep beside their bounds: distances between actuators, a rule of the
    caller."""

    def __init__(self, moves: Moves, rule: Rule | None) -> None:
        self.moves = moves
        self._rule = rule
        self._pairs = np.triu_indices(moves.layout.n, k=1)
        self._needed = np.minimum(self._apart(moves.start_position[None])[0], CLEARANCE)

    def _apart(self, position: Array) -> Array:
        first, second = self._pairs
        return np.asarray(np.linalg.norm(position[:, first] - position[:, second], axis=-1))

    def gaps(self, vectors: Array) -> Array:
        """Returns by how much (P, pairs) [m] actuators moved by vectors (P, D) are farther apart
        than they have to be."""
        return np.asarray(self._apart(self.moves.positions(vectors)) - self._needed)

    def broken(self, vectors: Array) -> Array:
        """Returns how far vectors (P, D) break the rules (P,) [m]."""
        close = np.maximum(-self.gaps(vectors) - ROUNDING, 0.0).sum(-1)
        return np.asarray(
            close if self._rule is None else close + self._rule(*self.moves.geometry(vectors))
        )


@dataclass
class Climb:
    """One climb, from where it begins."""

    hill: Hill
    rules: Rules
    at: Look
    """Where it is."""
    radius: float = FIRST
    steps: int = 0
    _slopes: tuple[Array, Array] | None = None
    _curve: Array | None = None
    """Curvature (D, D) of a goal with one slope, as far as it is known."""

    def __post_init__(self) -> None:
        moves = self.rules.moves
        self._low = moves.lower
        self._high = moves.upper
        self._width = moves.upper - moves.lower

    def step(self) -> None:
        """Take one step, if it gains; else make the trust region smaller."""
        self.steps += 1
        if self._slopes is None:
            self._slopes = self.hill.slopes(self.at)
        move, gain = self._best(*self._slopes)
        if gain <= SETTLED * abs(self.at.value):
            self.radius = 0.0
            return
        vector = self._keeping(np.clip(self.at.vector + move * self._width, self._low, self._high))
        if vector is None:
            self.radius *= 0.3
            return
        trial = self.hill.look(vector, self.at)
        slopes = None
        if len(self._slopes[0]) == 1:
            slopes = self.hill.slopes(trial)
            self._bend((vector - self.at.vector) / self._width, self._slopes[1][0] - slopes[1][0])
        won = trial.value - self.at.value
        if won > 0.1 * gain:
            self.radius = min(2.0 * self.radius, WIDEST) if won > 0.5 * gain else self.radius
            self.at = trial
            self._slopes = slopes
        else:
            self.radius *= 0.4
            if slopes is None:  # faces that were seen there first count here, too
                self.at = self.hill.look(self.at.vector, trial)
                self._slopes = None

    def rounded(self, grid: Moves) -> tuple[float, Array]:
        """Returns a vector (D,) on a grid nearby that is best by the slopes, one number after the
        other, and its goal; minus infinity where it breaks a rule."""
        value, slope = self.hill.slopes(self.at)
        best = grid.on_grid(self.at.vector[None])
        change = np.concatenate([np.zeros_like(best), np.diag(grid.step), -np.diag(grid.step)])

        def worth(vectors: Array) -> Array:
            near = np.abs(vectors - self.at.vector) <= 1.5 * grid.step + ROUNDING
            ahead = value + (vectors - self.at.vector) / self._width @ slope.T
            return np.asarray(
                np.where(near.all(-1), ahead.min(-1), -np.inf)
                - PENALTY * self.rules.broken(vectors)
            )

        for _ in range(3 * len(slope[0])):
            tried = grid.on_grid(best + change)
            first = int(worth(tried).argmax())
            if first == 0:
                break
            best = tried[first : first + 1]
        kept = self.rules.broken(best)[0] <= 0.0
        return self.hill.look(best[0], self.at).value if kept else -np.inf, best[0]

    def _bend(self, step: Array, turn: Array) -> None:
        """Learn the curvature (BFGS, damped) from a step and by how much the slope is less at its
        end."""
        if self._curve is None:
            self._curve = np.eye(len(step)) * max(float(turn @ step / (step @ step)), 1e-3)
        ahead = self._curve @ step
        bent = float(step @ ahead)
        got = float(step @ turn)
        if got < 0.2 * bent:
            share = 0.8 * bent / (bent - got)
            turn = share * turn + (1.0 - share) * ahead
        self._curve += np.outer(turn, turn) / (step @ turn) - np.outer(ahead, ahead) / bent

    def _best(self, value: Array, slope: Array) -> tuple[Array, float]:
        """The change (D,) within the trust region that gains most by the slopes, and how much."""
        low = np.maximum((self._low - self.at.vector) / self._width, -self.radius)
        high = np.minimum((self._high - self.at.vector) / self._width, self.radius)
        left = np.maximum(self.rules.gaps(self.at.vector[None])[0], 0.0)
        near = left < 4.0 * self.radius * self._width.max()
        apart = difference(self.rules.gaps(nudged(self.rules.moves, self.at.vector))).T[near]
        left = left[near]
        if self._curve is not None:
            return self._bent(self._curve, slope[0], (low, high), apart, left)
        rows = np.concatenate(
            [np.c_[-slope, np.ones(len(value))], np.c_[-apart, np.zeros(len(left))]]
        )
        box = np.c_[np.append(low, -np.inf), np.append(high, np.inf)]
        cost = np.append(np.zeros(len(low)), -1.0)
        best = linprog(
            cost, A_ub=rows, b_ub=np.concatenate([value, left]), bounds=box, method="highs"
        )
        if best.x is None:
            return np.zeros(len(low)), 0.0
        return best.x[:-1], float(best.x[-1] - value.min())

    @staticmethod
    def _bent(
        curve: Array, slope: Array, box: tuple[Array, Array], apart: Array, left: Array
    ) -> tuple[Array, float]:
        """The same of one slope whose curvature is known."""
        rules = [LinearConstraint(apart, -left, np.inf)] if len(left) else []
        best = minimize(
            lambda p: (0.5 * p @ curve @ p - slope @ p, curve @ p - slope),
            np.zeros(len(slope)),
            jac=True,
            method="SLSQP" if rules else "L-BFGS-B",
            bounds=Bounds(*box),
            constraints=rules,
        )
        return np.clip(best.x, *box), -float(best.fun)

    def _keeping(self, vector: Array) -> Array | None:
        """Of a step to a vector, what keeps all rules: all of it, or the numbers that do so each;
        None where nothing does."""
        if self.rules.broken(vector[None])[0] <= 0.0:
            return vector
        step = vector - self.at.vector
        kept = step * (self.rules.broken(self.at.vector + np.diag(step)) <= 0.0)
        for part in (step, kept):
            for share in (1.0, 0.5, 0.25):
                tried = self.at.vector + share * part
                if part.any() and self.rules.broken(tried[None])[0] <= 0.0:
                    return np.asarray(tried)
        return None
