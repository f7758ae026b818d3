"""What the methods that know the fin model share: limits, starts, the objective by which starts compete."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.allocation.solution import Solution
from finlab.inference.normalization import Normalization
from finlab.layout import Layout
from finlab.physics import Plant, plant_of
from finlab.physics.energy import command_energy

Array = NDArray[np.float64]

ENERGY_TRADEOFF = 1e-4
"""Weight of the energy proxy beside the squared normalized error where a method weighs the two."""
CACHE_SIZE = 64
"""Layouts whose prepared quantities a method keeps; a control loop asks for the same one again and again."""


class ModelBased(Allocator):
    """A method that optimizes over the layout's own analytic fin models, the ones that score every method.

    Args:
        normalization: the yardstick of the error; nothing else is taken from a checkpoint.
    """

    def __init__(self, normalization: Normalization) -> None:
        self.normalization = normalization
        self._plant = plant_of

    @abstractmethod
    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        """Commands (N, n, 3) for targets (N, 6).

        Random starts are drawn once and shared by all targets, so that a target gets the same answer alone
        and among others.
        """

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        plant = self._plant(layout)
        command = self._commands(plant, targets, seed)
        return Solution(plant.feasible(command))

    def _objective(self, plant: Plant, command: Array, target: Array) -> Array:
        """`J = err_norm^2 + ENERGY_TRADEOFF * J_en` of commands (..., n, 3)."""
        error = self.normalization.error(plant.wrench(command), target)
        return error**2 + ENERGY_TRADEOFF * command_energy(command, plant.upper)
