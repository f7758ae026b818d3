"""Methods `trf` and `slsqp`: two solvers of SciPy, from several starts."""

from typing import Unpack

import numpy as np
from scipy.optimize import least_squares, minimize

from finlab.allocation.aim import Aim
from finlab.allocation.baselines.model_based import TIME_LIMIT_S
from finlab.allocation.baselines.single_target import DEFAULT_STARTS, Problem, SingleTarget
from finlab.arrays import Array
from finlab.inference.normalization import Normalization
from finlab.physics import Plant

INSIDE = 1e-6
"""How far within the limits the solver starts, which it requires."""

MET = 1e-6
"""Normalized error up to which an end meets the target."""


class Trf(SingleTarget):
    """`scipy.optimize.least_squares(method="trf")` on the normalized error, with the exact Jacobian.

    Of the ends that meet the target the cheapest wins, else the one with the least error.

    Args:
        normalization: sigma scales the error.
        n_starts: uniform random starts per target, beside the pseudo-inverse's answer.
        max_evaluations: most evaluations of the error per start.
        time_limit_s: processor time per target after which the best command so far is the answer.
        aim: see `ModelBased`.
    """

    name = "trf"

    def __init__(
        self,
        normalization: Normalization,
        *,
        n_starts: int = DEFAULT_STARTS,
        max_evaluations: int = 100,
        time_limit_s: float = TIME_LIMIT_S,
        **aim: Unpack[Aim],
    ) -> None:
        super().__init__(normalization, n_starts=n_starts, time_limit_s=time_limit_s, **aim)
        self.max_evaluations = max_evaluations

    def _minimize(self, problem: Problem, start: Array) -> Array:
        return least_squares(
            problem.residual,
            np.clip(start, INSIDE, 1 - INSIDE),
            problem.residual_slope,
            bounds=(0.0, 1.0),
            method="trf",
            max_nfev=self.max_evaluations,
        ).x

    def _total(self, plant: Plant, command: Array, target: Array) -> Array:
        missing = np.maximum(self.normalization.error(plant.wrench(command), target) - MET, 0.0)
        total: Array = missing / MET + self._cost(plant)(command)
        return total


class Slsqp(SingleTarget):
    """`scipy.optimize.minimize(method="SLSQP")` of `err_norm^2 + cost` within the limits.

    Of the ends, the lowest objective wins.

    Args:
        normalization: sigma scales the error.
        n_starts: uniform random starts per target, beside the pseudo-inverse's answer.
        max_iterations: most iterations per start.
        time_limit_s: processor time per target after which the best command so far is the answer.
        aim: see `ModelBased`.
    """

    name = "slsqp"

    def __init__(
        self,
        normalization: Normalization,
        *,
        n_starts: int = DEFAULT_STARTS,
        max_iterations: int = 200,
        time_limit_s: float = TIME_LIMIT_S,
        **aim: Unpack[Aim],
    ) -> None:
        super().__init__(normalization, n_starts=n_starts, time_limit_s=time_limit_s, **aim)
        self.max_iterations = max_iterations

    def _minimize(self, problem: Problem, start: Array) -> Array:
        return minimize(
            problem.objective,
            start,
            jac=True,
            bounds=[(0.0, 1.0)] * problem.n_free,
            method="SLSQP",
            options={"maxiter": self.max_iterations, "ftol": 1e-12},
        ).x
