"""What a layout may be improved towards, measured for many variants of one layout at once.

A search asks for quick measures, which are within about a percent of the fine ones on the score card. Fins
whose arc is wider than half a turn count with the convex hull of what they can push.
"""

from collections.abc import Callable
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from finlab.analysis.least_power import MovedFins
from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.forces.extent import weakest
from finlab.forces.fin_sets import SCALE, FinSets
from finlab.forces.reach import COARSE, FINE, max_wrench_along
from finlab.layout import Layout

GoalName = Literal["weakest_direction", "mission_power", "worst_single_failure"]
GOALS: tuple[GoalName, ...] = get_args(GoalName)
Goal = Callable[[FinSets], Array]
"""What variants (P) are worth (P,): more is better."""

MISSION = (
    (2.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (1.2, 0.0, 0.0, 0.0, 0.0, 0.25),
    (1.2, 0.0, 0.0, 0.0, 0.0, -0.25),
    (0.8, 0.0, -1.5, 0.0, 0.0, 0.0),
)
"""Wrenches [N, N m] of a mission when none are given: cruise, turn left, turn right, dive."""
UNREACHED = 100.0
"""What a wrench out of reach costs [W], more than allocations do."""
LEAST_FINS = 4
"""Fewest fins of which one may fail while six axes remain."""
QUICK_SEARCH: dict[str, Any] = {"n_random": 8, "n_walks": 4, "fine": False}
"""How to find a weakest direction when it has to be quick."""


def make_goal(name: str, layout: Layout, mission: ArrayLike = MISSION, *, fine: bool = True) -> Goal:
    """Returns the measure called `name` for variants of a layout.

    Args:
        name: `weakest_direction`: the scaled wrench that is within reach in every direction [N].
            `worst_single_failure`: the same after the loss of the fin that leaves least of it [N].
            `mission_power`: minus the mean least power of the mission's wrenches [W].
        layout: its limits and fin models hold for all variants.
        mission: wrenches (N, 6) [N, N m].
        fine: as the score card has it; otherwise quick.

    Raises:
        LayoutError: unknown goal, too few fins for a failure, or a mission that is not wrenches.
    """
    search: dict[str, Any] = {} if fine else QUICK_SEARCH

    def of_weakest(sets: FinSets) -> Array:
        return weakest(sets, **search).size

    if name == "weakest_direction":
        return of_weakest
    if name == "worst_single_failure":
        if layout.n_fins < LEAST_FINS:
            raise LayoutError(
                f"the goal {name} needs {LEAST_FINS} fins or more, layout {layout.name} has {layout.n_fins}; "
                "with fewer, none can fail without losing an axis"
            )
        return _after_worst_failure(of_weakest)
    if name == "mission_power":
        return _mission_power(layout, _wrenches(mission), fine)
    raise LayoutError(f"goal: expected one of {', '.join(GOALS)}, got {name!r:.60}")


def _after_worst_failure(of_rest: Goal) -> Goal:
    def goal(sets: FinSets) -> Array:
        robots, n = sets.radius.shape
        rows = sets.repeat(n)
        rows.radius[np.arange(robots * n), np.tile(np.arange(n), robots)] = 0.0
        least: Array = of_rest(rows).reshape(robots, n).min(axis=1)
        return least

    return goal


def _mission_power(layout: Layout, mission: Array, fine: bool) -> Goal:
    """Mean least power; a wrench out of reach costs by what is missing."""
    fins, tolerance = MovedFins(layout), FINE if fine else COARSE

    def goal(sets: FinSets) -> Array:
        cost = fins.least_power(sets, mission)
        robot, wrench = np.nonzero(np.isnan(cost))
        if len(robot):
            missing = _missing(sets.take(robot), mission[wrench] / SCALE, tolerance)
            cost[robot, wrench] = UNREACHED * (1.0 + missing)
        return np.asarray(-cost.mean(axis=1))

    return goal


def _missing(sets: FinSets, target: Array, tolerance: float) -> Array:
    """Share (R,) of scaled wrenches (R, 6) that is out of reach."""
    size = np.linalg.norm(target, axis=-1)
    asked = size > 0.0
    unit = np.where(asked[:, None], target / np.where(asked, size, 1.0)[:, None], np.eye(6)[0])
    given = (max_wrench_along(sets, unit, tolerance).wrench * unit).sum(-1)
    return np.where(asked, 1.0 - np.clip(given / np.where(asked, size, 1.0), 0.0, 1.0), 0.0)


def _wrenches(mission: ArrayLike) -> Array:
    try:
        values = np.atleast_2d(np.asarray(mission, dtype=np.float64))
    except (TypeError, ValueError):
        values = np.zeros((0, 0))
    if values.ndim != 2 or values.shape[1] != 6 or not len(values) or not np.isfinite(values).all():
        raise LayoutError("mission: expected wrenches of six finite numbers [N, N m], got something else")
    return values
