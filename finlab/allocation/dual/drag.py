"""Drag of rudders: a force that comes with lift, and that has a price as every force has.

A compiled robot offers lift at the watts of its drag. The force of the drag has to be met by the others,
which costs them more or less; how much is known once prices are. So prices and drag are found in turn.
"""

import numpy as np

from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.dual.newton import solve
from finlab.arrays import Array
from finlab.precision import NEARLY, ROUNDS


def at_the_price_of_drag(compiled: Compiled, wrench: Array) -> tuple[Compiled, float]:
    """Returns the robot as it is for one wrench (6,), with its drag and the cost of more of it, and the power
    [W] that no answer undercuts; the robot as it was where the wrench is out of reach or nothing settles."""
    now, prices, bound = compiled, None, 0.0
    for _ in range(ROUNDS):
        robot = now.robot
        found = solve(robot, robot.target((wrench - now.beside)[None]), None, prices)
        if not found.solved[0]:
            return compiled, 0.0
        prices = found.prices
        price = robot.basis @ prices[:, 0] / robot.scale
        bound = max(bound, _dual_value(now, wrench, found.force, price))
        beside = now.beside_of(found.force)
        if np.linalg.norm((beside - now.beside) / robot.scale) < NEARLY:
            return now, bound
        now = compiled.paid(price, beside)
    return compiled, bound


def _dual_value(compiled: Compiled, wrench: Array, force: Array, price: Array) -> float:
    """Power [W] that no answer undercuts, by a price (6,) [W/N, W/(N m)] and the forces (k, 1) [N] that
    answer it: the price of the wrench less what all that the actuators can give is worth at most."""
    robot = compiled.robot
    lines, planes = robot.answers.lines, robot.answers.planes
    paid = (robot.effectiveness @ price) * force[:, 0]
    paid[lines : lines + planes] += paid[lines + planes :]
    size = force[: lines + planes].copy()
    size[lines:] = np.hypot(force[lines : lines + planes], force[lines + planes :])
    worth = np.empty(compiled.count)
    worth[robot.order] = paid[: lines + planes] - robot.answers.marginal(size)[1][:, 0]
    for places, group in compiled.groups:
        own = None if compiled.doubt is not None else group.worth(price)
        if own is not None:
            worth[places] = own
    return float(price @ wrench - worth.sum())
