"""From tick to tick: commands change no faster than the fins' servos are meant to.

Around the previous command each fin has a box of commands that it may be given next: amplitude, frequency and
zero direction, by the rates of its servo. The cheapest exact answer within these boxes is searched for as
any other is; where none of them is exact, the answer is what comes nearest, and the next ticks go on from it.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.search.prepared import Prepared
from finlab.arrays import Array
from finlab.layout.angles import wrapped


def within_rates(prepared: Prepared, previous: Array, period_s: float, aim: Array | None = None) -> Prepared:
    """The layout with each fin kept within what it may be commanded after its previous command.

    Args:
        prepared: the layout.
        previous: command (n, 3) of the previous tick; a fin with NaN is left free.
        period_s: time between ticks [s].
        aim: zero directions (n,) [rad] to which fins at rest turn, step by step, so that they are ready when
            they are needed; by default a fin at rest turns to where it would be pulled.
    """
    known: NDArray[np.bool_] = np.isfinite(previous[:, 2])
    if not known.any():
        return prepared
    problem, fins = prepared.commands, prepared.planar.fins
    step = prepared.plant.layout.servo_rates * period_s
    # A fin that turns fully may pass the seam at +-pi: its arc is kept in one piece and wrapped at the end.
    free = problem.full_turn
    least, most = np.array(problem.lower), np.array(problem.upper)
    center = np.clip(np.where(known[:, None], previous, least), least, most)
    center[free, 2] = np.where(known, previous[:, 2], 0.0)[free]
    low, high = np.maximum(center - step, least), np.minimum(center + step, most)
    low[free, 2], high[free, 2] = (center - step)[free, 2], (center + step)[free, 2]
    turns = free & (step[:, 2] >= np.pi)
    loose = ~known[:, None]
    lower, upper = np.where(loose, least, low), np.where(loose, most, high)
    full_turn = free & (~known | turns)
    lower[full_turn, 2], upper[full_turn, 2] = least[full_turn, 2], most[full_turn, 2]
    if aim is None:
        ahead = np.full(len(known), np.nan)
    else:
        ahead = np.where(free, center[:, 2] + wrapped(aim - center[:, 2]), aim)
        ahead = np.clip(ahead, lower[:, 2], upper[:, 2])
    middle, half = 0.5 * (lower[:, 2] + upper[:, 2]), 0.5 * (upper[:, 2] - lower[:, 2])
    planar = prepared.planar._replace(
        fins=fins.within(middle + fins.deflection(middle), np.where(full_turn, np.pi, half)),
        idle_direction=ahead,
    )
    commands = replace(problem, lower=lower, upper=upper, full_turn=full_turn)
    # Within narrow arcs, cheaper commands of many fins for effort are those that the next tick has to leave.
    unsettled = prepared.unsettled and planar.convex
    return prepared._replace(planar=planar, commands=commands, arcs=None, unsettled=unsettled)


def is_within_rates(prepared: Prepared, previous: Array, command: Array, period_s: float) -> bool:
    """Whether a command (n, 3) may follow a previous one (n, 3); what nothing is known of may follow."""
    change = np.abs(command - previous)
    change[:, 2] = np.where(prepared.commands.full_turn, np.abs(wrapped(change[:, 2])), change[:, 2])
    return not (change > prepared.plant.layout.servo_rates * period_s).any()


def planar_force(prepared: Prepared, command: Array) -> Array:
    """Planar forces (2, n) [N] of a command (n, 3), horizontal and vertical; NaN commands count as rest."""
    problem = prepared.commands
    safe = np.where(np.isfinite(command), command, problem.lower)
    return np.asarray(prepared.plant.force(problem.feasible(safe))[:, 1:].T)
