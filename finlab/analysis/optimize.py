"""Improve a layout: move chosen actuators within bounds until a goal is as good as it gets."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import Bounds as Box
from scipy.optimize import differential_evolution

from finlab.allocation.question import check_flow
from finlab.analysis.authority import commanded_axes, named_axes
from finlab.analysis.goals import MISSION, Goal, axes_to_raise, make_goal
from finlab.analysis.moves import Bounds, Moves, mirror_pairs
from finlab.analysis.score_card import ScoreCard, score_card
from finlab.arrays import Array
from finlab.executor import map_parts
from finlab.forces.force_sets import force_sets
from finlab.layout import Layout

CLEARANCE = 0.10  # least distance between two actuators [m]; those that are closer already need not part
CHUNK = 16  # variants that are looked at together: places of 64 actuators take much room
PENALTY = 1e3  # cost of actuators that are too close or break another rule, per metre; far beyond any goal

Rule = Callable[[Array, Array], Array]
"""How far actuators at positions (P, n, 3) [m] with own axes (P, n, 3, 3) break a rule (P,) [m]; 0 where they
keep it."""


@dataclass(frozen=True)
class Progress:
    """Where a search stands."""

    round: int
    n_rounds: int
    before: float  # the goal's measure at the start, more is better
    best: float  # the best so far, to about a percent


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
    """Those whose directions count for the goals of directions; on the others, anything may come."""
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
    axes: Sequence[str] | None = None,
    flow: ArrayLike | None = None,
    progress: Callable[[Progress], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Improvement:
    """Moves actuators to raise a goal, by SciPy's differential evolution.

    The same arguments and seed give the same layout. The present layout is among the first candidates, so the
    result is never worse, unless the present one breaks the rule: then the best that keeps it is the result.
    Raises LayoutError: something about the actuators, bounds, pairs, goal or axes does not fit; it says what;
    CommandError: `flow` is not six finite numbers, or `mission` not such wrenches.

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
        axes: axes whose directions count for the two goals of directions, with anything on the others; all
            that the layout commands when None, or, with too few actuators for them, those that are pushed
            alone now, of which no move of a single coordinate costs one.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at rest.
        progress: called after each round.
        cancelled: asked after each round, and within long ones; the search stops when it answers True.
    """
    bounds, water, start = bounds or {}, check_flow(flow), layout
    if axes is not None:
        layout = replace(layout, axes=named_axes(axes))
    known = {name: bounds.get(name) or Bounds.around(layout.actuators[layout.index(name)]) for name in names}
    pairs = mirror_pairs(layout) if mirror is None else mirror
    moves = Moves(layout, names, known, pairs, grid, water)
    broken = rule or (lambda position, frames: np.zeros(len(position)))
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
    best_vector, stopped = _search(moves, quick, before, broken, rounds, seed, progress, cancelled)
    best = moves.moved(best_vector)
    after = measured(best)
    best = replace(best, axes=start.axes)
    wrong = [float(broken(robot.position[None], robot.frames[None])[0]) for robot in (layout, best)]
    better = after > before + 1e-9 * abs(before)
    improved = wrong[1] <= 0.0 and (better or wrong[0] > 0.0)
    card = score_card(start, flow=water)
    return Improvement(
        layout=best if improved else start,
        improved=improved,
        cancelled=stopped,
        goal=goal,
        value_before=before,
        value_after=after if improved else before,
        moved=moves.names,
        axes=tuple(axes or commanded_axes(layout)),
        card_before=card,
        card_after=score_card(best, flow=water) if improved else card,
    )


def _search(
    moves: Moves,
    measure: Goal,
    before: float,
    rule: Rule,
    rounds: int,
    seed: int,
    progress: Callable[[Progress], None] | None,
    cancelled: Callable[[], bool] | None,
) -> tuple[Array, bool]:
    """The best vector (D,), and whether the search was stopped."""
    needed = np.minimum(_gaps(moves.start_position[None])[0], CLEARANCE)
    best, least, best_vector, done, stopped = before, np.inf, moves.start, 0, False

    def chunk_cost(effectiveness: Array) -> tuple[Array, float]:
        """Costs (P,), and the best measure of a variant that keeps all rules."""
        value = measure(moves.sets(effectiveness), lambda row: moves.moved(effectiveness[row]))
        position, frames = moves.geometry(effectiveness)
        close = np.maximum(needed - _gaps(position), 0.0).sum(-1) + rule(position, frames)
        return np.asarray(-value + PENALTY * close), float(value[close <= 0.0].max(initial=-np.inf))

    def cost(vectors: Array) -> Array:
        nonlocal best, least, best_vector
        rows, costs = vectors.reshape(len(moves.start), -1).T, list[Array]()
        chunks = [rows[k : k + CHUNK] for k in range(0, len(rows), CHUNK)]
        valued = map_parts(chunk_cost, chunks)
        for chunk in chunks:
            if cancelled is not None and cancelled():
                return np.full(len(rows), np.inf)
            some, fine = next(valued)
            costs.append(some)
            best = max(best, fine)
            if some.min() < least:
                least, best_vector = some.min(), chunk[np.argmin(some)]
        return np.concatenate(costs)

    def after_round(vector: Array, convergence: float) -> bool:
        nonlocal done, stopped
        done += 1
        if progress is not None:
            progress(Progress(done, rounds, before, best))
        stopped = cancelled is not None and cancelled()
        return stopped

    differential_evolution(
        cost,  # type: ignore[arg-type]  # of all vectors at once, since it is vectorized
        Box(moves.lower, moves.upper),
        x0=moves.start,
        popsize=max(4, -(-24 // len(moves.start))),
        maxiter=rounds,
        tol=1e-4,
        seed=seed,
        polish=False,
        vectorized=True,
        updating="deferred",
        callback=after_round,  # type: ignore[arg-type]  # True stops it
    )
    return best_vector, stopped  # rows that were not looked at any more count as bad, so not scipy's own


def _gaps(position: Array) -> Array:
    """Distances (P, pairs) [m] between the actuators at positions (P, n, 3)."""
    first, second = np.triu_indices(position.shape[1], k=1)
    return np.asarray(np.linalg.norm(position[:, first] - position[:, second], axis=-1))
