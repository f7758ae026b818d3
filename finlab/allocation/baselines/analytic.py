"""Method `analytic`: force-space pseudo-inverse, each fin's force law inverted, clipped to the limits."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.baselines.model_based import CACHE_SIZE, ModelBased
from finlab.inference.normalization import Normalization
from finlab.physics import Plant

Array = NDArray[np.float64]

TABLE_SIZE = 2049
"""Points of the inverted force law; interpolating sqrt(T) over them is exact to about 1e-7."""


class ForceInverse:
    """Everything about one layout that does not depend on the target."""

    def __init__(self, plant: Plant, sigma: Array, rcond: float) -> None:
        self.plant = plant
        lower, upper = plant.lower, plant.upper
        share = np.linspace(0.0, 1.0, TABLE_SIZE)[:, None]
        self.share = share[:, 0]
        thrust = plant.thrust(
            np.maximum(share * upper[:, 0], lower[:, 0]), np.maximum(share * upper[:, 1], lower[:, 1])
        )
        # A table of measured forces may dip; the inverse needs a rising curve.
        self.root_thrust = np.maximum.accumulate(np.sqrt(np.maximum(thrust, 0.0)), axis=0).T.copy()
        most = np.repeat(np.maximum(thrust[-1], 1e-9), 2)
        planar = plant.planar
        scaled = planar * most / sigma[:, None]
        self.inverse = (most[:, None] * np.linalg.pinv(scaled, rcond=rcond) / sigma).T.copy()
        """Target (6,) times this (6, 2 n) gives each fin's horizontal and vertical force [N]."""
        self.middle = (lower[:, 2] + upper[:, 2]) / 2
        self.half_arc = (upper[:, 2] - lower[:, 2]) / 2

    def command(self, targets: Array) -> Array:
        """Commands (N, n, 3) for targets (N, 6)."""
        force = (targets @ self.inverse).reshape(len(targets), self.plant.n_fins, 2)
        horizontal, vertical = force[..., 0], force[..., 1]
        thrust = np.hypot(horizontal, vertical)
        direction = np.arctan2(vertical, horizontal)
        if not self.plant.full_turn.all():
            thrust, direction = self._into_arc(thrust, direction)
        root = np.sqrt(thrust)
        share = np.empty_like(root)
        for i, curve in enumerate(self.root_thrust):
            share[:, i] = np.interp(root[:, i], curve, self.share)
        return np.stack([share * self.plant.upper[:, 0], share * self.plant.upper[:, 1], direction], axis=-1)

    def _into_arc(self, thrust: Array, direction: Array) -> tuple[Array, Array]:
        """The nearest allowed direction, and of the thrust what points there."""
        offset = (direction - self.middle + np.pi) % (2 * np.pi) - np.pi
        allowed = np.clip(offset, -self.half_arc, self.half_arc)
        return thrust * np.maximum(np.cos(offset - allowed), 0.0), self.middle + allowed


class Analytic(ModelBased):
    """Pseudo-inverse of the planar forces; failed fins have left with their two columns.

    Rows are scaled by sigma and columns by each fin's largest thrust. A fin reaches its thrust with amplitude
    and frequency at the same share of their upper limits, close to the cheapest split. What does not fit is
    clipped fin by fin, the rest is not redistributed. A table's thrust is taken at zero direction zero.

    Args:
        normalization: sigma scales the rows.
        rcond: singular values below this share of the largest count as zero.
    """

    name = "analytic"

    def __init__(self, normalization: Normalization, *, rcond: float = 1e-3) -> None:
        super().__init__(normalization)
        self.rcond = rcond
        self._inverse = lru_cache(CACHE_SIZE)(self._prepare)

    def _commands(self, plant: Plant, targets: Array, seed: int) -> Array:
        return self._inverse(plant).command(targets)

    def _prepare(self, plant: Plant) -> ForceInverse:
        return ForceInverse(plant, self.normalization.std, self.rcond)
