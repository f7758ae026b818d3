"""Methods `trf` and `slsqp`: two solvers of SciPy, from several starts."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, minimize

from finlab.allocation.baselines.single_target import Problem, SingleTarget
from finlab.arrays import Array
from finlab.physics import Plant

MET = 1e-6
"""Normalized error up to which an end meets the target."""


@dataclass(eq=False, repr=False, kw_only=True)
class Trf(SingleTarget):
    """`scipy.optimize.least_squares(method="trf")` on the normalized error, with the exact Jacobian.

    Of the ends that meet the target the cheapest wins, else the one with the least error.
    """

    name = "trf"
    max_evaluations: int = 100
    """Most evaluations of the error per start."""

    def _minimize(self, problem: Problem, start: Array) -> Array:
        return least_squares(
            problem.residual,
            np.clip(start, 0.0, 1.0),
            problem.residual_slope,
            bounds=(0.0, 1.0),
            method="trf",
            max_nfev=self.max_evaluations,
        ).x

    def _total(self, plant: Plant, command: Array, target: Array) -> Array:
        missing = np.maximum(self.normalization.error(plant.wrench(command), target) - MET, 0.0)
        total: Array = missing / MET + self._cost(plant)(command)
        return total


@dataclass(eq=False, repr=False, kw_only=True)
class Slsqp(SingleTarget):
    """`scipy.optimize.minimize(method="SLSQP")` of `err_norm^2 + cost` within the limits.

    Of the ends, the lowest objective wins.
    """

    name = "slsqp"
    max_iterations: int = 200
    """Most iterations per start."""

    def _minimize(self, problem: Problem, start: Array) -> Array:
        return minimize(
            problem.objective,
            start,
            jac=True,
            bounds=[(0.0, 1.0)] * problem.n_free,
            method="SLSQP",
            options={"maxiter": self.max_iterations, "ftol": 1e-12},
        ).x
