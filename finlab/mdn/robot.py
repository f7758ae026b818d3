"""What method `mdn` needs to know of a robot, computed once and kept."""

from typing import NamedTuple

import numpy as np

from finlab.allocation.levenberg_marquardt import CommandProblem
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.mdn.descent import EffortProblem, effort_problem
from finlab.mdn.effort_fins import EffortFins
from finlab.mdn.features import RobotView, robot_view
from finlab.physics.effort import EffortMeter, EffortWeights, effort_scale
from finlab.physics.plant import Plant

EXACT = 1e-5
"""Normalized error up to which an answer is exact and effort decides: a thousandth of what counts as
delivered."""


class EffortRobot(NamedTuple):
    """A robot of n healthy fins, ready for proposals, descent and refinement."""

    plant: Plant
    """The fins' own laws."""
    forces: EffortProblem
    """For the descent in planar forces."""
    commands: CommandProblem
    """For the refinement of commands."""
    effort: EffortMeter
    """What is kept least."""
    view: RobotView
    """What the network sees."""
    exact: float = EXACT
    """Normalized error up to which an answer is exact."""

    def at(self, plant: Plant, scale: Array) -> "EffortRobot":
        """The same robot in a flow, as a plant at that flow says; refinement knows of it."""
        return self._replace(plant=plant, commands=CommandProblem.of(plant, scale))


def effort_robot(plant: Plant, scale: Array, weights: EffortWeights) -> EffortRobot:
    """Prepare a robot of fins; `scale` (6,) is what wrenches are divided by.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    layout = plant.layout
    forces = layout_problem(
        plant.effectiveness[:, 1:] / scale, EffortFins.of_layout(layout, weights), layout, weights
    )
    effort, commands = EffortMeter(plant.upper, weights), CommandProblem.of(plant, scale)
    return EffortRobot(plant, forces, commands, effort, robot_view(forces))


def layout_problem(
    effectiveness: Array, fins: EffortFins, layout: Layout, weights: EffortWeights
) -> EffortProblem:
    """The problem in planar forces of compiled fins with the limits of a layout; normalized wrenches
    (n, 2, 6) per newton of their planar forces."""
    turning = weights.zero_direction / effort_scale(layout.upper)[:, 2] ** 2
    idle = np.clip(0.0, layout.lower[:, 2], layout.upper[:, 2])
    return effort_problem(effectiveness, fins, turning, idle)
