"""Climbs one goal of improving a layout by steps within a trust region, within bounds and rules.

A step maximizes a model of the goal: the least of several linear functions, by a linear programme,
or one quadratic function whose curvature is learnt (BFGS), by sequential quadratic programming. See
J. Nocedal and S. J. Wright, Numerical Optimization, 2nd edition, chapter 4 for the trust region,
and procedure 18.2 for the damped update. `optimize` starts several climbs.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from finlab.analysis.moves import Moves
from finlab.analysis.slopes import GoalPoint, SlopedGoal, difference, nudged
from finlab.arrays import Array

CLEARANCE = 0.10
"""Least distance between two actuators [m]; those that are closer at the start may stay so."""
PENALTY = 1e3
"""Cost of a broken rule per metre: far beyond the value of any goal."""
ROUNDING = 1e-9
"""Length below which a rule counts as kept [m]."""
RADIUS_START = 0.1
"""Radius of the trust region at first, as a share of the bounds."""
RADIUS_MAX = 0.3
"""Largest radius."""
RADIUS_MIN = 2e-5
"""Radius below which a climb ends."""
SETTLED = 1e-5
"""Predicted gain of a step, as a share of the value, at which a climb ends."""
GAIN_ACCEPTED = 0.1
"""Share of the predicted gain from which on a step is taken: less would follow rounding errors."""
GAIN_GOOD = 0.5
"""Share of the predicted gain from which on the model is trusted further out."""
RADIUS_GROWTH = 2.0
"""Factor of the radius after a good step."""
RADIUS_SHRINK = 0.4
"""Factor of the radius after a step that was refused: the model was wrong there."""
RADIUS_SHRINK_RULES = 0.3
"""Factor of the radius where no part of a step keeps the rules; smaller, since nothing new was
learnt of the goal, and a try costs little."""
STEP_SHARES = (1.0, 0.5, 0.25)
"""Shares of a step that are tried in turn until one keeps the rules."""
MIN_CURVATURE = 1e-3
"""Least curvature from which the learning begins."""
DAMPING = 0.2
"""Share of the model's curvature along a step below which an update is damped (Nocedal and Wright,
procedure 18.2)."""
NEAR_PAIR = 4.0
"""Radii within which two actuators count as near each other: farther pairs cannot meet in a
step."""

Rule = Callable[[Array, Array], Array]
"""Returns how far actuators at positions (P, n, 3) [m] with own axes (P, n, 3, 3) break a rule,
(P,) [m]; 0 where they keep it."""


class Rules:
    """Rules for vectors of `Moves` besides their bounds: distances between actuators, and a rule of
    the caller."""

    def __init__(self, moves: Moves, rule: Rule | None) -> None:
        """Takes the moves, and another rule, if any."""
        self.moves = moves
        self._rule = rule
        self._pairs = np.triu_indices(moves.layout.n, k=1)
        distance = self._distances(moves.start_position[None])[0]
        self._distance_min = np.minimum(distance, CLEARANCE)

    def _distances(self, position: Array) -> Array:
        """Distances (P, pairs) [m] of all pairs of actuators at positions (P, n, 3) [m]."""
        first, second = self._pairs
        return np.asarray(np.linalg.norm(position[:, first] - position[:, second], axis=-1))

    def gaps(self, vectors: Array) -> Array:
        """Returns by how much the distances of actuators moved by vectors (P, D) exceed what is
        needed, (P, pairs) [m]."""
        return np.asarray(self._distances(self.moves.positions(vectors)) - self._distance_min)

    def violation(self, vectors: Array) -> Array:
        """Returns how far vectors (P, D) break the rules, (P,) [m]; 0 where they keep all."""
        too_close = np.maximum(-self.gaps(vectors) - ROUNDING, 0.0).sum(-1)
        if self._rule is None:
            return np.asarray(too_close)
        return np.asarray(too_close + self._rule(*self.moves.geometry(vectors)))


@dataclass
class Climb:
    """One climb; all steps are shares of the bounds' widths."""

    goal: SlopedGoal
    rules: Rules
    point: GoalPoint
    """Where it is."""
    radius: float = RADIUS_START
    """Radius of the trust region."""
    steps: int = 0
    """How many steps were tried."""
    _slopes: tuple[Array, Array] | None = None
    """The goal's slopes at the point, once they are known."""
    _curvature: Array | None = None
    """Curvature (D, D) of a goal with one slope, as far as it is known."""

    def __post_init__(self) -> None:
        moves = self.rules.moves
        self._low = moves.lower
        self._high = moves.upper
        self._width = moves.upper - moves.lower

    def step(self) -> None:
        """Takes one step where it gains enough of what the model predicts; else shrinks the trust
        region."""
        self.steps += 1
        if self._slopes is None:
            self._slopes = self.goal.slopes(self.point)
        step, predicted = self._best_step(*self._slopes)
        if predicted <= SETTLED * abs(self.point.value):
            self.radius = 0.0
            return
        proposed = np.clip(self.point.vector + step * self._width, self._low, self._high)
        vector = self._within_rules(proposed)
        if vector is None:
            self.radius *= RADIUS_SHRINK_RULES
            return
        trial = self.goal.evaluate(vector, self.point)
        trial_slopes = None
        if len(self._slopes[0]) == 1:
            trial_slopes = self.goal.slopes(trial)
            taken = (vector - self.point.vector) / self._width
            self._learn_curvature(taken, self._slopes[1][0] - trial_slopes[1][0])
        gain = trial.value - self.point.value
        if gain > GAIN_ACCEPTED * predicted:
            if gain > GAIN_GOOD * predicted:
                self.radius = min(RADIUS_GROWTH * self.radius, RADIUS_MAX)
            self.point = trial
            self._slopes = trial_slopes
        else:
            self.radius *= RADIUS_SHRINK
            if trial_slopes is None:
                # Faces that were found at the trial belong to the model here, too.
                self.point = self.goal.evaluate(self.point.vector, trial)
                self._slopes = None

    def rounded(self, grid: Moves) -> tuple[float, Array]:
        """Returns the best vector on a grid near the point, by the slopes, and its goal.

        It is found by changing one number after the other by a step of the grid.

        Args:
            grid: the same moves with a grid.

        Returns:
            The goal, minus infinity where the vector breaks a rule, and the vector (D,).
        """
        value, slope = self.goal.slopes(self.point)
        best = grid.on_grid(self.point.vector[None])
        changes = np.concatenate([np.zeros_like(best), np.diag(grid.step), -np.diag(grid.step)])

        def score(vectors: Array) -> Array:
            distance = np.abs(vectors - self.point.vector)
            is_near = (distance <= 1.5 * grid.step + ROUNDING).all(-1)
            predicted = value + (vectors - self.point.vector) / self._width @ slope.T
            cost = PENALTY * self.rules.violation(vectors)
            return np.asarray(np.where(is_near, predicted.min(-1), -np.inf) - cost)

        for _ in range(3 * len(slope[0])):
            candidates = grid.on_grid(best + changes)
            k = int(score(candidates).argmax())
            if k == 0:  # the vector itself
                break
            best = candidates[k : k + 1]
        if self.rules.violation(best)[0] > 0.0:
            return -np.inf, best[0]
        return self.goal.evaluate(best[0], self.point).value, best[0]

    def _learn_curvature(self, step: Array, slope_loss: Array) -> None:
        """Updates the curvature B by a damped BFGS step.

        With s the step, y the decrease of the slope along it and theta the damping,
        B <- B + y y^T / (s^T y) - B s s^T B / (s^T B s), where y <- theta y + (1 - theta) B s.

        Args:
            step: s, (D,).
            slope_loss: y, (D,).
        """
        if self._curvature is None:
            rayleigh = float(slope_loss @ step / (step @ step))
            self._curvature = np.eye(len(step)) * max(rayleigh, MIN_CURVATURE)
        predicted = self._curvature @ step
        model = float(step @ predicted)
        actual = float(step @ slope_loss)
        if actual < DAMPING * model:
            theta = (1.0 - DAMPING) * model / (model - actual)
            slope_loss = theta * slope_loss + (1.0 - theta) * predicted
        gained = np.outer(slope_loss, slope_loss) / (step @ slope_loss)
        self._curvature += gained - np.outer(predicted, predicted) / model

    def _best_step(self, value: Array, slope: Array) -> tuple[Array, float]:
        """The step within the trust region that gains most by the model, and that gain.

        Args:
            value: values (K,) of the linear functions at the point.
            slope: their slopes (K, D).

        Returns:
            The step (D,), and the gain.
        """
        from scipy.optimize import linprog  # here: an authority does not wait for scipy

        low = np.maximum((self._low - self.point.vector) / self._width, -self.radius)
        high = np.minimum((self._high - self.point.vector) / self._width, self.radius)
        gap = np.maximum(self.rules.gaps(self.point.vector[None])[0], 0.0)
        is_near = gap < NEAR_PAIR * self.radius * self._width.max()
        gap_slope = difference(self.rules.gaps(nudged(self.rules.moves, self.point.vector))).T
        gap = gap[is_near]
        gap_slope = gap_slope[is_near]
        if self._curvature is not None:
            return _best_quadratic_step(self._curvature, slope[0], low, high, gap_slope, gap)
        # Maximize t over (p, t) with t <= value + slope p, and gaps that stay open:
        # -slope p + t <= value, -gap_slope p <= gap.
        rows = np.concatenate(
            [np.c_[-slope, np.ones(len(value))], np.c_[-gap_slope, np.zeros(len(gap))]]
        )
        box = np.c_[np.append(low, -np.inf), np.append(high, np.inf)]
        cost = np.append(np.zeros(len(low)), -1.0)
        best = linprog(
            cost, A_ub=rows, b_ub=np.concatenate([value, gap]), bounds=box, method="highs"
        )
        if best.x is None:
            return np.zeros(len(low)), 0.0
        return best.x[:-1], float(best.x[-1] - value.min())

    def _within_rules(self, vector: Array) -> Array | None:
        """The largest part of a step that keeps all rules: a share of the step to a vector (D,), or
        of the numbers in it that keep them each by itself; None where nothing does."""
        if self.rules.violation(vector[None])[0] <= 0.0:
            return vector
        step = vector - self.point.vector
        keeps_alone = self.rules.violation(self.point.vector + np.diag(step)) <= 0.0
        for part in (step, step * keeps_alone):
            for share in STEP_SHARES:
                candidate = self.point.vector + share * part
                if part.any() and self.rules.violation(candidate[None])[0] <= 0.0:
                    return np.asarray(candidate)
        return None


def _best_quadratic_step(
    curvature: Array, slope: Array, low: Array, high: Array, gap_slope: Array, gap: Array
) -> tuple[Array, float]:
    """The step p that maximizes slope p - p^T B p / 2 within a box, and that gain.

    Args:
        curvature: B (D, D).
        slope: (D,).
        low: least step (D,).
        high: largest step (D,).
        gap_slope: slopes (m, D) of gaps that have to stay open.
        gap: the gaps (m,) [m].

    Returns:
        The step (D,), and the gain.
    """
    from scipy.optimize import Bounds, LinearConstraint, minimize

    constraints = [LinearConstraint(gap_slope, -gap, np.inf)] if len(gap) else []

    def loss(p: Array) -> tuple[float, Array]:
        return float(0.5 * p @ curvature @ p - slope @ p), curvature @ p - slope

    best = minimize(
        loss,
        np.zeros(len(slope)),
        jac=True,
        method="SLSQP" if constraints else "L-BFGS-B",
        bounds=Bounds(low, high),
        constraints=constraints,
    )
    return np.clip(best.x, low, high), -float(best.fun)
