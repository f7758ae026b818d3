"""Methods of one linear map per layout: `qp`, least squares as the paper, `analytic`, the pseudo-inverse."""

from functools import cached_property

import numpy as np
from scipy.optimize import lsq_linear

from finlab.allocation.baselines.model_based import ModelBased
from finlab.arrays import Array
from finlab.physics import Plant

DIFFERENCE_STEP = 1e-4
"""Half width of the central differences, as a share of each command's range."""


class LinearMap:
    """The actuation map of a layout, linearized by central differences at the middle of the limits. Commands
    are positions between the limits, from 0 to 1."""

    def __init__(self, plant: Plant, sigma: Array) -> None:
        self.reference = (plant.lower + plant.upper) / 2
        n = self.reference.size
        offset = DIFFERENCE_STEP * np.eye(n).reshape(n, -1, 3) * plant.width
        rise = plant.wrench(self.reference + offset) - plant.wrench(self.reference - offset)
        self.free = plant.width.ravel() > 0
        """Commands (3 n,) that have a range at all; SciPy takes no others."""
        self.matrix = (rise / (2 * DIFFERENCE_STEP) / sigma).T[:, self.free]
        self.wrench = plant.wrench(self.reference)


class Qp(ModelBased):
    """Linearized once per layout, solved per target by SciPy's active-set `lsq_linear(method="bvls")`.

    Minimizes `||(w_ref + J du - target) / sigma||^2 + ||du||^2` over commands as positions
    between their limits, where `w_ref` and `J` belong to the middle of the limits. What commands cost plays
    no part. (What the paper's QP regularizes it does not say.)
    """

    name = "qp"

    @cached_property
    def _map(self) -> LinearMap:
        return LinearMap(self.plant, self.sigma)

    def _commands(self, targets: Array, seed: int) -> Array:
        linear, plant = self._map, self.plant
        n_free = int(linear.free.sum())
        step = np.zeros((len(targets), linear.free.size))
        if n_free:
            matrix = np.vstack([linear.matrix, np.eye(n_free)])
            wanted = np.zeros((len(targets), 6 + n_free))
            wanted[:, :6] = (targets - linear.wrench) / self.sigma
            for i, right in enumerate(wanted):
                step[i, linear.free] = lsq_linear(matrix, right, (-0.5, 0.5), method="bvls").x
        return linear.reference + step.reshape(-1, plant.n_fins, 3) * plant.width


class Analytic(ModelBased):
    """Pseudo-inverse of the forces, rows scaled by sigma and columns by each actuator's largest force, which
    each gives by its cheapest command. What does not fit is clipped, the rest not redistributed."""

    name = "analytic"
    takes = "any actuator"

    def _commands(self, targets: Array, seed: int) -> Array:
        return self._inverse.command(targets)
