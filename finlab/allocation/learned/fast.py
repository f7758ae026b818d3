"""The fast path: a distilled network gives each fin's share of thrust, one closed-form step the rest.

No sampling and no search: the network's shares of thrust weigh the fins, the weighted pseudo-inverse gives
the planar forces that add up to the target, one reweighting sharpens which fins rest, and the thrust curves
turn forces into commands. Where that misses the target, because limits bind or arcs stand in the way, the
full pipeline answers instead.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.allocation.learned.refined_candidates import FallbackForces, nearest_forces
from finlab.allocation.solution import Solution
from finlab.errors import AllocationError
from finlab.forces import force_space
from finlab.inference.fast_network import NumpyFastNetwork
from finlab.inference.features import fin_frame_features
from finlab.inference.weights import TrainedWeights
from finlab.layout import Layout
from finlab.physics.energy import DEFAULT_WEIGHTS

Array = NDArray[Any]

REWEIGHTING_STEPS = 1
"""Steps of the search in force space after the network."""
ACCEPTED_ERROR = 2e-3
"""Normalized error, by the learned thrust curves, up to which the fast answer is taken: a fifth
of what counts as delivered."""


class FastAllocator(LearnedAllocator):
    """Method `fast`: the distilled network first, the full pipeline where it must."""

    name = "fast"

    def __init__(self, weights: TrainedWeights, **settings: Any) -> None:
        """Make it from weights that hold a distilled network; settings are those of the full pipeline.

        Raises:
            AllocationError: there is no distilled network.
        """
        super().__init__(weights, **settings)
        if self.weights.fast is None:
            raise AllocationError(
                f"checkpoint {self.checkpoint!r} has no distilled network; train one with `finlab train fast`"
            )
        self.network = NumpyFastNetwork(self.weights.fast)
        std = self.normalization.std
        self._scaled_mean = self.normalization.mean / std

    def _solve(
        self,
        layout: Layout,
        targets: Array,
        *,
        seed: int,
        previous: Array | None,
        fallback: FallbackForces = nearest_forces,
    ) -> Solution:
        # Slow turns from tick to tick are a search of their own; the network learned exact answers, cheap by
        # the usual energy.
        usual = self.energy_weights == DEFAULT_WEIGHTS and self.settings.energy_tradeoff == 0.0
        if previous is not None or not usual:
            return super()._solve(layout, targets, seed=seed, previous=previous, fallback=fallback)
        prepared = self.pipeline.prepare(layout)
        target = targets / self.normalization.std
        x = fin_frame_features(prepared.geometry, target - self._scaled_mean).astype(np.float32)
        share = self.network(x).astype(np.float64)
        share *= share
        thrust = share * share * prepared.planar.curves.maximum
        planar = force_space.descend(prepared.planar, target, thrust, REWEIGHTING_STEPS)
        missed = np.einsum("ri,ri->r", planar.residual, planar.residual) > ACCEPTED_ERROR**2
        if missed.all():
            return super()._solve(layout, targets, seed=seed, previous=None, fallback=fallback)
        command, _ = force_space.realize(prepared.planar, planar)
        # Fins that turn fully may have their arc anywhere, such as from 0 to a whole turn.
        prepared.commands.clamp_in_place(command)
        wrench = targets - planar.residual * self.normalization.std
        if missed.any():
            slow = super()._solve(layout, targets[missed], seed=seed, previous=None, fallback=fallback)
            assert slow.wrench_surrogate is not None
            command[missed], wrench[missed] = slow.command, slow.wrench_surrogate
        return Solution(command, wrench)
