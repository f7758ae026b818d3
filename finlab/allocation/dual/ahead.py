"""Where pods turn when the wrenches of the next ticks are known.

Beside the wrench of now, that of a later tick is answered, within what the drives allow until then,
and with what turning costs over that time. Its angles are those that the pods will want. Their
small part is left, as turning there and back with every wave gains little; half of the rest is
wanted now, the next tick wants half of what then remains.
"""

from typing import Any

import numpy as np

from finlab.allocation.policy import CLOSEST
from finlab.arrays import Array
from finlab.core.calls import Now

MOST_AHEAD = 8
"""Ticks to which pods look ahead."""
LEFT = 0.1
"""Share of the turn that the drives allow until then, up to which a pod stays where it is."""
AT_ONCE = 0.5
"""Share of the remaining turn that is wanted now."""
HELD_BY = 10.0
"""Times as much as usual does it cost to stand elsewhere than is wanted."""


def turning_ahead(method: Any, reference: Array, now: Now) -> Now:
    """Returns what holds now, with the angles near which pods are to stand.

    Args:
        method: of the robot.
        reference: wrenches (K, 6) of the next ticks [N, N m], at least one.
        now: what holds, with the commands before.

    Returns:
        The same with angles (n,) [rad], NaN of actuators that are no pods, are lost, or have no
        known command before, and with what it costs to stand elsewhere.
    """
    assert now.previous is not None
    last = min(len(reference), MOST_AHEAD)
    ticks = last + 1
    later = method.forces(reference[last - 1 : last], CLOSEST, None, now._replace(ticks=ticks))
    angle_before = now.previous[:, 0]
    turn = later.command[0, :, 0] - angle_before
    turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
    largest_turn = ticks * method.period_s * method.layout.rates[:, 0]
    left = LEFT * largest_turn
    wanted = np.sign(turn) * np.maximum(np.abs(turn) - left, 0.0)
    toward = np.where(method.turning, angle_before + AT_ONCE * wanted, np.nan)
    return now._replace(toward=toward, calm=HELD_BY * now.calm)
