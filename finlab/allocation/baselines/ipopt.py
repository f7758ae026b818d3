"""Method `ipopt`: CasADi and IPOPT from random starts; needs the extra `ipopt`."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.baselines.actuation import Actuation
from finlab.allocation.baselines.model_based import CACHE_SIZE, ENERGY_TRADEOFF
from finlab.allocation.baselines.single_target import DEFAULT_STARTS, Problem, SingleTarget
from finlab.errors import AllocationError
from finlab.inference.normalization import Normalization
from finlab.physics.energy import DEFAULT_WEIGHTS, energy_scale

Array = NDArray[np.float64]

BESSEL_TERMS = 16
"""Terms of the power series of J1; exact to rounding for any amplitude a fin may have."""
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
    `drag` and `lighthill`. Of the ends, the lowest objective wins.

    Args:
        normalization: sigma scales the error.
        n_starts: uniform random starts per target.

    Raises:
        AllocationError: CasADi is not installed.
    """

    name = "ipopt"

    def __init__(self, normalization: Normalization, *, n_starts: int = DEFAULT_STARTS) -> None:
        super().__init__(normalization, n_starts=n_starts)
        self._casadi = import_casadi()
        self._solver = lru_cache(CACHE_SIZE)(self._build)

    def _minimize(self, problem: Problem, start: Array) -> Array:
        solver = self._solver(problem.actuation)
        answer = solver(x0=problem.command(start).ravel(), p=problem.target, **self._bounds(problem))
        return problem.position(np.array(answer["x"], np.float64).reshape(-1, 3))

    @staticmethod
    def _bounds(problem: Problem) -> dict[str, Array]:
        return {"lbx": problem.actuation.lower.ravel(), "ubx": problem.actuation.upper.ravel()}

    def _build(self, actuation: Actuation) -> Any:
        """The solver of one layout; its variables are the commands as they are, its parameter the target."""
        command, target, residual, energy = self._formulas(actuation)
        objective = self._casadi.sumsqr(residual) + ENERGY_TRADEOFF * energy
        program = {"x": command, "p": target, "f": objective}
        return self._casadi.nlpsol("allocation", "ipopt", program, SOLVER_OPTIONS)

    def _formulas(self, actuation: Actuation) -> tuple[Any, Any, Any, Any]:
        """Symbolic command (3n), target (6), normalized error (6) and energy."""
        cs = self._casadi
        command, target = cs.SX.sym("command", 3 * actuation.n_fins), cs.SX.sym("target", 6)
        wrench, energy = cs.SX.zeros(6), 0
        scale, weights = energy_scale(actuation.upper), DEFAULT_WEIGHTS
        for i, fin in enumerate(actuation.layout.fins):
            amplitude, frequency, direction = (command[3 * i + k] for k in range(3))
            thrust = self._thrust(fin.model.type, fin.model.values(), amplitude, frequency)
            wrench += thrust * cs.cos(direction) * cs.DM(actuation.horizontal[:, i])
            wrench += thrust * cs.sin(direction) * cs.DM(actuation.vertical[:, i])
            a, f, d = amplitude / scale[i, 0], frequency / scale[i, 1], direction / scale[i, 2]
            energy += weights.amplitude * a**2 + weights.frequency * f**2
            energy += weights.zero_direction * d**2 + weights.product * a * f
        return command, target, (wrench - target) / cs.DM(self.normalization.std), energy

    def _thrust(self, kind: str, values: dict[str, float | str], amplitude: Any, frequency: Any) -> Any:
        """Symbolic thrust [N] of one fin."""
        number = {key: float(value) for key, value in values.items() if not isinstance(value, str)}
        turning = (2 * np.pi * frequency) ** 2
        if kind == "drag":
            size = number["density"] * number["drag_coefficient"] * number["area"] * number["lever"] ** 2
            return 4 * size * turning * self._casadi.sin(amplitude) ** 2
        if kind == "lighthill":
            mass = np.pi / 4 * number["density"] * number["width"] ** 2
            return mass / 2 * number["length"] ** 2 * turning * amplitude * _bessel_j1(amplitude)
        raise AllocationError(
            f"method ipopt needs a closed formula and knows the fin models drag and lighthill, got {kind!r}; "
            "use trf or multistart"
        )


def _bessel_j1(x: Any) -> Any:
    """Power series of the Bessel function J1, for a symbolic argument."""
    term, total = x / 2, x / 2
    for k in range(1, BESSEL_TERMS):
        term = -term * x**2 / (4 * k * (k + 1))
        total += term
    return total


def import_casadi() -> Any:
    try:
        import casadi
    except ImportError as error:
        raise AllocationError(
            "method ipopt needs CasADi, which is not installed; run: pip install 'finlab[ipopt]'"
        ) from error
    return casadi
