"""The least power for a wrench, by the dual."""

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation import Allocator
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.dual.newton import solve
from finlab.allocation.evaluate import REACHED
from finlab.arrays import Array
from finlab.forces.fin_sets import SCALE, FinSets
from finlab.layout import Layout
from finlab.physics import plant_of


def least_power(layout: Layout, wrenches: ArrayLike, *, failed: Collection[str] = ()) -> Array:
    """Returns the least power [W] for each wrench (N, 6) [N, N m]: (N,), NaN where it is out of reach.

    Raises:
        LayoutError: there is no fin of a name in `failed`.
    """
    wanted = np.asarray(wrenches, dtype=np.float64).reshape(-1, 6)
    if len(set(layout.indices(tuple(failed)))) == layout.n:
        return np.where((wanted == 0.0).all(-1), 0.0, np.nan)
    answer = Allocator(layout).allocate_batch(wanted, failed=tuple(failed))
    return np.where(answer.err_norm <= REACHED, answer.power, np.nan)


class MovedFins:
    """The fins of a layout, compiled once, at other places."""

    def __init__(self, layout: Layout) -> None:
        """Compile the fins."""
        self._robot = Compiled(layout, plant_of(layout)).robot

    def least_power(self, sets: FinSets, wrenches: Array) -> Array:
        """The least power (P, N) [W] of P robots for wrenches (N, 6) [N, N m], NaN where it is out of reach.
        Arcs wider than half a turn count with their convex hulls.

        Args:
            sets: what the fins can push; their places count.
            wrenches: what is asked for.
        """
        power = np.full((len(sets.radius), len(wrenches)), np.nan)
        for row, effectiveness in enumerate(sets.effectiveness * SCALE):
            robot = self._robot.moved(effectiveness.swapaxes(0, 1).reshape(-1, 6))
            target = robot.target(wrenches)
            found = solve(robot, target)
            missed = np.abs(robot.basis @ target - (wrenches / robot.scale).T).max(axis=0)
            met = found.solved & (missed < REACHED)
            power[row, met] = found.value[met]
        return power
