"""The search for a vector of moves that raises a goal.

`climb` follows the goal's slopes from several starts, of many free thrusters also from those of
`soft_ascent`; where it finds nothing better, or the goal has no slopes, SciPy's differential
evolution searches.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from finlab.analysis.climb import PENALTY, RADIUS_MIN, Climb, Rules
from finlab.analysis.goals import Goal
from finlab.analysis.moves import Moves
from finlab.analysis.slopes import GoalPoint, SlopedGoal, WeakestDirection
from finlab.analysis.soft_ascent import SoftAscent, has_few_facets
from finlab.arrays import Array
from finlab.layout import Layout

MapParts = Callable[[Callable[[Any], Any], Sequence[Any]], Iterable[Any]]
"""Applies a function to the parts of a piece of work; returns its results, in order."""
CHUNK_VARIANTS = 16
"""Variants that are measured together: sets of 64 actuators take much memory."""
STEPS_PER_ROUND = 10
"""Steps of a climb that count as a round."""
RANDOM_VECTORS = 64
"""Random vectors from which starts are chosen."""
MAX_DRAWS = 20
"""Most times that random vectors are drawn until enough of them keep all rules."""
RANKED_PER_START = 6
"""Most vectors that are ranked for each start."""
ASCENTS = 24
"""Random vectors from which the smooth goal of thrusters is raised."""
HOPS = 2
"""How often the best of them hop."""
MAX_RAISED = 24
"""Most raised vectors that are kept from search to search."""
RAISED_STARTS = 3
"""The best of these, from which climbs begin."""
MIN_ASCENT = 20
"""Fewest free numbers from which on it is raised: with fewer, the climbs are many."""
STARTS_SCALE = 2800
"""Number of climbs times the square of the free numbers: a step's time grows with that square."""
MIN_STARTS = 3
"""Fewest climbs."""
MAX_STARTS = 20
"""Most climbs."""
FIRST_STEPS = 12
"""Steps of each climb before they are compared."""
MAX_STEPS = 60
"""Most steps of a climb that goes on."""
MIN_GAIN = 1e-4
"""Share of the goal that a climb has to gain to count."""
FINALISTS = 3
"""One of so many climbs goes on: the best."""


@dataclass(frozen=True)
class Progress:
    """The state of a search after a round."""

    round: int
    """Rounds that are done."""
    n_rounds: int
    """Most rounds."""
    before: float
    """The goal at the start; more is better."""
    best: float
    """The best goal so far, to about a percent."""
    layout: Layout
    """The layout that has it."""


