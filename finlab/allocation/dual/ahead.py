"""Angles to which pods turn when the wrenches of the next ticks are known; docs/theory/method.md,
"Turning ahead".

Beside the wrench of now, that of a later tick is answered, within what the drives allow until then,
and with what turning costs over that time. Its angles are those that the pods will want. Their
small part is left, as turning there and back with every wave gains little; half of the remainder is
wanted now, the next tick wants half of what then remains.
"""

import numpy as np

from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.policy import CLOSEST
from finlab.arrays import Array
from finlab.axes import TURN
from finlab.core.calls import Conditions

MAX_TICKS_AHEAD = 8
"""Ticks to which pods look ahead at most."""
IGNORED_SHARE = 0.1
"""Share of the turn that the drives allow until then, up to which a pod stays where it is."""
SHARE_NOW = 0.5
"""Share of the remaining turn that is wanted now."""
CALM_FACTOR = 10.0
"""Factor of what turning costs: to stand at another angle than is wanted is that much dearer."""


def conditions_ahead(
    compiled: Compiled, turn_rates: Array, period_s: float, reference: Array, conditions: Conditions
) -> Conditions:
    """Returns what holds, with the angles near which pods are to stand.

    Args:
        compiled: the robot.
        turn_rates: (n,) [rad/s] at which pods turn, NaN of actuators that stay out of this.
        period_s: time between ticks [s].
        reference: wrenches (K, 6) of the next ticks [N, N m], at least one.
        conditions: what holds, in a tick.

    Returns:
        The same with the wanted angles (n,) [rad], NaN of actuators that are no pods, are lost, or
        have no known command before, and with what it costs to stand elsewhere.
    """
    assert conditions.previous is not None
    last = min(len(reference), MAX_TICKS_AHEAD)
    ticks = last + 1
    then = compiled.forces(
        reference[last - 1 : last], CLOSEST, None, conditions._replace(ticks=ticks)
    )
    angle_previous = conditions.previous[:, 0]
    turn = then.command[0, :, 0] - angle_previous
    turn = (turn + np.pi) % TURN - np.pi
    largest_turn = ticks * period_s * turn_rates
    ignored_turn = IGNORED_SHARE * largest_turn
    wanted_turn = np.sign(turn) * np.maximum(np.abs(turn) - ignored_turn, 0.0)
    angles_wanted = angle_previous + SHARE_NOW * wanted_turn
    return conditions._replace(angles_wanted=angles_wanted, calm=CALM_FACTOR * conditions.calm)
