"""A climb takes steps that gain, shrinks its trust region where the model is wrong, and keeps its
rules."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from finlab.analysis import Bounds
from finlab.analysis.climb import (
    RADIUS_GROWTH,
    RADIUS_MIN,
    RADIUS_SHRINK,
    RADIUS_SHRINK_RULES,
    RADIUS_START,
    Climb,
    Rule,
    Rules,
)
from finlab.analysis.moves import Moves
from finlab.analysis.slopes import GoalPoint
from finlab.arrays import Array
from finlab.layout import Layout

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""


@dataclass
class Paraboloid:
    """A goal without force sets: minus the squared distance from a peak, in shares of the bounds;
    its slope may be wrong by a factor."""

    moves: Moves
    peak: Array
    slope_factor: float = 1.0

    def _distance(self, vector: Array) -> Array:
        return (vector - self.peak) / (self.moves.upper - self.moves.lower)

    def evaluate(self, vector: Array, previous: GoalPoint | None = None) -> GoalPoint:
        """Returns the goal at a vector."""
        return GoalPoint(vector, -float(np.sum(self._distance(vector) ** 2)), None)

    def slopes(self, point: GoalPoint) -> tuple[Array, Array]:
        """Returns the value and the slope of the one linear function."""
        slope = -2.0 * self.slope_factor * self._distance(point.vector)
        return np.array([point.value]), slope[None]


def fin_moves(shipped: Layouts) -> Moves:
    """One fin of a robot of four that moves along x and y."""
    layout = shipped("A")
    name = layout.names[0]
    bounds = Bounds.around(layout.actuators[0], (0.05, 0.05, 0.0), 0.0)
    return Moves(layout, [name], {name: bounds})


def climb_of(moves: Moves, peak: Array, rule: Rule | None = None, factor: float = 1.0) -> Climb:
    """A climb of a paraboloid from where the fin is."""
    goal = Paraboloid(moves, peak, factor)
    point = goal.evaluate(moves.start)
    return Climb(goal, Rules(moves, rule), point)  # type: ignore[arg-type]


def test_it_climbs_to_the_peak_and_never_down(shipped: Layouts) -> None:
    moves = fin_moves(shipped)
    peak = moves.start + 0.4 * (moves.upper - moves.start)
    climb = climb_of(moves, peak)
    while climb.radius >= RADIUS_MIN and climb.steps < 60:
        before = climb.point.value
        climb.step()
        assert climb.point.value >= before
    assert climb.point.vector == pytest.approx(peak, abs=1e-3 * 0.1)


def test_a_good_first_step_goes_to_the_edge_and_the_region_grows(shipped: Layouts) -> None:
    moves = fin_moves(shipped)
    climb = climb_of(moves, moves.upper)
    climb.step()
    taken = (climb.point.vector - moves.start) / (moves.upper - moves.lower)
    assert taken == pytest.approx(RADIUS_START)
    assert climb.radius == pytest.approx(RADIUS_GROWTH * RADIUS_START)


def test_a_step_that_loses_is_refused(shipped: Layouts) -> None:
    moves = fin_moves(shipped)
    climb = climb_of(moves, moves.upper, factor=-1.0)  # the slope points down
    climb.step()
    assert (climb.point.vector == moves.start).all()
    assert climb.radius == pytest.approx(RADIUS_SHRINK * RADIUS_START)


def test_where_no_part_of_a_step_keeps_the_rules_the_region_shrinks(shipped: Layouts) -> None:
    moves = fin_moves(shipped)

    def stay(position: Array, frames: Array) -> Array:
        return np.abs(position - moves.start_position).max(axis=(1, 2))

    climb = climb_of(moves, moves.upper, stay)
    climb.step()
    assert (climb.point.vector == moves.start).all()
    assert climb.radius == pytest.approx(RADIUS_SHRINK_RULES * RADIUS_START)