class LayoutSearch:
    """One search: the best vector so far, and the rounds that it has taken."""

    def __init__(
        self,
        moves: Moves,
        rules: Rules,
        before: float,
        rounds: int,
        progress: Callable[[Progress], None] | None,
        cancelled: Callable[[], bool] | None,
        mapped: MapParts,
    ) -> None:
        self._moves = moves
        self._rules = rules
        self._before = before
        self._rounds = rounds
        self._progress = progress
        self._cancelled = cancelled or (lambda: False)
        self._mapped = mapped
        self._ascent: SoftAscent | None = None
        self._raised = np.zeros((0, len(moves.start)))
        self.vector = moves.start
        self.best = before
        self.gained = False
        self.stopped = False
        self._starts_within_rules = rules.violation(moves.start[None])[0] <= 0.0
        if not self._starts_within_rules:
            self.best = -np.inf
        self._done = self._steps = 0

    def _note(self, value: float, vector: Array) -> None:
        """Keeps a vector that keeps all rules, where it is the best so far."""
        if value > self.best and self._ascent is not None:
            # A climb may miss the nearest facet.
            value = min(value, float(self._ascent.least_distances(vector[None])[0]))
        if value > self.best:
            self.best = value
            self.vector = vector
        if not self._starts_within_rules or value > self._before + MIN_GAIN * abs(self._before):
            self.gained = True

    def _after_round(self, *_: object) -> bool:
        """Counts a round and reports it; returns whether to stop."""
        self._done += 1
        if self._progress is not None:
            best = max(self.best, self._before)
            robot = self._moves.moved(self.vector)
            self._progress(Progress(self._done, self._rounds, self._before, best, robot))
        self.stopped = self._cancelled()
        return self.stopped or self._done >= self._rounds

    def climb_often(self, goal: SlopedGoal, seed: int, searches: int) -> None:
        """Climbs with some seeds in turn, with the present vector by the first."""
        for number in range(searches):
            self.climb(goal, seed + number, with_present=number == 0)
            if self.stopped:
                return

    def climb(self, goal: SlopedGoal, seed: int, with_present: bool) -> None:
        """Climbs from several starts, among them the present vector where it is to be, and of many
        free thrusters from those of an ascent of a smooth goal, too."""
        moves = self._moves
        if isinstance(goal, WeakestDirection) and has_few_facets(goal, moves.layout):
            self._ascent = SoftAscent(goal, self._rules)
        self._climb_from(goal, self._starts(goal, seed, with_present))
        is_over = self.stopped or self._done >= self._rounds
        if self._ascent is not None and not is_over and len(moves.start) >= MIN_ASCENT:
            self._climb_from(goal, self._raised_starts(goal, self._ascent, seed))

    def _climb_from(self, goal: SlopedGoal, starts: Iterator[GoalPoint]) -> None:
        """Climbs a few steps from each start, then on from the best of them, and rounds the results
        to the grid."""
        best = self.best
        vector = self.vector
        had_gained = self.gained
        self.stopped = self._cancelled()
        climbs = list[Climb]()
        for start in starts if not self.stopped else ():
            climbs.append(Climb(goal, self._rules, start))
            if self._climbed(climbs[-1], FIRST_STEPS):
                break
        else:
            climbs.sort(key=lambda climb: -climb.point.value)
            for climb in climbs[: max(1, len(climbs) // FINALISTS)]:
                self._climbed(climb, MAX_STEPS)
        if self._moves.step.any() and self.gained:
            self.best = best
            self.vector = vector
            self.gained = had_gained
            for climb in sorted(climbs, key=lambda climb: -climb.point.value)[:3]:
                self._note(*climb.rounded(self._moves))

    def _starts(self, goal: SlopedGoal, seed: int, with_present: bool) -> Iterator[GoalPoint]:
        """Yields the present vector, where it is to be, and the best of some random ones that keep
        all rules; of these half as they are, and half mirrored like the robot."""
        moves = self._moves
        random = np.random.default_rng(seed)
        if with_present and self._starts_within_rules:
            yield goal.evaluate(moves.start)
        vectors = random.uniform(moves.lower, moves.upper, (RANDOM_VECTORS, len(moves.start)))
        is_mirrored = [False] if np.array_equal(vectors, moves.mirrored(vectors)) else [False, True]
        count = (
            int(np.clip(round(STARTS_SCALE / len(moves.start) ** 2), MIN_STARTS, MAX_STARTS)) - 1
        )
        n_best = -(-count // len(is_mirrored))
        for mirrored in is_mirrored:
            valid = self._valid(vectors, mirrored, RANKED_PER_START * n_best, random)
            if not len(valid):
                continue
            for k in np.argsort(-goal.guess(valid), kind="stable")[:n_best]:
                yield goal.evaluate(valid[k])

    def _raised_starts(
        self, goal: SlopedGoal, ascent: SoftAscent, seed: int
    ) -> Iterator[GoalPoint]:
        """Yields the best vectors after an ascent of a smooth goal from random ones, and after hops
        from the best of these and of former searches."""
        moves = self._moves
        random = np.random.default_rng(seed)
        vectors = random.uniform(moves.lower, moves.upper, (RANDOM_VECTORS, len(moves.start)))
        valid = self._valid(vectors, False, ASCENTS, random)
        if len(valid):
            self._keep_raised(ascent, ascent.raised(valid, self._cancelled))
        for _ in range(HOPS):
            if len(self._raised) and not self._cancelled():
                hopped = ascent.hopped(self._raised, random, self._cancelled)
                self._keep_raised(ascent, hopped)
        for vector in self._raised[:RAISED_STARTS]:
            yield goal.evaluate(vector)

    def _keep_raised(self, ascent: SoftAscent, vectors: Array) -> None:
        """Keeps the best of the raised vectors so far and some others (P, D) that keep all rules,
        the best first."""
        keeps_rules = self._rules.violation(vectors) <= 0.0
        candidates = np.concatenate([self._raised, vectors[keeps_rules]])
        order = np.argsort(-ascent.least_distances(candidates), kind="stable")
        self._raised = candidates[order[:MAX_RAISED]]

    def _valid(
        self, vectors: Array, mirrored: bool, count: int, random: np.random.Generator
    ) -> Array:
        """Vectors that keep all rules (at most `count`, D): some random ones (P, D) first, mirrored
        like the robot where they are to be, then others that are drawn."""
        moves = self._moves
        valid = np.zeros((0, len(moves.start)))
        for draw in range(MAX_DRAWS):
            if len(valid) >= count:
                break
            drawn = random.uniform(moves.lower, moves.upper, vectors.shape) if draw else vectors
            variant = moves.mirrored(drawn) if mirrored else drawn
            for share in (1.0, 0.5, 0.25):
                rows = moves.start + share * (variant - moves.start)
                keeps_rules = self._rules.violation(rows) <= 0.0
                valid = np.concatenate([valid, rows[keeps_rules]])
        return valid[:count]

    def _climbed(self, climb: Climb, steps: int) -> bool:
        """Takes steps of a climb; returns whether the search has to stop."""
        while climb.radius >= RADIUS_MIN and climb.steps < steps:
            climb.step()
            self._note(climb.point.value, climb.point.vector)
            self._steps += 1
            self.stopped = self._cancelled()
            if self.stopped or (self._steps % STEPS_PER_ROUND == 0 and self._after_round()):
                return True
        return False

    def evolve(self, measure: Goal, seed: int) -> None:
        """Searches by differential evolution, for goals and rules without slopes."""
        from scipy.optimize import Bounds as Box
        from scipy.optimize import differential_evolution

        moves = self._moves
        cost_min = np.inf

        def chunk_cost(vectors: Array) -> tuple[Array, float]:
            """Costs (P,), and the best measure of a variant that keeps all rules."""
            value = measure(moves.sets(vectors), lambda row: moves.moved(vectors[row]))
            violation = self._rules.violation(moves.on_grid(vectors))
            best = value[violation <= 0.0].max(initial=-np.inf)
            return np.asarray(-value + PENALTY * violation), float(best)

        def cost(vectors: Array) -> Array:
            nonlocal cost_min
            rows = vectors.reshape(len(moves.start), -1).T
            costs = list[Array]()
            chunks = [rows[k : k + CHUNK_VARIANTS] for k in range(0, len(rows), CHUNK_VARIANTS)]
            valued = iter(self._mapped(chunk_cost, chunks))
            for chunk in chunks:
                if self._cancelled():
                    return np.full(len(rows), np.inf)
                chunk_costs, chunk_best = next(valued)
                costs.append(chunk_costs)
                self.best = max(self.best, chunk_best)
                if chunk_costs.min() < cost_min:
                    cost_min = chunk_costs.min()
                    self.vector = chunk[np.argmin(chunk_costs)]
            return np.concatenate(costs)

        self._done = 0
        differential_evolution(
            cost,  # type: ignore[arg-type]  # of all vectors at once, since it is vectorized
            Box(moves.lower, moves.upper),
            x0=moves.start,
            popsize=max(4, -(-24 // len(moves.start))),
            maxiter=self._rounds,
            tol=1e-4,
            seed=seed,
            polish=False,
            vectorized=True,
            updating="deferred",
            callback=self._after_round,  # type: ignore[arg-type]  # True stops it
        )
        # Rows that were not measured any more count as bad: the best is the one kept above.
