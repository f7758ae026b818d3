"""Method `sqp`: sequential quadratic programming by SciPy, the least cost under the wrench as
constraint."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from time import thread_time
from typing import Any

import numpy as np
from scipy.optimize import minimize

from finlab.allocation.baselines.pseudo_inverse import ModelBased, TimeLimitedSettings, pushed_axes
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.method import choice, number
from finlab.arrays import Array
from finlab.layout import layout_effectiveness
from finlab.physics import Plant
from finlab.physics.objective import CostMeter, Name, cost_meter

NEAR = 1e-3
"""Normalized error from which on a start is no way to the target: its cost does not matter."""
APPROACH = 30
"""Levenberg-Marquardt steps from a start onto the target."""
POLISH = 2
"""Levenberg-Marquardt steps after the last quadratic program."""
SETTLED = 1e-8
"""Change of the cost, as a share of a usual one, at which the programs end."""

Solve = Callable[[Array, Array], Array]
"""From a normalized target (6,) and a start (n, 3) to the command (n, 3) where the solver ends."""


@dataclass(frozen=True)
class SqpSettings(TimeLimitedSettings):
    """Settings of method `sqp`."""

    objective: Name = choice(
        "power", ("power", "effort"), "kept least: watts, or the paper's effort"
    )
    n_steps: int = number(100, 1, 10_000, "most quadratic programs per start")
    n_starts: int = number(
        2,
        1,
        10_000,
        "starts per target beside the pseudo-inverse's: the middle of the limits, random ones",
    )


class Sqp(ModelBased):
    """Sequential quadratic programming, as the paper's; but the paper's keeps the normalized error
    least.

    Starts are brought onto the target, or as near as they come; from those that reach it the cost
    falls along it. The cheapest end that meets the target is the answer, else the one with the
    smallest error.
    """

    name = "sqp"
    settings_class = SqpSettings
    settings: SqpSettings

    @cached_property
    def _program(self) -> tuple[CommandProblem, Solve]:
        """What brings starts onto a target, and what makes them cheap there."""
        meter = cost_meter(self.objective, self.plant)
        solve = cheapest_program(self.plant, meter, self.asked_scale, self.settings.n_steps)
        return CommandProblem.of(self.plant, self.asked_scale), solve

    def _commands(self, targets: Array, seed: int) -> Array:
        """Solves for one target after the other."""
        problem, solve = self._program
        plant = self.plant
        answer = self._inverse.command(targets)
        random = plant.sample(np.random.default_rng(seed), (self.settings.n_starts - 1,))
        for i, target in enumerate(targets / self.asked_scale):
            over = thread_time() + self.settings.time_limit_s
            starts = np.array([answer[i], (plant.lower + plant.upper) / 2, *random])
            near = refine(problem, target[None], starts, APPROACH)
            tried = [*near.command]
            for start in near.command[near.error <= NEAR]:
                if thread_time() <= over:
                    tried.append(solve(target, start))
            answer[i] = self._best(targets[i], np.array(tried), POLISH)
        return answer


def cheapest_program(plant: Plant, meter: CostMeter, error_scale: Array, steps: int) -> Solve:
    """Makes what finds the commands of least cost that deliver a target, by SciPy's SLSQP.

    Args:
        plant: of the robot.
        meter: of the cost.
        error_scale: what wrenches (6,) are divided by [N, N m].
        steps: most quadratic programs from a start.

    Returns:
        A function of a normalized target (6,) and a start (n, 3), that returns the command (n, 3)
        where SLSQP ends.
    """
    axes = pushed_axes(layout_effectiveness(plant.layout) / error_scale[:, None])
    width = plant.width
    has_range = width.ravel() > 0.0
    usual = max(float(meter(plant.sample(np.random.default_rng(0), (16,))).mean()), 1e-300)

    def command_at(x: Array) -> Array:
        share = np.zeros(has_range.size)
        share[has_range] = x
        return np.asarray(plant.lower + share.reshape(-1, 3) * width)

    def cost(x: Array) -> float:
        return float(meter(command_at(x)[None])[0]) / usual

    def cost_gradient(x: Array) -> Array:
        return (
            np.asarray((meter.gradient(command_at(x)[None])[0] * width).ravel()[has_range]) / usual
        )

    def solve(target: Array, start: Array) -> Array:
        def missing(x: Array) -> Array:
            return np.asarray(axes @ (plant.wrench(command_at(x)) / error_scale - target))

        def gradient(x: Array) -> Array:
            _, jacobian = plant.linearize(command_at(x))
            return np.asarray(
                axes @ (jacobian / error_scale[:, None] * width.ravel())[:, has_range]
            )

        if not has_range.any():
            return start
        first = ((start - plant.lower) / np.where(width > 0.0, width, 1.0)).ravel()[has_range]
        exactly: Any = {"type": "eq", "fun": missing, "jac": gradient}
        how: dict[str, Any] = {"method": "SLSQP", "options": {"maxiter": steps, "ftol": SETTLED}}
        limits = [(0.0, 1.0)] * len(first)
        end = minimize(cost, first, jac=cost_gradient, bounds=limits, constraints=exactly, **how).x
        return command_at(np.clip(end, 0.0, 1.0)) if np.isfinite(end).all() else start

    return solve
