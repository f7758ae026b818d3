"""From tick to tick: fins turn slowly, so each may turn only so far from its previous direction.

The zero direction of a real fin follows its command with a pole of about 3.5 rad/s. Given the previous
command, each fin's arc of zero directions is narrowed around where it points; only if the target is out
of reach so is the arc widened. `receding_horizon` keeps that rare.
"""

from dataclasses import replace

import numpy as np

from finlab.allocation.search.prepared import Prepared
from finlab.arrays import Array
from finlab.layout.angles import wrapped

TURNS = (0.5, 0.58, 1.2, np.pi)
"""Largest turns per tick [rad], tried in order. At ten ticks a second, a pole of 3.5 rad/s follows the first
within a few ticks; only a target that leaves no other way gets the larger ones."""


def limit_turn(prepared: Prepared, previous: Array, aim: Array, width: float) -> Prepared:
    """The layout with each fin's arc narrowed to `width` [rad] on both sides of its previous direction.

    Args:
        prepared: the layout.
        previous: command (n, 3) of the previous tick; a fin with NaN is left free.
        aim: zero directions (n,) [rad] to which fins at rest turn, step by step, so that they are ready
            when they are needed.
        width: half of the new arc; from pi on nothing is narrowed.
    """
    direction = previous[:, 2]
    known = np.isfinite(direction)
    if width >= np.pi or not known.any():
        return prepared
    lower, upper = prepared.commands.lower.copy(), prepared.commands.upper.copy()
    direction = np.where(known, direction, 0.0)
    # A fin that turns fully may pass the seam at +-pi: its arc is kept in one piece and wrapped at the end.
    free = prepared.commands.full_turn
    inside = np.clip(direction, lower[:, 2], upper[:, 2])
    low = np.where(free, direction - width, np.maximum(inside - width, lower[:, 2]))
    high = np.where(free, direction + width, np.minimum(inside + width, upper[:, 2]))
    lower[:, 2] = np.where(known, low, lower[:, 2])
    upper[:, 2] = np.where(known, high, upper[:, 2])
    full_turn = free & ~known
    ahead = np.where(free, direction + wrapped(aim - direction), aim)
    fins = prepared.planar.fins
    middle, half = 0.5 * (lower[:, 2] + upper[:, 2]), 0.5 * (upper[:, 2] - lower[:, 2])
    planar = prepared.planar._replace(
        fins=fins.within(middle + fins.lean(middle), np.where(full_turn, np.pi, half)),
        idle_direction=np.clip(ahead, lower[:, 2], upper[:, 2]),
    )
    commands = replace(prepared.commands, lower=lower, upper=upper, full_turn=full_turn)
    # Within narrow arcs, cheaper commands of many fins for effort are those that the next tick has to leave.
    unsettled = prepared.unsettled and planar.convex
    return prepared._replace(planar=planar, commands=commands, arcs=None, unsettled=unsettled)


def unwrap_to_arc(near: Prepared, command: Array) -> Array:
    """Commands (..., n, 3), each zero direction a turn more or less so that it is nearest to its arc."""
    turned = command.copy()
    middle = 0.5 * (near.commands.lower[:, 2] + near.commands.upper[:, 2])
    turned[..., 2] = middle + wrapped(command[..., 2] - middle)
    return turned


def planar_force(prepared: Prepared, command: Array) -> Array:
    """Planar forces (2, n) [N] of a command (n, 3), horizontal and vertical; NaN commands count as rest."""
    problem = prepared.commands
    safe = np.where(np.isfinite(command), command, problem.lower)
    return np.asarray(prepared.plant.force(problem.feasible(safe))[:, 1:].T)
