"""What the one-target-at-a-time solvers share: free variables, starts, the winner by J."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from finlab.allocation.baselines.model_based import TimeLimit, TimeLimited
from finlab.allocation.command_cost import CommandCost
from finlab.arrays import Array
from finlab.physics import Plant


class OutOfTime(Exception):
    """Ends a solver whose time is up, from within the function that it minimizes."""


class Problem:
    """One target on one layout, over the commands that have a range at all, as positions in 0..1.

    Args:
        plant: the robot.
        target: desired wrench (6,).
        sigma: per-axis standard deviation (6,).
        limit: when to stop.
        cost: what counts beside the squared normalized error; nothing where None.
    """

    def __init__(
        self,
        plant: Plant,
        target: Array,
        sigma: Array,
        limit: TimeLimit | None = None,
        cost: CommandCost | None = None,
    ) -> None:
        self.limit = TimeLimit() if limit is None else limit
        self.cost = cost
        self._best: tuple[float, Array | None] = (np.inf, None)
        self.plant, self.target, self.sigma = plant, target, sigma
        self.free = plant.width.ravel() > 0
        self.n_free = int(self.free.sum())

    def command(self, x: Array) -> Array:
        """Command (n, 3) at positions (n_free,)."""
        position = np.zeros(self.free.size)
        position[self.free] = x
        return self.plant.lower + position.reshape(-1, 3) * self.plant.width

    def position(self, command: Array) -> Array:
        """Positions (n_free,) of a command (n, 3)."""
        return ((command - self.plant.lower).ravel()[self.free]) / self.plant.width.ravel()[self.free]

    def residual(self, x: Array) -> Array:
        """Normalized error (6,); `OutOfTime` where the time is up."""
        error = (self.plant.wrench(self.command(x)) - self.target) / self.sigma
        self._keep(x, float(error @ error))
        return error

    def residual_slope(self, x: Array) -> Array:
        """Derivative (6, n_free) of `residual`."""
        _, jacobian = self.plant.linearize(self.command(x))
        return (jacobian * self.plant.width.ravel() / self.sigma[:, None])[:, self.free]

    def objective(self, x: Array) -> tuple[float, Array]:
        """`err_norm^2 + cost` and its gradient (n_free,); may raise `OutOfTime`."""
        command = self.command(x)
        wrench, jacobian = self.plant.linearize(command)
        residual = (wrench - self.target) / self.sigma
        value, by_command = float(residual @ residual), 2 * (residual / self.sigma) @ jacobian
        if self.cost is not None:
            value += float(self.cost(command[None])[0])
            by_command += self.cost.slopes(command[None])[0].ravel()
        self._keep(x, value)
        return value, (by_command * self.plant.width.ravel())[self.free]

    def minimized(self, solver: Callable[[Problem, Array], Array], start: Array) -> Array:
        """Positions (n_free,) where a solver ends from a start (n_free,); the best so far if time ends it."""
        self._best = (np.inf, start)
        try:
            return solver(self, start)
        except OutOfTime:
            assert self._best[1] is not None
            return self._best[1]

    def _keep(self, x: Array, value: float) -> None:
        """Remember the best positions; end the solver when the time is up."""
        if value < self._best[0]:
            self._best = (value, np.array(x))
        if self.limit.over:
            raise OutOfTime


@dataclass(eq=False, repr=False, kw_only=True)
class SingleTarget(TimeLimited):
    """A ready-made solver run from the pseudo-inverse's answer, which no dead zone holds, and from random
    starts; the end with the lowest J wins."""

    n_starts: int = 8
    """Uniform random starts per target, beside the pseudo-inverse's answer."""

    @abstractmethod
    def _minimize(self, problem: Problem, start: Array) -> Array:
        """Positions (n_free,) where the solver ends from a start (n_free,)."""

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        random = plant.sample(np.random.default_rng(seed), (self.n_starts,))
        first = self._inverse(plant).command(targets)
        result = np.empty((len(targets), plant.n_fins, 3))
        for i, target in enumerate(targets):
            limit = TimeLimit(self.time_limit_s)
            problem = Problem(plant, target, self.normalization.std, limit, self._cost(plant))
            if problem.n_free == 0:
                result[i] = plant.lower
                continue
            ends = [self._end(problem, first[i])]
            ends += [self._end(problem, start) for start in random if not problem.limit.over]
            result[i] = ends[self._total(plant, np.array(ends), target).argmin()]
        return result

    def _end(self, problem: Problem, start: Array) -> Array:
        """The command (n, 3) a solver ends at, or the start itself where it breaks down."""
        end = problem.command(problem.minimized(self._minimize, problem.position(start)))
        return problem.plant.feasible(end) if np.isfinite(end).all() else start
