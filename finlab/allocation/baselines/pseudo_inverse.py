"""The pseudo-inverse in force space, each fin's force turned into its cheapest command."""

import numpy as np

from finlab.actuators.fin.response import FinGroup, largest_forces
from finlab.arrays import Array
from finlab.layout import layout_effectiveness
from finlab.layout.angles import wrapped
from finlab.physics import Plant

RCOND = 1e-3
"""Singular values below this share of the largest count as zero."""


class PseudoInverse:
    """Everything about one layout that does not depend on the target.

    Args:
        plant: the robot.
        sigma: scales the rows (6,).
        copper_loss: heat of a motor that counts as power [W/(N m)^2].
        rcond: see `RCOND`.
    """

    def __init__(self, plant: Plant, sigma: Array, copper_loss: float = 0.0, rcond: float = RCOND) -> None:
        self.plant = plant
        self.fins = FinGroup(plant.layout.fins, plant.effectiveness, copper_loss)
        """What the fins can do, and by which commands."""
        self.effectiveness = layout_effectiveness(plant.layout)
        """Wrench (6, 2 n) per newton of each fin's horizontal and vertical force."""
        planes = self.fins.planes
        self._middle, self._half = (np.array([getattr(p, k) for p in planes]) for k in ("middle", "half"))
        most = np.repeat(np.maximum(largest_forces(plant.layout), 1e-9), 2)
        scaled = self.effectiveness * most / sigma[:, None]
        self.inverse = (most[:, None] * np.linalg.pinv(scaled, rcond=rcond) / sigma).T.copy()
        """Target (6,) times this (6, 2 n) gives each fin's horizontal and vertical force [N]."""

    def command(self, targets: Array) -> Array:
        """Commands (N, n, 3) for targets (N, 6)."""
        return self.decoded(self.force(targets))

    def force(self, targets: Array) -> Array:
        """Planar forces (N, n, 2) [N] for targets (N, 6), whatever the limits."""
        return (targets @ self.inverse).reshape(len(targets), self.plant.n_fins, 2)

    def decoded(self, force: Array) -> Array:
        """The cheapest commands (N, n, 3) for planar forces (N, n, 2) [N], by the fins' own laws; what a fin
        cannot give is cut off."""
        angle = wrapped(np.arctan2(force[..., 1], force[..., 0]) - self._middle)
        held = np.clip(angle, -self._half, self._half)
        excess = np.minimum(np.abs(angle - held), 0.5 * np.pi)
        size = np.hypot(force[..., 0], force[..., 1]) * np.cos(excess)
        angle = self._middle + held
        inside = size[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return self.plant.feasible(self.fins.commands(inside))
