"""Method `sqp`: re-linearize at the iterate, box QP on residual and cost, backtracking line search."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.baselines.box_least_squares import EXACTLY, BoxSettings, solve_box_quadratics
from finlab.allocation.baselines.model_based import ModelBased, TimeLimit, TimeLimitedSettings
from finlab.allocation.command_cost import CommandCost
from finlab.allocation.settings import number
from finlab.arrays import Array
from finlab.physics import Plant

CHUNK = 2048
"""Rows stepped together; more would not fit the caches."""
SOLVED = 1e-8
"""Normalized error at which a row stops."""
LEAST_GAIN = 1e-4
"""Share of J by which a whole step must lower it, half a step by half of that; or the row stops."""
STAGES = ((300.0, 8), (3.0, 4))
"""How many times the cost counts in J, and for how many steps: much at first, or the way along the exact
commands, which bends, would be cut into short steps."""
NEARLY = BoxSettings(max_steps=5, tolerance=1e-2)
"""How exactly steps on J are found: their model of the cost is no better."""
RIDGE = 1e-13
"""Least weight of a step's length, relative to the squared derivatives: that the quadratic programs have one
solution must not be lost to rounding where fins are strong."""


@dataclass(frozen=True)
class SqpSettings(TimeLimitedSettings):
    """Settings of method `sqp`."""

    n_steps: int = number(30, 0, 10_000, "most steps per start on the error alone")
    n_starts: int = number(
        4, 1, 10_000, "starts per target beside the pseudo-inverse's: the middle of the limits, random ones"
    )
    regularization: float = number(
        1e-4, 0.0, 1e6, "weight of a step's length, as a share of the squared error at the iterate"
    )


class Sqp(ModelBased):
    """Sequential quadratic programming after the paper's, all targets of a layout stepped together.

    The paper's solves for the normalized error alone. Here steps first lower J, the squared error and the
    cost, which counts more at first, then the error alone: each minimizes
    `||r + J d||^2` plus a convex quadratic for the cost plus `regularization ||d||^2` within the limits, over
    commands as positions between their limits. Starts are the pseudo-inverse's answer, whose fins give their
    forces by the cheapest commands, the middle of the limits and random commands; of the ends that meet the
    target the cheapest one wins, else the smallest error.
    """

    name = "sqp"
    settings_class = SqpSettings
    settings: SqpSettings

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        first = self._inverse(plant).command(targets)  # a fin is compiled once, which no target pays for
        limit, cost = TimeLimit(self.settings.time_limit_s * len(targets)), self._cost(plant)
        others = [(plant.lower + plant.upper) / 2]
        others += [*plant.sample(np.random.default_rng(seed), (self.settings.n_starts - 1,))]
        starts = np.concatenate([first[:, None], np.tile(others, (len(targets), 1, 1, 1))], axis=1)
        many, n = len(others) + 1, plant.n_fins
        ends, error = self._from(
            plant, starts.reshape(-1, n, 3), np.repeat(targets, many, axis=0), cost, limit
        )
        met = (error <= SOLVED).reshape(-1, many)
        value = np.where(met, cost(ends).reshape(-1, many), np.inf)
        chosen = np.where(met.any(axis=1), value.argmin(axis=1), error.reshape(-1, many).argmin(axis=1))
        answer: Array = ends.reshape(-1, many, n, 3)[np.arange(len(targets)), chosen]
        return answer

    def _from(
        self, plant: Plant, start: Array, targets: Array, cost: CommandCost, limit: TimeLimit
    ) -> tuple[Array, Array]:
        """Where starts (B, n, 3) end for targets (B, 6), and the normalized errors (B,) there; as many rows
        together as fit the caches."""
        command = start.copy()
        for first in range(0, len(targets), CHUNK):
            rows = slice(first, first + CHUNK)
            for weight, n_steps in (*STAGES, (0.0, self.settings.n_steps)):
                j = _J(plant, targets[rows], self.normalization.std, cost, weight)
                command[rows] = self._descend(j, command[rows], n_steps, limit)
        return command, self.normalization.error(plant.wrench(command), targets)

    def _descend(self, j: "_J", start: Array, n_steps: int, limit: TimeLimit) -> Array:
        """Commands (B, n, 3) after at most so many steps that lower J."""
        command, value = start.copy(), j(start)
        busy = np.arange(len(command))
        least, exactness = (0.0, NEARLY) if j.weight else (SOLVED**2, EXACTLY)
        for _ in range(n_steps):
            busy = busy[value[busy] > least]
            if not len(busy) or limit.over:
                break
            hessian, gradient = j.model(command[busy], busy, self.settings.regularization)
            low, high = _room(j.plant, command[busy])
            step = solve_box_quadratics(hessian, gradient, low, high, exactness, lambda: limit.over)
            step = step.reshape(len(busy), -1, 3) * j.plant.width
            busy = busy[_search(j, command, value, busy, step)]
        return command


@dataclass(frozen=True, eq=False)
class _J:
    """What steps lower, for B targets."""

    plant: Plant
    """The robot."""
    targets: Array
    """Wrenches (B, 6)."""
    sigma: Array
    """Per-axis standard deviation (6,) of the error."""
    cost: CommandCost
    """Of the commands."""
    weight: float
    """Times that it counts beside the squared normalized error; 0 for that alone."""

    def __call__(self, command: Array, rows: NDArray[np.intp] | slice = slice(None)) -> Array:
        """J (R,) of commands (R, n, 3) for these rows of the targets."""
        residual = (self.plant.wrench(command) - self.targets[rows]) / self.sigma
        square: Array = (residual**2).sum(axis=-1)
        return square + self.weight * self.cost(command) if self.weight else square

    def model(self, command: Array, rows: NDArray[np.intp], regularization: float) -> tuple[Array, Array]:
        """Half the Hessian (R, 3 n, 3 n), made convex, and half the gradient (R, 3 n), by positions between
        the limits."""
        width, plant = self.plant.width, self.plant
        wrench, jacobian = plant.linearize(command)
        residual = (wrench - self.targets[rows]) / self.sigma
        slope = jacobian * width.ravel() / self.sigma[:, None]
        hessian = slope.transpose(0, 2, 1) @ slope
        each = np.arange(width.size)
        least = 1e-12 + RIDGE * np.einsum("bij,bij->b", slope, slope)
        hessian[:, each, each] += np.maximum(regularization * (residual**2).sum(axis=1), least)[:, None]
        gradient = np.einsum("bij,bi->bj", slope, residual)
        if self.weight:
            bowl = self.cost.bowl(command).in_units(width)
            gradient += self.weight * bowl.slope.reshape(gradient.shape)
            hessian[:, each, each] += self.weight * bowl.diagonal.reshape(gradient.shape)
            hessian[:, each[0::3], each[1::3]] += self.weight * bowl.mixed
            hessian[:, each[1::3], each[0::3]] += self.weight * bowl.mixed
        return hessian, gradient


def _room(plant: Plant, command: Array) -> tuple[Array, Array]:
    """How far each command may step (B, 3 n), as a share of its range; a free turn, half a turn."""
    safe = np.where(plant.width > 0, plant.width, 1.0)
    low, high = (plant.lower - command) / safe, (plant.upper - command) / safe
    low[:, plant.full_turn, 2], high[:, plant.full_turn, 2] = -0.5, 0.5
    shape = (len(command), -1)
    return np.minimum(low, 0.0).reshape(shape), np.maximum(high, 0.0).reshape(shape)


def _search(j: _J, command: Array, value: Array, rows: NDArray[np.intp], step: Array) -> NDArray[np.bool_]:
    """Halve each row's step until J falls; updates in place, says which rows (R,) moved."""
    moved = np.zeros(len(rows), dtype=bool)
    pending = np.arange(len(rows))
    length = 1.0
    for _ in range(8):
        trial = j.plant.feasible(command[rows[pending]] + length * step[pending])
        reached = j(trial, rows[pending])
        good = reached < value[rows[pending]] * (1 - LEAST_GAIN * length)
        done = rows[pending[good]]
        command[done], value[done] = trial[good], reached[good]
        moved[pending[good]] = True
        pending = pending[~good]
        if not len(pending):
            break
        length /= 2
    return moved
