"""Method `ipopt`: CasADi and IPOPT over the forces of the actuators; needs the extra `ipopt`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from finlab.allocation.baselines.ipopt_forces import ForceProgram
from finlab.allocation.baselines.model_based import SOLVED, ModelBased, TimeLimit, TimeLimitedSettings
from finlab.allocation.settings import Settings, number
from finlab.arrays import Array
from finlab.distribution import install
from finlab.errors import AllocationError
from finlab.layout import Layout
from finlab.networks.trained import TrainedWeights

TRADEOFF, USUAL_LOAD = 1e-4, 0.1
"""Weight, beside the squared normalized error, of this share of the power that the strongest actuator takes
at its upper limits: the error given up for it is then at most 4e-3."""
POLISH = 3
"""Levenberg-Marquardt steps from where IPOPT ends onto the target."""
SOLVER_OPTIONS = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 200,
    "ipopt.tol": 1e-9,
    "print_time": False,
    "error_on_fail": False,
}


@dataclass(frozen=True)
class IpoptSettings(TimeLimitedSettings):
    """Settings of method `ipopt`."""

    n_starts: int = number(8, 0, 10_000, "random starts per target, beside the pseudo-inverse's answer")


class Ipopt(ModelBased):
    """IPOPT on power, with the wrench as a constraint, or on `err_norm^2 + power` where it cannot be had.

    The programs are built once per layout with the target as their parameter. Where one start is not enough
    they are run from random ones, too. Each end is made exact by the laws; the cheapest that meets the
    target is the answer. After the time limit no start begins; each may take half as long.

    Raises:
        AllocationError: CasADi is not installed.
    """

    name = "ipopt"
    takes = "any actuator"
    settings_class = IpoptSettings
    settings: IpoptSettings

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, weights: TrainedWeights | None = None
    ) -> None:
        super().__init__(layout, settings, scale, weights)
        self._casadi = import_casadi()

    def _commands(self, targets: Array, seed: int) -> Array:
        answers = [self._answer(target, seed) for target in targets]
        return np.array(answers).reshape(len(targets), self.plant.n, 3)

    def _answer(self, target: Array, seed: int) -> Array:
        """The command (n, 3) for a target (6,): the cheapest that delivers it, and where no start leads
        there, what is best with the error as a cost."""
        best, unit = np.empty(0), target[None] / self.sigma
        for exact in (True, False):
            limit, ends = TimeLimit(self.settings.time_limit_s), list[Array]()
            for start in self._exact.starts(target, self.settings.n_starts, seed):
                if ends and limit.over:
                    break
                ends.append((self._exact if exact else self._near).command(target, start))
            best = self._best(target, np.array(ends), POLISH)
            if np.linalg.norm(self.plant.wrench(best) / self.sigma - unit) <= SOLVED:
                break
        return best

    @cached_property
    def _exact(self) -> ForceProgram:
        return ForceProgram(self._casadi, self._inverse, self.sigma, None, self._options)

    @cached_property
    def _near(self) -> ForceProgram:
        weight = TRADEOFF / (USUAL_LOAD * float(self.plant.power(self.plant.upper).max()))
        return ForceProgram(self._casadi, self._inverse, self.sigma, weight, self._options)

    @property
    def _options(self) -> dict[str, Any]:
        return SOLVER_OPTIONS | {"ipopt.max_cpu_time": 0.5 * self.settings.time_limit_s}


def import_casadi() -> Any:
    try:
        import casadi
    except ImportError as error:
        raise AllocationError(
            f"method ipopt needs CasADi, which is not installed; run: {install('ipopt')}"
        ) from error
    return casadi
