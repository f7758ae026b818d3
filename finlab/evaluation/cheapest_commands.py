"""The yardstick of costs: the cheapest command that tracks a target exactly, from many random starts.

Nothing here knows how the allocators search. Where all fins have a formula and CasADi is installed, IPOPT
minimizes the cost with the wrench as a constraint and exact second derivatives; else the starts first descend
onto the target, and SciPy's SLSQP goes on from there with the plant's exact first derivatives. Each end is a
local minimum; the cheapest one is the yardstick.
"""

from functools import lru_cache
from importlib.util import find_spec
from typing import Any

import numpy as np

from finlab.allocation.baselines.ipopt import SOLVER_OPTIONS, import_casadi
from finlab.allocation.baselines.plant_in_casadi import plant_formulas
from finlab.allocation.baselines.sqp import Solve, cheapest_program, pushed_axes
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics import PlanarLaw, Plant, make_law, plant_of
from finlab.physics.objective import Objective

EXACT = 1e-5
"""Normalized error up to which an end counts as tracking exactly."""
DESCENT_STEPS = 40
"""From a random command onto the target."""


class CheapestCommands:
    """Commands of least cost under exact tracking, from starts anywhere within the limits."""

    def __init__(self, objective: Objective, sigma: Array) -> None:
        """Prepare for an objective.

        Args:
            objective: what a command costs.
            sigma: per-axis standard deviation (6,) that errors are divided by.
        """
        self.objective, self.sigma = objective, sigma
        self._solver = lru_cache(16)(self._prepare)

    def ends(self, layout: Layout, target: Array, n_starts: int, seed: int) -> tuple[Array, Array]:
        """Commands (M, n, 3) that deliver a target (6,), cheapest first, and their costs (M,).

        Args:
            layout: the robot, all of its fins healthy.
            target: desired wrench [N, N m].
            n_starts: random starts; there are as many ends or fewer.
            seed: of the starts.
        """
        plant = plant_of(layout)
        starts = plant.sample(np.random.default_rng(seed), (n_starts,))
        solve = self._solver(layout)
        if not has_formulas(layout):
            problem = CommandProblem.of(plant, self.sigma)
            starts = refine(problem, target[None] / self.sigma, starts, DESCENT_STEPS).command
        command = np.array([solve(target / self.sigma, start) for start in starts])
        command = plant.feasible(command[np.isfinite(command).all((1, 2))].reshape(-1, plant.n_fins, 3))
        error = np.linalg.norm((plant.wrench(command) - target) / self.sigma, axis=-1)
        command = command[error <= EXACT]
        cost = np.asarray(self.objective.meter(plant)(command))
        order = cost.argsort()
        return command[order], cost[order]

    def _prepare(self, layout: Layout) -> Solve:
        return (self._by_ipopt if has_formulas(layout) else self._by_slsqp)(plant_of(layout))

    def _by_ipopt(self, plant: Plant) -> Solve:
        casadi: Any = import_casadi()
        command, wrench, cost = plant_formulas(casadi, plant, self.objective)
        target = casadi.SX.sym("target", 6)
        missing = casadi.DM(pushed_axes(plant, self.sigma)) @ (wrench / casadi.DM(self.sigma) - target)
        program = {"x": command, "p": target, "f": cost, "g": missing}
        solver = casadi.nlpsol("cheapest", "ipopt", program, SOLVER_OPTIONS)
        limits = {"lbx": plant.lower.ravel(), "ubx": plant.upper.ravel(), "lbg": 0.0, "ubg": 0.0}

        def solve(wanted: Array, start: Array) -> Array:
            answer = solver(x0=start.ravel(), p=wanted, **limits)
            return np.array(answer["x"], np.float64).reshape(-1, 3)

        return solve

    def _by_slsqp(self, plant: Plant) -> Solve:
        return cheapest_program(plant, self.objective.meter(plant), self.sigma, steps=100, settled=1e-9)


def has_formulas(layout: Layout) -> bool:
    """Whether IPOPT can be asked about a robot: all of its fins have a formula, and CasADi is installed."""
    known = all(isinstance(make_law(fin.model), PlanarLaw) for fin in layout.fins)
    return known and find_spec("casadi") is not None
