"""Improves a layout: moves chosen actuators within bounds to raise a goal.

`layout_search` finds the best vector of moves; here it is measured, compared with the layout at the
start, and, where that is asked for, with what no layout exceeds.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation.question import check_flow
from finlab.analysis.authority import commanded_axes, named_axes
from finlab.analysis.climb import Rule, Rules
from finlab.analysis.goals import MISSION, axes_to_raise, make_goal
from finlab.analysis.keep_out import KeepOut, keep_out_rule
from finlab.analysis.layout_bound import LayoutBound, check_bounded, layout_bound
from finlab.analysis.layout_search import LayoutSearch, MapParts, Progress
from finlab.analysis.moves import Bounds, Moves, mirror_pairs
from finlab.analysis.score_card import ScoreCard, score_card
from finlab.analysis.slopes import MissionPower, SlopedGoal, WeakestDirection
from finlab.arrays import Array
from finlab.axes import MotionAxis
from finlab.forces.force_sets import force_sets
from finlab.layout import Layout


@dataclass(frozen=True)
class Improvement:
    """The result of a search."""

    layout: Layout
    """The best layout; the one at the start where none is better."""
    improved: bool
    """Whether it is better than the one at the start."""
    cancelled: bool
    """Whether the search was stopped."""
    goal: str
    """Name of the goal."""
    value_before: float
    """The goal at the start: more is better; powers are negative."""
    value_after: float
    """The goal of `layout`."""
    moved: tuple[str, ...]
    """Actuators that could move."""
    axes: tuple[str, ...]
    """Axes whose directions count for the goals of directions; the others are free."""
    card_before: ScoreCard
    """Score card at the start."""
    card_after: ScoreCard
    """Score card of `layout`."""
    bound: LayoutBound | None = None
    """What the goal of no layout within the bounds exceeds, where it was asked for."""

    @property
    def gap(self) -> float | None:
        """Share by which the bound exceeds the goal [1]; None without a bound, or where the goal is
        0."""
        if self.bound is None or self.value_after <= 0.0:
            return None
        return self.bound.value / self.value_after - 1.0

    @property
    def below(self) -> float | None:
        """Share by which the goal is below the best possible at most [1], as `gap`."""
        gap = self.gap
        return None if gap is None else max(gap, 0.0) / (1.0 + max(gap, 0.0))

    def to_dict(self) -> dict[str, Any]:
        """Returns it as values for JSON: lengths in m, forces in N, powers in W; the powers of a
        mission are negative."""
        places = {
            name: {
                "position_m": list(self.layout.actuator(name).position),
                "axis": list(self.layout.actuator(name).frame[0]),
            }
            for name in self.moved
        }
        return {
            "layout": self.layout.name,
            "goal": self.goal,
            "improved": self.improved,
            "cancelled": self.cancelled,
            "value_before": self.value_before,
            "value_after": self.value_after,
            "axes": list(self.axes),
            "moved": places,
            "bound": None if self.bound is None else self.bound.to_dict(),
            "gap": self.gap,
        }


def optimize_layout(
    layout: Layout,
    names: Sequence[str],
    bounds: Mapping[str, Bounds] | None = None,
    goal: str = "weakest_direction",
    mirror: Sequence[tuple[str, str]] | None = None,
    *,
    mission: ArrayLike = MISSION,
    rounds: int = 40,
    searches: int = 1,
    seed: int = 0,
    rule: Rule | None = None,
    keep_outs: Sequence[KeepOut] = (),
    grid: tuple[float, float] = (0.0, 0.0),
    axes: Sequence[MotionAxis] | None = None,
    flow: ArrayLike | None = None,
    bound: bool = False,
    progress: Callable[[Progress], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
    mapped: MapParts = map,
) -> Improvement:
    """Moves actuators to raise a goal: by its slopes from several starts, and, where these find
    nothing better or the flow changes what actuators push, by SciPy's differential evolution.

    The same arguments and seed give the same layout. The present layout is among the first
    candidates, so the result is never worse, unless the present one breaks the rule: then the best
    that keeps it is the result.

    Args:
        layout: where to start; its limits and models stay.
        names: names of those that move.
        bounds: where each may go; 5 cm and a quarter turn around where it is when left out.
        goal: `weakest_direction`, `mission_power` or `worst_single_failure`, see `make_goal`.
        mirror: pairs that stay each other's mirror image; when None, all that are so now.
        mission: wrenches (N, 6) [N, N m] for the goal `mission_power`.
        rounds: most rounds of each search.
        searches: how many times starts are drawn and climbs made from them; later ones of many free
            thrusters also go on from the best before. The best result counts.
        seed: of the random numbers.
        rule: another one that they have to keep, such as to stand outside of a hull.
        keep_outs: boxes in which none of those that move may stand.
        grid: steps [m], [rad] of the coordinates and angles that are tried; 0 for any number.
        axes: axes whose directions count for the two goals of directions, with anything on the
            others; all that the layout commands when None, or, with too few actuators for them,
            those that are pushed alone now, of which no move of a single coordinate costs one.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at
            rest.
        bound: whether to say what no layout within the bounds exceeds, see `layout_bound`.
        progress: called after each round.
        cancelled: called after each round, and within long ones; the search stops when it returns
            True.
        mapped: applies a function to parts of the work, as `map` does in this process;
            `finlab.research.executor.map_parts` does on a cluster.

    Raises:
        LayoutError: an actuator, bounds, pairs, the goal or axes do not fit, or there is no bound
            of this goal, or not of these actuators.
        CommandError: `flow` is not six finite numbers, or `mission` not such wrenches.
    """
    bounds = bounds or {}
    water = check_flow(flow)
    if bound:
        check_bounded(layout, goal, water)
    start = layout
    if axes is not None:
        layout = replace(layout, axes=named_axes(axes))
    bounds_of = {
        name: bounds.get(name) or Bounds.around(layout.actuators[layout.index(name)])
        for name in names
    }
    pairs = mirror_pairs(layout) if mirror is None else mirror
    moves = Moves(layout, names, bounds_of, pairs, grid, water)
    if keep_outs:
        rule = _both(keep_out_rule(keep_outs, layout.indices(moves.names)), rule)
    if axes is None and goal != "mission_power":
        axes = axes_to_raise(layout, water)
        if len(axes) < len(layout.axes):
            moves.keep_alone(axes)
    measure = make_goal(goal, layout, mission, fine=True, axes=axes, flow=water)
    quick = make_goal(goal, layout, mission, fine=False, axes=axes, flow=water)

    def measured(robot: Layout) -> float:
        return float(measure(force_sets(robot, flow=water), lambda _: robot)[0])

    before = measured(layout)
    n_rounds = rounds * searches
    rules = Rules(moves.smooth, rule)
    search = LayoutSearch(moves, rules, before, n_rounds, progress, cancelled, mapped)
    if not moves.changes_forces:
        counted = axes or commanded_axes(layout)
        sloped_goal = _sloped_goal(goal, moves.smooth, counted, mission, water)
        search.climb_often(sloped_goal, seed, searches)
    if not search.gained and not search.stopped:
        search.evolve(quick, seed)
    best = moves.moved(search.vector)
    after = measured(best)
    best = replace(best, axes=start.axes)

    def violation(robot: Layout) -> float:
        return 0.0 if rule is None else float(rule(robot.position[None], robot.frames[None])[0])

    is_better = after > before + 1e-9 * abs(before)
    improved = violation(best) <= 0.0 and (violation(layout) > 0.0 or is_better)
    card = score_card(start, flow=water)
    counted_axes = tuple(axes or commanded_axes(layout))
    limit = None
    if bound:
        limit = layout_bound(
            layout,
            names,
            bounds_of,
            mirror=pairs,
            axes=named_axes(counted_axes),
            keep_outs=keep_outs,
            after_loss=goal == "worst_single_failure",
        )
    return Improvement(
        layout=best if improved else start,
        improved=improved,
        cancelled=search.stopped,
        goal=goal,
        value_before=before,
        value_after=after if improved else before,
        moved=moves.names,
        axes=counted_axes,
        card_before=card,
        card_after=score_card(best, flow=water) if improved else card,
        bound=limit,
    )


def _both(first: Rule, second: Rule | None) -> Rule:
    """Two rules as one, where there are two."""
    if second is None:
        return first

    def violation(position: Array, frames: Array) -> Array:
        return np.asarray(first(position, frames) + second(position, frames))

    return violation


def _sloped_goal(
    goal: str, moves: Moves, axes: Sequence[MotionAxis], mission: ArrayLike, flow: Array | None
) -> SlopedGoal:
    """The goal of a name with its slopes; arguments as those of `optimize_layout`."""
    if goal == "mission_power":
        return MissionPower(moves, mission, flow)
    return WeakestDirection(moves, axes, after_loss=goal == "worst_single_failure")
