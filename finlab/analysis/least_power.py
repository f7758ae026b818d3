"""The least power for a wrench, by the dual."""

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation import Allocator
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.dual.newton import solve
from finlab.allocation.evaluate import REACHED
from finlab.arrays import Array
from finlab.forces.force_sets import SCALE, ForceSets
from finlab.layout import Layout
from finlab.physics import plant_of


def least_power(
    layout: Layout,
    wrenches: ArrayLike,
    *,
    failed: Collection[str] = (),
    flow: ArrayLike | None = None,
) -> Array:
    """Returns the least power [W] for each wrench (N, 6) [N, N m]: (N,), NaN where it is out of reach; `flow`
    as for an allocator.

    Raises:
        LayoutError: there is no actuator of a name in `failed`.
    """
    wanted = np.asarray(wrenches, dtype=np.float64).reshape(-1, 6)
    if len(set(layout.indices(tuple(failed)))) == layout.n:
        return np.where((wanted == 0.0).all(-1), 0.0, np.nan)
    answer = Allocator(layout).allocate_batch(wanted, failed=tuple(failed), flow=flow)
    return np.where(answer.err_norm <= REACHED, answer.power, np.nan)


class MovedActuators:
    """The actuators of a layout, compiled once, at other places and at rest."""

    def __init__(self, layout: Layout) -> None:
        """Compile the actuators."""
        self._robot = Compiled(layout, plant_of(layout)).robot

    def least_power(self, sets: ForceSets, wrenches: Array) -> Array:
        """The least power (P, N) [W] of P robots for wrenches (N, 6) [N, N m], NaN where it is out of reach.
        Arcs wider than half a turn count with their convex hulls.

        Args:
            sets: what the actuators can push; their places count.
            wrenches: what is asked for.
        """
        power = np.full((len(sets.radius), len(wrenches)), np.nan)
        lines, planes = np.split(self._robot.order, [self._robot.answers.lines])
        for row, effectiveness in enumerate(sets.effectiveness * SCALE):
            ahead, across = effectiveness.swapaxes(0, 1)
            robot = self._robot.moved(np.concatenate([ahead[lines], ahead[planes], across[planes]]))
            target = robot.target(wrenches)
            found = solve(robot, target)
            missed = np.abs(robot.basis @ target - (wrenches / robot.scale).T).max(axis=0)
            met = found.solved & (missed < REACHED)
            power[row, met] = found.value[met]
        return power
