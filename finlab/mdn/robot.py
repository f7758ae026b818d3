"""What method `mdn` needs to know of a robot, computed once and kept."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from finlab.allocation.dual.rates import Box
from finlab.allocation.levenberg_marquardt import CommandProblem
from finlab.arrays import Array
from finlab.mdn.descent import EffortProblem, effort_problem
from finlab.mdn.effort_fins import EffortFins
from finlab.mdn.features import RobotView, robot_view
from finlab.physics.objective import ZERO_DIRECTION, EffortMeter, effort_scale
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

    def within(self, box: Box) -> "EffortRobot":
        """The same robot, each fin kept within what may follow a previous command."""
        fins, free, (lower, upper) = self.forces.fins, box.free[:, 2], (box.lower[:, 2], box.upper[:, 2])
        middle, half = 0.5 * (lower + upper), np.where(free, np.pi, 0.5 * (upper - lower))
        arcs = replace(fins, middle=middle + fins.deflection(middle), half=half)
        forces = self.forces._replace(fins=arcs)
        commands = replace(self.commands, lower=box.lower, upper=box.upper, full_turn=free)
        return self._replace(forces=forces, commands=commands)


def effort_robot(plant: Plant, scale: Array) -> EffortRobot:
    """Prepare a robot of fins; `scale` (6,) is what wrenches are divided by.

    Raises:
        DataError: a fin's force table cannot be read.
    """
    layout = plant.layout
    turning = ZERO_DIRECTION / effort_scale(layout.upper)[:, 2] ** 2
    idle = np.clip(0.0, layout.lower[:, 2], layout.upper[:, 2])
    fins = EffortFins.of(layout)
    forces = effort_problem(plant.effectiveness[:, 1:] / scale, fins, turning, idle)
    effort, commands = EffortMeter(plant.upper), CommandProblem.of(plant, scale)
    return EffortRobot(plant, forces, commands, effort, robot_view(forces))
