"""Method `ipopt`: CasADi and IPOPT from several starts; needs the extra `ipopt`.

Fins whose laws are formulas become CasADi symbols, with exact first and second derivatives. A robot with a
force table has no formula: it becomes a CasADi callback that asks the plant (`plant_in_casadi`), with the
table's exact Jacobian and IPOPT's own approximation of the Hessian.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.baselines.ipopt_forces import ForceProgram
from finlab.allocation.baselines.model_based import ModelBased, TimeLimit, TimeLimitedSettings
from finlab.allocation.baselines.plant_in_casadi import plant_formulas, plant_in_casadi
from finlab.allocation.settings import Settings, choice, number
from finlab.arrays import Array
from finlab.distribution import install
from finlab.errors import AllocationError
from finlab.layout import Layout
from finlab.networks.trained import TrainedWeights
from finlab.physics import PlanarLaw, make_law

SOLVER_OPTIONS = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 200,
    "ipopt.tol": 1e-9,
    "print_time": False,
    "error_on_fail": False,
}


class Formulas(NamedTuple):
    """A robot as CasADi sees it."""

    command: Any
    """Commands (3 n,)."""
    target: Any
    """Wrench that is wanted (6,)."""
    residual: Any
    """Normalized error (6,)."""
    cost: Any
    """What the commands cost, weighed beside the squared error."""
    options: dict[str, Any]
    """Options of IPOPT."""
    called: Any
    """A callback to be kept alive; None where there is none."""


@dataclass(frozen=True)
class IpoptSettings(TimeLimitedSettings):
    """Settings of method `ipopt`."""

    n_starts: int = number(8, 0, 10_000, "random starts per target, beside the pseudo-inverse's answer")
    space: str = choice("commands", ("commands", "forces"), "what IPOPT varies; forces are far quicker")


class Ipopt(ModelBased):
    """IPOPT on `err_norm^2 + cost` within the limits, exact derivatives by CasADi or the plant.

    The program is built once per layout with the target as its parameter. It is run from the pseudo-inverse's
    answer, which no dead zone holds, and from random starts; of the ends, the lowest objective wins. After
    the time limit no start begins; each may take half as long.

    Raises:
        AllocationError: CasADi is not installed.
    """

    name = "ipopt"
    settings_class = IpoptSettings
    settings: IpoptSettings

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, weights: TrainedWeights | None = None
    ) -> None:
        super().__init__(layout, settings, scale, weights)
        if self.settings.space == "forces" and self.aim.name != "power":
            raise AllocationError(
                f"method ipopt: space 'forces' keeps power least, got objective {self.aim.name!r}; "
                "take space 'commands'"
            )
        self._casadi = import_casadi()

    def _commands(self, targets: Array, seed: int) -> Array:
        if self.settings.space == "forces":
            return self._by_forces(targets, seed)
        random = self.plant.sample(np.random.default_rng(seed), (self.settings.n_starts,))
        first = self._inverse.command(targets)
        result = np.empty((len(targets), self.plant.n_fins, 3))
        for i, target in enumerate(targets):
            limit = TimeLimit(self.settings.time_limit_s)
            ends = [self._end(target, first[i])]
            ends += [self._end(target, start) for start in random if not limit.over]
            result[i] = ends[self._total(np.array(ends), target).argmin()]
        return result

    def _by_forces(self, targets: Array, seed: int) -> Array:
        """Commands (N, n, 3) for targets (N, 6), found in the space of forces."""
        program, result = self._force_program, []
        for target in targets:
            limit = TimeLimit(self.settings.time_limit_s)
            starts = program.starts(target, self.settings.n_starts, seed)
            ends = np.array(
                [program.command(target, each) for k, each in enumerate(starts) if not (k and limit.over)]
            )
            result.append(ends[self._total(ends, target).argmin()])
        return np.array(result).reshape(len(targets), self.plant.n_fins, 3)

    @cached_property
    def _force_program(self) -> ForceProgram:
        return ForceProgram(self._casadi, self._inverse, self.sigma, self._cost.weight, self._options)

    @property
    def _options(self) -> dict[str, Any]:
        return SOLVER_OPTIONS | {"ipopt.max_cpu_time": 0.5 * self.settings.time_limit_s}

    def _end(self, target: Array, start: Array) -> Array:
        """The command (n, 3) IPOPT ends at, or the start itself where it breaks down."""
        plant = self.plant
        limits = {"lbx": plant.lower.ravel(), "ubx": plant.upper.ravel()}
        answer = self._solver[0](x0=start.ravel(), p=target, **limits)
        end = np.array(answer["x"], np.float64).reshape(-1, 3)
        return plant.feasible(end) if np.isfinite(end).all() else start

    @cached_property
    def _solver(self) -> tuple[Any, Formulas]:
        """The solver, and the formulas, which must live as long; its variables are the commands as they are,
        its parameter the target."""
        formulas = self._formulas()
        objective = self._casadi.sumsqr(formulas.residual) + formulas.cost
        program = {"x": formulas.command, "p": formulas.target, "f": objective}
        options = self._options | formulas.options
        return self._casadi.nlpsol("allocation", "ipopt", program, options), formulas

    def _formulas(self) -> Formulas:
        """What the robot's commands give and cost."""
        cs, plant, sigma = self._casadi, self.plant, self._casadi.DM(self.sigma)
        if not all(isinstance(make_law(fin.model), PlanarLaw) for fin in plant.layout.fins):
            answer = plant_in_casadi(cs, plant, self._cost)
            command, target = cs.MX.sym("command", 3 * plant.n_fins), cs.MX.sym("target", 6)
            given = answer(command)
            options = {"ipopt.hessian_approximation": "limited-memory"}
            return Formulas(command, target, (given[:6] - target) / sigma, given[6], options, answer)
        command, wrench, cost = plant_formulas(cs, plant, self.aim)
        target = cs.SX.sym("target", 6)
        weight = self._cost.weight
        return Formulas(command, target, (wrench - target) / sigma, weight * cost, {}, None)


def import_casadi() -> Any:
    try:
        import casadi
    except ImportError as error:
        raise AllocationError(
            f"method ipopt needs CasADi, which is not installed; run: {install('ipopt')}"
        ) from error
    return casadi
