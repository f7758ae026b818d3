"""Goals of improving a layout, measured for many variants of one layout at once.

A search uses quick measures, which are within about a percent of the fine ones on the score card.
Actuators whose arc is wider than half a turn count with the convex hull of their force set. The
same goals with slopes are in `slopes`.
"""

from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation import Allocator
from finlab.analysis.authority import AXES, authority, commanded_axes, named_axes
from finlab.arrays import Array
from finlab.axes import AXES as WRENCH_AXES
from finlab.axes import MotionAxis
from finlab.errors import LayoutError
from finlab.forces.force_sets import ForceSets, shapes_of
from finlab.forces.reach import weakest
from finlab.layout import Layout
from finlab.physics.objective import REACHED

GoalName = Literal["weakest_direction", "mission_power", "worst_single_failure"]
GOALS: tuple[GoalName, ...] = get_args(GoalName)
"""Names of the goals."""
Goal = Callable[[ForceSets, Callable[[int], Layout]], Array]
"""Measures P variants: takes their force sets and a function that returns the layout of one by its
index; returns (P,), more is better."""

MISSION = (
    (2.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (1.2, 0.0, 0.0, 0.0, 0.0, 0.25),
    (1.2, 0.0, 0.0, 0.0, 0.0, -0.25),
    (0.8, 0.0, -1.5, 0.0, 0.0, 0.0),
)
"""Wrenches [N, N m] of a mission when none are given: cruise, turn left, turn right, dive."""
UNREACHED = 100.0
"""Cost of a wrench out of reach [W]: more than allocations take."""
QUICK_SEARCH: dict[str, Any] = {"n_random": 8, "fine": False}
"""Arguments of `weakest` for a quick measure."""


def make_goal(
    name: str,
    layout: Layout,
    mission: ArrayLike = MISSION,
    *,
    fine: bool = True,
    axes: Sequence[MotionAxis] | None = None,
    flow: Array | None = None,
) -> Goal:
    """Returns the measure of a goal for variants of a layout.

    Args:
        name: `weakest_direction`: the scaled wrench that is within reach in every direction [N].
            `worst_single_failure`: the same after the loss of the actuator that leaves least of it
            [N]. `mission_power`: minus the mean least power of the mission's wrenches [W].
        layout: its limits and models hold for all variants.
        mission: wrenches (N, 6) [N, N m].
        fine: as the score card has it; otherwise quick.
        axes: those of `AXES` whose directions count; on the others, anything may come. None for all
            that the layout commands.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.

    Raises:
        LayoutError: unknown goal or axis, or too few actuators for a loss.
    """
    search: dict[str, Any] = {} if fine else QUICK_SEARCH
    wrench_axes = layout.axes if axes is None else named_axes(axes)
    axis_indices = [WRENCH_AXES.index(axis) for axis in wrench_axes]

    def of_weakest(sets: ForceSets, _: object = None) -> Array:
        if len(axis_indices) < len(AXES):
            sets = sets.along(axis_indices)
        return weakest(sets, **search).size

    def after_worst_failure(sets: ForceSets, _: object = None) -> Array:
        robots, n = sets.radius.shape
        rows = sets.repeat(n)
        rows.lose(np.arange(robots * n), np.tile(np.arange(n), robots))
        return np.asarray(of_weakest(rows).reshape(robots, n).min(axis=1))

    def mission_power(sets: ForceSets, layout_of: Callable[[int], Layout]) -> Array:
        """Minus the mean power; a wrench out of reach costs by what is missing."""
        answers = []
        for row in range(len(sets.radius)):
            answers.append(Allocator(layout_of(row)).allocate_batch(mission, flow=flow))
        power = np.stack([answer.power for answer in answers])
        missing = np.stack([answer.err_norm for answer in answers])
        cost = np.where(missing <= REACHED, power, UNREACHED * (1.0 + missing))
        return np.asarray(-cost.mean(axis=1))

    if name == "weakest_direction":
        return of_weakest
    if name == "worst_single_failure":
        counts = [shape.axes for shape in shapes_of(layout, flow)]
        if sum(counts) - max(counts) < len(axis_indices):
            raise LayoutError(
                f"the goal {name} needs {len(axis_indices)} directions after a loss, and layout "
                f"{layout.name} has {layout.counts_in_words}, which push in {sum(counts)}; "
                "none can fail without losing an axis"
            )
        return after_worst_failure
    if name == "mission_power":
        return mission_power
    raise LayoutError(f"goal: expected one of {', '.join(GOALS)}, got {name!r:.60}")


def axes_to_raise(layout: Layout, flow: Array | None = None) -> tuple[MotionAxis, ...]:
    """Returns the axes that count when none are named.

    These are all that the layout commands, or, where it has too few actuators to push both ways
    along all of them wherever they go, those that it pushes alone now.

    Args:
        layout: the layout.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.

    Raises:
        LayoutError: there are none.
    """
    shapes = shapes_of(layout, flow)
    commanded = commanded_axes(layout)
    # What pushes one way only has to be one more than there are axes.
    one_way = any(shape.one_way for shape in shapes)
    if sum(shape.axes for shape in shapes) > len(commanded) - (not one_way):
        return commanded
    reachable = authority(layout, flow=flow).reachable
    if not reachable:
        raise LayoutError(
            f"layout {layout.name} pushes along no axis alone, so there is nothing to raise; name "
            "axes, or a flow where actuators need one"
        )
    return reachable
