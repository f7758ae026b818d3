"""What fins can push at best, by IPOPT in their planar forces: a yardstick that no method has a part in.

In these forces the least error and the largest share of a wrench are optima of convex problems, for every
choice of halves of the arcs that are wider than half a turn.
"""

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.baselines.ipopt import SOLVER_OPTIONS, import_casadi
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.axes import is_full_turn
from finlab.layout.effectiveness import layout_effectiveness
from finlab.physics import plant_of

BESIDE = 1e-6
"""Normalized wrench beside the target that `largest_share` allows on each axis."""


class IpoptReach:
    """The best planar forces for one layout, by IPOPT.

    Args:
        layout: the robot.
        sigma: per-axis standard deviation (6,).
    """

    def __init__(self, layout: Layout, sigma: Array) -> None:
        self.casadi, self.sigma = import_casadi(), sigma
        self.effect = layout_effectiveness(layout) / sigma[:, None]
        plant = plant_of(layout)
        self.thrust = plant.thrust(plant.upper[:, 0], plant.upper[:, 1])
        self.arcs = _convex_arcs(plant.lower[:, 2], plant.upper[:, 2])

    def least_error(self, target: Array, axes: NDArray[np.bool_]) -> float:
        """The least error on some axes (6,) of a normalized target (6,)."""
        force = self.casadi.SX.sym("force", self.effect.shape[1])
        missing = (target - self.casadi.DM(self.effect) @ force)[np.flatnonzero(axes).tolist()]
        return float(np.sqrt(self._best(force, force, self.casadi.sumsqr(missing), [])))

    def largest_share(self, target: Array) -> float:
        """The largest share, up to one, of a normalized target (6,) that can be had alone."""
        force, share = self.casadi.SX.sym("force", self.effect.shape[1]), self.casadi.SX.sym("share")
        beside = self.casadi.DM(self.effect) @ force - share * target
        limits = [(beside[j], -BESIDE, BESIDE) for j in range(6)] + [(share, 0.0, 1.0)]
        return -self._best(force, self.casadi.vertcat(force, share), -share, limits)

    def _best(self, force: Any, unknowns: Any, cost: Any, limits: list[tuple[Any, float, float]]) -> float:
        """The least cost over all choices of halves."""
        return min(self._solve(unknowns, cost, limits + self._fins(force, arcs)) for arcs in self.arcs)

    def _fins(self, force: Any, arcs: Array) -> list[tuple[Any, float, float]]:
        """Limits of each fin's thrust and direction, for one choice of halves."""
        limits: list[tuple[Any, float, float]] = []
        for i, (first, last) in enumerate(arcs):
            across, up = force[2 * i], force[2 * i + 1]
            limits.append((across**2 + up**2, 0.0, self.thrust[i] ** 2))
            if not is_full_turn(last - first):
                middle = 0.5 * (first + last)
                for angle in (first + 0.5 * np.pi, last - 0.5 * np.pi, middle):
                    limits.append((np.cos(angle) * across + np.sin(angle) * up, 0.0, np.inf))
        return limits

    def _solve(self, unknowns: Any, cost: Any, limits: list[tuple[Any, float, float]]) -> float:
        what, low, high = zip(*limits, strict=True)
        program = {"x": unknowns, "f": cost, "g": self.casadi.vertcat(*what)}
        solver = self.casadi.nlpsol("reach", "ipopt", program, SOLVER_OPTIONS)
        return float(solver(x0=0.0, lbg=low, ubg=high)["f"])


def _convex_arcs(lower: Array, upper: Array) -> list[Array]:
    """All choices (n, 2) of arcs of at most half a turn that make up the fins' arcs; full turns stay."""
    choices = []
    for first, last in zip(lower, upper, strict=True):
        middle = 0.5 * (first + last)
        wide = np.pi < last - first and not is_full_turn(last - first)
        choices.append([(first, middle), (middle, last)] if wide else [(first, last)])
    return [np.array(arcs) for arcs in product(*choices)]
