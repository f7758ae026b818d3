"""The slopes of the goals that a search follows agree with differences of the goals."""

from collections.abc import Callable

import numpy as np
import pytest

from finlab.analysis import AXES, Bounds
from finlab.analysis.moves import Moves
from finlab.analysis.slopes import MissionPower, SlopedGoal, WeakestDirection
from finlab.layout import Layout

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""


def slopes_are_differences(goal: SlopedGoal, moves: Moves, rel: float) -> None:
    """Along a random change, slopes agree with differences of the goal."""
    random = np.random.default_rng(3)
    width = moves.upper - moves.lower
    vector = random.uniform(moves.lower, moves.upper)
    direction = random.standard_normal(len(width))
    direction *= width / np.linalg.norm(direction)
    point = goal.evaluate(vector)
    for _ in range(8):
        point = goal.evaluate(vector, point)
    values, slopes = goal.slopes(point)
    values_beside = [
        goal.evaluate(vector + sign * 1e-4 * direction, point).value for sign in (1.0, -1.0)
    ]
    slope = float(slopes[values.argmin()] @ (direction / width))
    assert slope == pytest.approx(
        (values_beside[0] - values_beside[1]) / 2e-4, rel=rel, abs=1e-3 * abs(point.value)
    )


@pytest.mark.parametrize(
    "name", ["bluerov2_heavy", "A", "turtle_hybrid", "catamaran", "fish", "hexa"]
)
def test_slopes_are_those_of_the_goals(shipped: Layouts, name: str) -> None:
    layout = shipped(name)
    moves = Moves(
        layout,
        layout.names,
        {actuator.name: Bounds.around(actuator) for actuator in layout.actuators},
    )
    axes = [axis for axis, counts in zip(AXES, layout.commanded, strict=True) if counts]
    near = [[0.05, 0.0, 0.0, 0.0, 0.0, 0.0]]
    far = [[900.0, 0.0, 0.0, 0.0, 0.0, 1.0]]
    slopes_are_differences(WeakestDirection(moves, axes, False), moves, 0.02)
    slopes_are_differences(MissionPower(moves, near, None), moves, 0.02)
    slopes_are_differences(
        MissionPower(moves, far, None), moves, 0.1
    )  # the nearest point by other weights
