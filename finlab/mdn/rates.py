"""From tick to tick: around the previous command each fin has a box of commands that it may be given next."""

from dataclasses import replace

import numpy as np

from finlab.arrays import AnyArray, Array
from finlab.layout.angles import wrapped
from finlab.mdn.robot import EffortRobot


def within_rates(robot: EffortRobot, previous: Array, period_s: float) -> EffortRobot:
    """The robot with each fin kept within what it may be commanded after its previous command.

    Args:
        robot: the robot.
        previous: command (n, 3) of the previous tick; a fin with NaN is left free.
        period_s: time between ticks [s].
    """
    known, problem = np.isfinite(previous[:, 2]), robot.commands
    least, most, turns = problem.lower, problem.upper, problem.full_turn
    step = robot.plant.layout.rates * period_s
    center = np.clip(np.where(known[:, None], previous, least), least, most)
    # A fin that turns fully may pass the seam at +-pi: its arc is kept in one piece and wrapped at the end.
    center[turns, 2] = np.where(known, previous[:, 2], 0.0)[turns]
    low, high = center - step, center + step
    stops = np.ones(low.shape, bool)
    stops[turns, 2] = False
    low = np.where(stops, np.maximum(low, least), low)
    high = np.where(stops, np.minimum(high, most), high)
    free = turns & (~known | (step[:, 2] >= np.pi))
    loose = np.repeat(~known[:, None], 3, axis=1)
    loose[:, 2] |= free
    lower, upper = np.where(loose, least, low), np.where(loose, most, high)
    middle, half = 0.5 * (lower[:, 2] + upper[:, 2]), 0.5 * (upper[:, 2] - lower[:, 2])
    fins = robot.forces.fins
    fins = fins.within(middle + fins.deflection(middle), np.where(free, np.pi, half))
    commands = replace(problem, lower=lower, upper=upper, full_turn=free)
    return robot._replace(forces=robot.forces._replace(fins=fins), commands=commands)


def is_within_rates(robot: EffortRobot, previous: Array, command: Array, period_s: float) -> bool:
    """Whether a command (n, 3) may follow a previous one (n, 3); what nothing is known of may follow."""
    change = np.abs(command - previous)
    change[:, 2] = np.where(robot.commands.full_turn, np.abs(wrapped(change[:, 2])), change[:, 2])
    return not (change > robot.plant.layout.rates * period_s).any()


def previous_force(robot: EffortRobot, command: Array) -> AnyArray:
    """Planar forces (n,) [N], complex, of a command (n, 3); NaN commands count as rest."""
    problem = robot.commands
    safe = np.where(np.isfinite(command), command, problem.lower)
    force = robot.plant.force(problem.feasible(safe))
    return np.asarray(force[:, 1] + 1j * force[:, 2])
