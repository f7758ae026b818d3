"""Improve a layout: move chosen actuators within bounds until a goal is as good as it gets."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import Bounds as Box
from scipy.optimize import differential_evolution

from finlab.allocation.question import check_flow
from finlab.analysis.authority import MotionAxis, commanded_axes, named_axes
from finlab.analysis.climb import LEAST, PENALTY, Climb, Rule, Rules
from finlab.analysis.goals import MISSION, Goal, axes_to_raise, make_goal
from finlab.analysis.moves import Bounds, Moves, mirror_pairs
from finlab.analysis.score_card import ScoreCard, score_card
from finlab.analysis.slopes import Directions, Hill, Look, Power
from finlab.arrays import Array
from finlab.forces.force_sets import force_sets
from finlab.layout import Layout

Mapped = Callable[[Callable[[Any], Any], Sequence[Any]], Iterable[Any]]
"""A function and the parts of a piece of work -> its results, in their order."""
CHUNK = 16  # variants that are looked at together: places of 64 actuators take much room
STEPS = 10  # steps of a climb in a round
# random vectors, of which at most so many times the starts are ranked
DRAWS = 64
RANK = 6
# climbs, times the square of the free numbers; at least and at most
STARTS = 2800
FEWEST = 3
MOST = 20
# of each climb, and of those that go on
FIRST_STEPS = 12
MOST_STEPS = 60
LITTLE = 1e-4  # share of the goal that a climb has to gain to count
FINALISTS = 3  # of so many climbs the best one goes on


@dataclass(frozen=True)
class Progress:
    """Where a search stands."""

    round: int
    n_rounds: int
    before: float  # the goal's measure at the start, more is better
    best: float  # the best so far, to about a percent
    layout: Layout
    """What has it."""


@dataclass(frozen=True)
class Improvement:
    """What a search found."""

    layout: Layout
    improved: bool
    cancelled: bool
    goal: str
    value_before: float  # the goal's measure at the start: more is better; energies are negative
    value_after: float  # the same for `layout`
    moved: tuple[str, ...]
    axes: tuple[str, ...]
    """Those whose directions count for the goals of directions; on the others, anything may
    come."""
    card_before: ScoreCard
    card_after: ScoreCard


def optimize_layout(
    layout: Layout,
    names: Sequence[str],
    bounds: Mapping[str, Bounds] | None = None,
    goal: str = "weakest_direction",
    mirror: Sequence[tuple[str, str]] | None = None,
    *,
    mission: ArrayLike = MISSION,
    rounds: int = 40,
    seed: int = 0,
    rule: Rule | None = None,
    grid: tuple[float, float] = (0.0, 0.0),
    axes: Sequence[MotionAxis] | None = None,
    flow: ArrayLike | None = None,
    progress: Callable[[Progress], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
    mapped: Mapped = map,
) -> Improvement:
    """Moves actuators to raise a goal: by its slopes from several starts, and, where these find
    nothing better or the flow changes what actuators push, by SciPy's differential evolution.

    The same arguments and seed give the same layout. The present layout is among the first
    candidates, so the result is never worse, unless the present one breaks the rule: then the best
    that keeps it is the result. Raises LayoutError: something about the actuators, bounds, pairs,
    goal or axes does not fit; it says what; CommandError: `flow` is not six finite numbers, or
    `mission` not such wrenches.

    Args:
        layout: where to start; its limits and models stay.
        names: names of those that move.
        bounds: where each may go; 5 cm and a quarter turn around where it is when left out.
        goal: `weakest_direction`, `mission_power` or `worst_single_failure`, see `make_goal`.
        mirror: pairs that stay each other's mirror image; when None, all that are so now.
        mission: wrenches (N, 6) [N, N m] for the goal `mission_power`.
        rounds: most rounds of the search.
        seed: of its random numbers.
        rule: another one that they have to keep, such as to stand outside of a hull.
        grid: steps [m], [rad] of the coordinates and angles that are tried; 0 for any number.
        axes: axes whose directions count for the two goals of directions, with anything on the
            others; all that the layout commands when None, or, with too few actuators for them,
            those that are pushed alone now, of which no move of a single coordinate costs one.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at
        rest.
        progress: called after each round.
        cancelled: asked after each round, and within long ones; the search stops when it answers
        True.
        mapped: gives a function's results for parts of the work, in order, as `map` does in this
            process; `finlab.research.executor.map_parts` does on a cluster.
    """
    bounds = bounds or {}
    water = check_flow(flow)
    start = layout
    if axes is not None:
        layout = replace(layout, axes=named_axes(axes))
    known = {
        name: bounds.get(name) or Bounds.around(layout.actuators[layout.index(name)])
        for name in names
    }
    pairs = mirror_pairs(layout) if mirror is None else mirror
    moves = Moves(layout, names, known, pairs, grid, water)
    if axes is None and goal != "mission_power":
        axes = axes_to_raise(layout, water)
        if len(axes) < len(layout.axes):
            moves.keep_alone(axes)
    measure, quick = (
        make_goal(goal, layout, mission, fine=fine, axes=axes, flow=water) for fine in (True, False)
    )

    def measured(robot: Layout) -> float:
        return float(measure(force_sets(robot, flow=water), lambda _: robot)[0])

    before = measured(layout)
    search = _Search(moves, Rules(moves.smooth, rule), before, rounds, progress, cancelled, mapped)
    if not moves.bends:
        search.climb(
            Power(moves.smooth, mission, water)
            if goal == "mission_power"
            else Directions(
                moves.smooth, axes or commanded_axes(layout), goal == "worst_single_failure"
            ),
            seed,
        )
    if not search.gained and not search.stopped:
        search.evolve(quick, seed)
    best = moves.moved(search.vector)
    after = measured(best)
    best = replace(best, axes=start.axes)
    wrong = [
        0.0 if rule is None else rule(p.position[None], p.frames[None])[0] for p in (layout, best)
    ]
    improved = bool(wrong[1] <= 0.0 and (wrong[0] > 0.0 or after > before + 1e-9 * abs(before)))
    card = score_card(start, flow=water)
    return Improvement(
        layout=best if improved else start,
        improved=improved,
        cancelled=search.stopped,
        goal=goal,
        value_before=before,
        value_after=after if improved else before,
        moved=moves.names,
        axes=tuple(axes or commanded_axes(layout)),
        card_before=card,
        card_after=score_card(best, flow=water) if improved else card,
    )


class _Search:
    """One search: what is the best so far, and how long it has taken."""

    def __init__(
        self,
        moves: Moves,
        rules: Rules,
        before: float,
        rounds: int,
        progress: Callable[[Progress], None] | None,
        cancelled: Callable[[], bool] | None,
        mapped: Mapped,
    ) -> None:
        self._moves = moves
        self._rules = rules
        self._before = before
        self._rounds = rounds
        self._progress = progress
        self._cancelled = cancelled or (lambda: False)
        self._mapped = mapped
        self.vector = moves.start
        self.best = before
        self.gained = False
        self.stopped = False
        self._kept = rules.broken(moves.start[None])[0] <= 0.0
        if not self._kept:
            self.best = -np.inf
        self._done = self._steps = 0

    def _note(self, value: float, vector: Array) -> None:
        """A vector that keeps all rules."""
        if value > self.best:
            self.best = value
            self.vector = vector
        if not self._kept or value > self._before + LITTLE * abs(self._before):
            self.gained = True

    def _after_round(self, *_: object) -> bool:
        """Says whether to stop."""
        self._done += 1
        if self._progress is not None:
            best = max(self.best, self._before)
            robot = self._moves.moved(self.vector)
            self._progress(Progress(self._done, self._rounds, self._before, best, robot))
        self.stopped = self._cancelled()
        return self.stopped or self._done >= self._rounds

    def climb(self, hill: Hill, seed: int) -> None:
        """Climb a little from several starts, then on from the best of them; round what was
        found."""
        best = self.best
        self.stopped = self._cancelled()
        climbs = list[Climb]()
        for start in self._starts(hill, seed) if not self.stopped else ():
            climbs.append(Climb(hill, self._rules, start))
            if self._climbed(climbs[-1], FIRST_STEPS):
                break
        else:
            climbs.sort(key=lambda one: -one.at.value)
            for climb in climbs[: max(1, len(climbs) // FINALISTS)]:
                self._climbed(climb, MOST_STEPS)
        if self._moves.step.any() and self.gained:
            self.best = best
            self.vector = self._moves.start
            self.gained = False
            for climb in sorted(climbs, key=lambda one: -one.at.value)[:3]:
                self._note(*climb.rounded(self._moves))

    def _starts(self, hill: Hill, seed: int) -> Iterator[Look]:
        """The present vector and the best of some random ones, as they are and as symmetric as the
        robot is now, of those that keep all rules."""
        moves = self._moves
        random = np.random.default_rng(seed)
        if self._kept:
            yield hill.look(moves.start)
        drawn = random.uniform(moves.lower, moves.upper, (DRAWS, len(moves.start)))
        mirrored = moves.mirrored(drawn)
        ways = [drawn] if np.array_equal(drawn, mirrored) else [drawn, mirrored]
        count = int(np.clip(round(STARTS / len(moves.start) ** 2), FEWEST, MOST)) - 1
        most = -(-count // len(ways))
        for way in ways:
            nearer = [moves.start + share * (way - moves.start) for share in (1.0, 0.5, 0.25)]
            kept = np.concatenate([some[self._rules.broken(some) <= 0.0] for some in nearer])[
                : RANK * most
            ]
            for k in np.argsort(-hill.guess(kept), kind="stable")[:most]:
                yield hill.look(kept[k])

    def _climbed(self, climb: Climb, steps: int) -> bool:
        """Whether the search has to stop."""
        while climb.radius >= LEAST and climb.steps < steps:
            climb.step()
            self._note(climb.at.value, climb.at.vector)
            self._steps += 1
            self.stopped = self._cancelled()
            if self.stopped or (self._steps % STEPS == 0 and self._after_round()):
                return True
        return False

    def evolve(self, measure: Goal, seed: int) -> None:
        """Differential evolution, for goals and rules without slopes."""
        moves = self._moves
        least = np.inf

        def chunk_cost(vectors: Array) -> tuple[Array, float]:
            """Costs (P,), and the best measure of a variant that keeps all rules."""
            value = measure(moves.sets(vectors), lambda row: moves.moved(vectors[row]))
            close = self._rules.broken(moves.on_grid(vectors))
            return np.asarray(-value + PENALTY * close), float(
                value[close <= 0.0].max(initial=-np.inf)
            )

        def cost(vectors: Array) -> Array:
            nonlocal least
            rows = vectors.reshape(len(moves.start), -1).T
            costs = list[Array]()
            chunks = [rows[k : k + CHUNK] for k in range(0, len(rows), CHUNK)]
            valued = iter(self._mapped(chunk_cost, chunks))
            for chunk in chunks:
                if self._cancelled():
                    return np.full(len(rows), np.inf)
                some, fine = next(valued)
                costs.append(some)
                self.best = max(self.best, fine)
                if some.min() < least:
                    least = some.min()
                    self.vector = chunk[np.argmin(some)]
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
        # Rows that were not looked at any more count as bad: the best is the one kept above.
