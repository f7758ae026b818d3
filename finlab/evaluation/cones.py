"""Clarabel in the space of forces: least watts as a cone program, a baseline for times and for power.

Power that grows with the force to 1.5, as that of thrusters and of fins of law `drag` between their least and
largest force, is a power cone; a fin that turns fully is a second-order cone. What a robot cannot deliver is
missed at a quadratic price, so that each target has an answer.
"""

from importlib import import_module
from typing import Any

import numpy as np
from scipy import sparse

from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.method import Method
from finlab.allocation.policy import Policy
from finlab.allocation.settings import Settings
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.layout import Layout
from finlab.networks.trained import TrainedWeights

EXPONENT = 1.5
"""Of the force in the power."""
MISS = 1e7
"""Price of the squared error beside the power over the largest one."""
MOST_BEYOND = 1e-6
"""Share of a full turn by which an arc may fall short of it."""


class Cones(Method):
    """One cone program for each robot, whose right side is the target; at rest, whatever the flow."""

    name = "clarabel"
    every_policy = False

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, weights: TrainedWeights | None = None
    ) -> None:
        super().__init__(layout, settings, scale, weights)
        self._compiled = Compiled(layout, self.plant)
        self._lines = self._compiled.robot.answers.lines
        if (self._compiled.robot.sets.half < np.pi * (1.0 - MOST_BEYOND)).any():
            raise AllocationError("method clarabel: expected fins and azimuths that turn fully, got an arc")
        try:
            self._solver, self._right = self._program(import_module("clarabel"))
        except ModuleNotFoundError:
            raise AllocationError(
                "method clarabel needs Clarabel, which is not installed; run: pip install clarabel"
            ) from None

    def _program(self, clarabel: Any) -> tuple[Any, Array]:
        """The solver and the right sides (K,) of its rows, the first of which are the target's.

        Variables: lines ahead, lines back, first and second directions of planes, each over its largest
        force; sizes of planes; powers of lines ahead and back and of planes; what is missed.
        """
        robot, lines = self._compiled.robot, self._lines
        planes, axes = len(robot.most) - lines, robot.matrix.shape[1]
        high, low = robot.sets.high[:, 0], robot.sets.low[:lines, 0]
        most = np.concatenate([high[:lines], np.maximum(-low, 1e-12), high[lines:]])
        sets = robot.sets
        cost = np.concatenate([sets.high_cost[:lines], sets.low_cost[:lines], sets.high_cost[lines:]])[:, 0]
        per = robot.matrix * np.concatenate([high, high[lines:]])[:, None]
        ahead, first, second = np.split(per, [lines, lines + planes])
        back = -robot.matrix[:lines] * most[lines : 2 * lines, None]
        forces, sizes = 2 * lines + 2 * planes, 2 * lines + planes
        size_at = [*range(2 * lines), *range(forces, forces + planes)]
        power_at = range(forces + planes, forces + planes + sizes)
        count = forces + planes + sizes + axes
        rows = sparse.lil_matrix((axes + 2 * sizes + 3 * planes + 3 * sizes, count))
        rows[:axes, :forces] = np.concatenate([ahead, back, first, second]).T
        rows[:axes, count - axes :] = np.eye(axes)
        right, at = np.zeros(rows.shape[0]), axes
        for place, possible in zip(size_at, most > 1e-9, strict=True):  # 0 <= size <= 1
            rows[at, place], rows[at + 1, place], right[at + 1] = -1.0, 1.0, float(possible)
            at += 2
        cones = [clarabel.ZeroConeT(axes), clarabel.NonnegativeConeT(2 * sizes)]
        for k in range(planes):
            for i, place in enumerate((forces + k, 2 * lines + k, 2 * lines + planes + k)):
                rows[at + i, place] = -1.0
            cones.append(clarabel.SecondOrderConeT(3))
            at += 3
        for power, size in zip(power_at, size_at, strict=True):
            rows[at, power], right[at + 1], rows[at + 2, size] = -1.0, 1.0, -1.0
            cones.append(clarabel.PowerConeT(1.0 / EXPONENT))
            at += 3
        linear, weights = np.zeros(count), robot.basis * (robot.scale / self.scale)[:, None]
        linear[power_at] = cost / cost.sum()
        missed = sparse.block_diag([sparse.csc_matrix((count - axes,) * 2), MISS * weights.T @ weights])
        settings = clarabel.DefaultSettings()
        settings.verbose = settings.presolve_enable = False  # its rows are to be kept for the next target
        squares, left = sparse.triu(missed, format="csc"), sparse.csc_matrix(rows)
        return clarabel.DefaultSolver(squares, linear, left, right, cones, settings), right

    def solve(
        self,
        targets: Array,
        *,
        policy: Policy,
        previous: Array | None = None,
        flow: Array | None = None,
        seed: int = 0,
    ) -> Solution:
        """See `Method`."""
        robot, lines = self._compiled.robot, self._lines
        high, least = robot.sets.high[:, 0], robot.sets.low[:lines, 0]
        found = np.empty((len(robot.matrix), len(targets)))
        for i, target in enumerate(robot.target(targets).T):
            self._right[: len(target)] = target
            self._solver.update(b=self._right)
            share = np.asarray(self._solver.solve().x)
            found[:lines, i] = share[:lines] * high[:lines] + share[lines : 2 * lines] * least
            found[lines:, i] = share[2 * lines : lines + len(found)] * np.tile(high[lines:], 2)
        return Solution(self.plant.feasible(self._compiled.commands(found)))
