"""Method `ipopt`: CasADi and IPOPT over the forces of the actuators; needs the extra `ipopt`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from time import thread_time
from typing import Any

import numpy as np

from finlab.allocation.baselines.ipopt_forces import ForceProgram
from finlab.allocation.baselines.model_based import SOLVED, ModelBased, TimeLimitedSettings
from finlab.allocation.settings import number
from finlab.arrays import Array
from finlab.assets import install
from finlab.errors import AllocationError

POLISH, APPROACH = 3, 30
"""Levenberg-Marquardt steps from where IPOPT ends onto the target, or as near as they come."""
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
    """IPOPT on power, with the wrench as a constraint.

    The program is built once per layout with the target as its parameter. Where one start is not enough it
    is run from random ones, too. Each end is made exact by the laws; the cheapest that meets the target is
    the answer, else the one that comes nearest. After the time limit no start begins; each may take half as
    long.

    Raises:
        AllocationError: CasADi is not installed.
    """

    name = "ipopt"
    takes = "any actuator"
    settings_class = IpoptSettings
    settings: IpoptSettings

    def prepare(self) -> None:
        super().prepare()
        self._casadi = import_casadi()

    def _commands(self, targets: Array, seed: int) -> Array:
        answers = [self._answer(target, seed) for target in targets]
        return np.array(answers).reshape(len(targets), self.plant.n, 3)

    def _answer(self, target: Array, seed: int) -> Array:
        """The command (n, 3) for a target (6,): the cheapest that delivers it, else the nearest."""
        over, ends = thread_time() + self.settings.time_limit_s, list[Array]()
        for start in self._program.starts(target, self.settings.n_starts, seed):
            if ends and thread_time() > over:
                break
            ends.append(self._program.command(target, start))
        best = self._best(target, np.array(ends), POLISH)
        if np.linalg.norm((self.plant.wrench(best) - target) / self.sigma) > SOLVED:
            best = self._best(target, np.array(ends), APPROACH)
        return best

    @cached_property
    def _program(self) -> ForceProgram:
        options = SOLVER_OPTIONS | {"ipopt.max_cpu_time": 0.5 * self.settings.time_limit_s}
        return ForceProgram(self._casadi, self._inverse, self.sigma, options)


def import_casadi() -> Any:
    try:
        import casadi
    except ImportError as error:
        raise AllocationError(
            f"method ipopt needs CasADi, which is not installed; run: {install('ipopt')}"
        ) from error
    return casadi
