"""Method `ipopt`: CasADi and IPOPT from random starts; needs the extra `ipopt`."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.baselines.model_based import CACHE_SIZE, ENERGY_TRADEOFF, TIME_LIMIT_S
from finlab.allocation.baselines.single_target import DEFAULT_STARTS, Problem, SingleTarget
from finlab.errors import AllocationError
from finlab.inference.normalization import Normalization
from finlab.physics import PlanarLaw, Plant, make_law
from finlab.physics.energy import energy_of_shares, energy_scale

Array = NDArray[np.float64]

SOLVER_OPTIONS = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 200,
    "ipopt.tol": 1e-9,
    "print_time": False,
    "error_on_fail": False,
}


class Ipopt(SingleTarget):
    """IPOPT on `err_norm^2 + 1e-4 J_en` within the limits, exact derivatives by CasADi.

    The program is built once per layout with the target as its parameter. Knows the analytic fin models
    that have a formula. Of the ends, the lowest objective wins.

    Args:
        normalization: sigma scales the error.
        n_starts: uniform random starts per target.
        time_limit_s: processor time per target after which no start begins; each may take half as long.

    Raises:
        AllocationError: CasADi is not installed.
    """

    name = "ipopt"

    def __init__(
        self,
        normalization: Normalization,
        *,
        n_starts: int = DEFAULT_STARTS,
        time_limit_s: float = TIME_LIMIT_S,
    ) -> None:
        super().__init__(normalization, n_starts=n_starts, time_limit_s=time_limit_s)
        self._casadi = import_casadi()
        self._solver = lru_cache(CACHE_SIZE)(self._build)

    def _minimize(self, problem: Problem, start: Array) -> Array:
        solver = self._solver(problem.plant)
        answer = solver(x0=problem.command(start).ravel(), p=problem.target, **self._bounds(problem))
        return problem.position(np.array(answer["x"], np.float64).reshape(-1, 3))

    @staticmethod
    def _bounds(problem: Problem) -> dict[str, Array]:
        return {"lbx": problem.plant.lower.ravel(), "ubx": problem.plant.upper.ravel()}

    def _build(self, plant: Plant) -> Any:
        """The solver of one layout; its variables are the commands as they are, its parameter the target."""
        command, target, residual, energy = self._formulas(plant)
        objective = self._casadi.sumsqr(residual) + ENERGY_TRADEOFF * energy
        program = {"x": command, "p": target, "f": objective}
        options = SOLVER_OPTIONS | {"ipopt.max_cpu_time": 0.5 * self.time_limit_s}
        return self._casadi.nlpsol("allocation", "ipopt", program, options)

    def _formulas(self, plant: Plant) -> tuple[Any, Any, Any, Any]:
        """Symbolic command (3n), target (6), normalized error (6) and energy."""
        cs = self._casadi
        command, target = cs.SX.sym("command", 3 * plant.n_fins), cs.SX.sym("target", 6)
        wrench, energy = cs.SX.zeros(6), 0
        scale = energy_scale(plant.upper)
        for i, fin in enumerate(plant.layout.fins):
            amplitude, frequency, direction = (command[3 * i + k] for k in range(3))
            law = make_law(fin.model)
            if not isinstance(law, PlanarLaw):
                raise AllocationError(
                    f"method ipopt needs a closed formula, fin {fin.name} follows a {fin.model.type}; "
                    "use trf or multistart"
                )
            thrust, points = law.thrust(amplitude, frequency, direction), direction + law.offset
            wrench += thrust * cs.cos(points) * cs.DM(plant.columns[i, 1])
            wrench += thrust * cs.sin(points) * cs.DM(plant.columns[i, 2])
            shares = amplitude / scale[i, 0], frequency / scale[i, 1], direction / scale[i, 2]
            energy += energy_of_shares(*shares)
        return command, target, (wrench - target) / cs.DM(self.normalization.std), energy


def import_casadi() -> Any:
    try:
        import casadi
    except ImportError as error:
        raise AllocationError(
            "method ipopt needs CasADi, which is not installed; run: pip install 'finlab[ipopt]'"
        ) from error
    return casadi
