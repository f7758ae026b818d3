"""Base of the methods that know the laws: starts, and the objective by which they compete."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from finlab.allocation.baselines.pseudo_inverse import PseudoInverse
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.method import LeastErrorMethod
from finlab.allocation.settings import Settings, number
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.physics.objective import Name, cost_meter

SOLVED = 1e-5
"""Normalized error up to which an answer is exact."""
LIMIT = "processor time per target after which the best command so far is the answer"
USUAL_SHARE = 0.1
"""What a robot is mostly asked for, as a share of its yardstick."""


class ModelBased(LeastErrorMethod):
    """A method that optimizes over the actuators' own laws and tables, those that score every method."""

    settings_class: ClassVar[type[Settings]] = Settings

    def prepare(self) -> None:
        self.aim: Name = getattr(self.settings, "objective", "power")
        """What is kept least."""
        if self.aim == "effort":
            self.layout.only("objective 'effort'")
        self.sigma = USUAL_SHARE * self.scale
        """What wrenches (6,) are divided by: what a robot is mostly asked for."""

    @cached_property
    def _inverse(self) -> PseudoInverse:
        """What answers by the pseudo-inverse, and where others start."""
        return PseudoInverse(self.plant, self.sigma)

    @abstractmethod
    def _commands(self, targets: Array, seed: int) -> Array:
        """Commands (N, n, 3) for targets (N, 6). Random starts are drawn once and shared by all targets, so
        that a target gets the same answer alone and among others."""

    def _best(self, target: Array, commands: Array, steps: int) -> Array:
        """Of commands (S, n, 3), each brought onto a target (6,) by some Levenberg-Marquardt steps, the
        cheapest one (n, 3) that meets it, else the one with the smallest error."""
        problem = CommandProblem.of(self.plant, self.sigma)
        ends = refine(problem, target[None] / self.sigma, commands, steps)
        missed = ends.error > SOLVED
        cost = np.where(missed, ends.error, cost_meter(self.aim, self.plant)(ends.command))
        return np.array(ends.command[np.lexsort((cost, missed))[0]])

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        return Solution(self.plant.feasible(self._commands(targets, seed)))


@dataclass(frozen=True)
class TimeLimitedSettings(Settings):
    """Settings of a slow method, which ends in time."""

    time_limit_s: float = number(0.6, 0.0, 3600.0, LIMIT, "s", above=True)
