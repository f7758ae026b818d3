"""Method `ipopt`: CasADi and IPOPT from several starts; needs the extra `ipopt`.

Fins whose laws are formulas become CasADi symbols, with exact first and second derivatives. Force tables and
other actuators have none: robots with one are asked for in the space of forces, where each is compiled.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from finlab.allocation.baselines.ipopt_forces import ForceProgram
from finlab.allocation.baselines.model_based import SOLVED, ModelBased, TimeLimit, TimeLimitedSettings
from finlab.allocation.baselines.plant_in_casadi import plant_formulas
from finlab.allocation.settings import Settings, choice, number
from finlab.arrays import Array
from finlab.distribution import install
from finlab.errors import AllocationError
from finlab.layout import Layout
from finlab.networks.trained import TrainedWeights
from finlab.physics import PlanarLaw, make_law

TRADEOFF, USUAL_LOAD = 1e-4, 0.1
"""Weight, beside the squared normalized error, of one unit of effort, and of this share of the power that
the strongest fin takes at its upper limits: the errors given up for either are then alike, at most 4e-3."""
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
    space: str = choice("commands", ("commands", "forces"), "what IPOPT varies; forces are far quicker")


class Ipopt(ModelBased):
    """IPOPT on `err_norm^2 + cost` within the limits, exact derivatives by CasADi.

    The program is built once per layout with the target as its parameter. It is run from the pseudo-inverse's
    answer, which no dead zone holds, and from random starts. Each end is made exact by the laws; the
    cheapest that meets the target is the answer. After the time limit no start begins; each may take half as
    long.

    Raises:
        AllocationError: CasADi is not installed, or effort is asked for where fins are tables.
    """

    name = "ipopt"
    takes = "any actuator"
    settings_class = IpoptSettings
    settings: IpoptSettings

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, weights: TrainedWeights | None = None
    ) -> None:
        super().__init__(layout, settings, scale, weights)
        tables = not all(isinstance(make_law(fin.model), PlanarLaw) for fin in layout.fins)
        self._by_forces = tables or not layout.is_of_fins or self.settings.space == "forces"
        if self._by_forces and self.aim != "power":
            why = "of a force table it" if tables else "space 'forces'"
            raise AllocationError(f"method ipopt: {why} keeps power least, got objective {self.aim!r}")
        self._casadi = import_casadi()

    def _commands(self, targets: Array, seed: int) -> Array:
        answers = [self._answer(target, seed) for target in targets]
        return np.array(answers).reshape(len(targets), self.plant.n, 3)

    def _answer(self, target: Array, seed: int) -> Array:
        """The command (n, 3) for a target (6,): in the space of forces the cheapest that delivers it, and
        where no start leads there, as in that of commands, what is best with the error as a cost."""
        best, unit = np.empty(0), target[None] / self.sigma
        for exact in (True, False) if self._by_forces else (False,):
            limit, ends = TimeLimit(self.settings.time_limit_s), list[Array]()
            for start in self._starts(target, seed):
                if ends and limit.over:
                    break
                ends.append(self._end(target, start, exact))
            best = self._best(target, np.array(ends), POLISH)
            if np.linalg.norm(self.plant.wrench(best) / self.sigma - unit) <= SOLVED:
                break
        return best

    def _starts(self, target: Array, seed: int) -> Array:
        """Where IPOPT starts from: commands (S, n, 3), or forces (S, n, 2)."""
        if self._by_forces:
            return self._exact_forces.starts(target, self.settings.n_starts, seed)
        random = self.plant.sample(np.random.default_rng(seed), (self.settings.n_starts,))
        return np.concatenate([self._inverse.command(target[None]), random])

    def _end(self, target: Array, start: Array, exact: bool) -> Array:
        """The command (n, 3) IPOPT ends at, or the start itself where it breaks down."""
        if self._by_forces:
            return (self._exact_forces if exact else self._near_forces).command(target, start)
        limits = {"lbx": self.plant.lower.ravel(), "ubx": self.plant.upper.ravel()}
        end = np.array(self._solver(x0=start.ravel(), p=target, **limits)["x"], np.float64).reshape(-1, 3)
        return self.plant.feasible(end) if np.isfinite(end).all() else start

    @cached_property
    def _weight(self) -> float:
        """Of the cost beside the squared error."""
        if self.aim == "effort":
            return TRADEOFF
        return TRADEOFF / (USUAL_LOAD * float(self.plant.power(self.plant.upper).max()))

    @cached_property
    def _exact_forces(self) -> ForceProgram:
        return ForceProgram(self._casadi, self._inverse, self.sigma, None, self._options)

    @cached_property
    def _near_forces(self) -> ForceProgram:
        return ForceProgram(self._casadi, self._inverse, self.sigma, self._weight, self._options)

    @property
    def _options(self) -> dict[str, Any]:
        return SOLVER_OPTIONS | {"ipopt.max_cpu_time": 0.5 * self.settings.time_limit_s}

    @cached_property
    def _solver(self) -> Any:
        """The solver; its variables are the commands as they are, its parameter the target."""
        command, wrench, cost = plant_formulas(self._casadi, self.plant, self.aim)
        target = self._casadi.SX.sym("target", 6)
        missing = (wrench - target) / self._casadi.DM(self.sigma)
        program = {"x": command, "p": target, "f": self._casadi.sumsqr(missing) + self._weight * cost}
        return self._casadi.nlpsol("allocation", "ipopt", program, self._options)


def import_casadi() -> Any:
    try:
        import casadi
    except ImportError as error:
        raise AllocationError(
            f"method ipopt needs CasADi, which is not installed; run: {install('ipopt')}"
        ) from error
    return casadi
