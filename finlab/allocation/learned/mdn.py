"""Method `mdn`: a mixture density network proposes, and each proposal is searched and refined.

The paper's idea with exact physics behind it: the components of the mixture stand for ways to deliver a
wrench; the best candidate of each starts a search of its own, and the fins' own laws rank and refine.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.judging import costs
from finlab.allocation.learned.proposal import Proposal, predict, propose
from finlab.allocation.learned.settings import MdnSettings
from finlab.allocation.search.prepared import Prepared
from finlab.allocation.search.refined_candidates import FallbackForces, RefinedCandidates, nearest_forces
from finlab.allocation.search.search_allocator import CHUNK, SearchAllocator
from finlab.allocation.solution import Candidates, Insight, Solution
from finlab.errors import CheckpointError
from finlab.inference.features import Geometry, fin_frame_features, geometry
from finlab.inference.network import NumpyNetwork
from finlab.inference.weights import TrainedWeights
from finlab.layout import Layout

Array = NDArray[Any]


class MdnAllocator(SearchAllocator):
    """The search, started from what a network proposes and from nowhere else."""

    name = "mdn"
    settings_class = MdnSettings
    settings: MdnSettings
    weights: TrainedWeights

    def __init__(self, weights: TrainedWeights, **options: Any) -> None:
        """Make it from the weights of a checkpoint.

        Args:
            weights: trained weights.
            options: objective and its numbers as for `SearchAllocator`, and fields of `MdnSettings`.

        Raises:
            AllocationError: settings that leave nothing to answer with.
            CheckpointError: the checkpoint's network is of another kind.
        """
        sizes = weights.check_network()
        if not sizes.joint:
            raise CheckpointError(f"checkpoint {weights.name!r}: method `mdn` needs a joint-mixture network")
        super().__init__(weights.normalization, **options)
        self.weights, self.checkpoint = weights, weights.name
        self.network = NumpyNetwork(weights.network, sizes.heads, sizes.n_components)
        self._geometry = lru_cache(maxsize=128)(self._place)

    def _place(self, layout: Layout) -> Geometry:
        place = layout.position[None], layout.mounting_angle[None], layout.lower[None], layout.upper[None]
        return geometry(*place, self.normalization.std)

    def _propose(self, prepared: Prepared, targets: Array, seed: int) -> Proposal:
        """The network's raw candidates for targets (N, 6)."""
        std = self.normalization.std
        target = targets / std
        centred = target - self.normalization.mean / std
        mixture = predict(self.network, self._geometry(prepared.plant.layout), prepared, centred)
        drawn = self.settings.n_candidates, self.settings.temperature, seed
        return propose(mixture, prepared, target, drawn)

    def _seeds(self, proposal: Proposal) -> tuple[Array, NDArray[np.int64]]:
        """Sizes of forces (N, S, n) of the best candidate of each component, and their components (N, S)."""
        score = proposal.error * proposal.error + self.settings.gamma * proposal.cost
        chosen = best_of_each_component(proposal.component, score, self.settings.n_seeds)
        n = proposal.size.shape[-1]
        return proposal.size.reshape(-1, n).take(chosen, axis=0), proposal.component.reshape(-1).take(chosen)

    def _solve(
        self,
        layout: Layout,
        targets: Array,
        *,
        seed: int,
        previous: Array | None,
        fallback: FallbackForces = nearest_forces,
    ) -> Solution:
        prepared = self.pipeline.prepare(layout)
        if len(targets) > 1:

            def solve(start: int) -> RefinedCandidates:
                some = targets[start : start + CHUNK]
                seeds, _ = self._seeds(self._propose(prepared, some, seed + start))
                return self.pipeline.solve(prepared, some, seeds=seeds, fallback=fallback)

            return self._many(solve, len(targets))
        with self._one_thread():
            proposal = self._propose(prepared, targets, seed)
            seeds, component = self._seeds(proposal)
            refined = self.pipeline.solve(prepared, targets, previous, seeds=seeds, fallback=fallback)
        std = self.normalization.std
        names = tuple(f"component {k + 1}" for k in component[0].tolist())
        return self._single(prepared, targets, refined, names)._replace(
            samples=lambda: _samples(proposal, std, layout)
        )

    def insight(self, layout: Layout, wrench: ArrayLike) -> Insight:
        """What the network makes of a target (6,) [N, N m] for a layout whose fins all work."""
        prepared, place = self.pipeline.prepare(layout), self._geometry(layout)
        centred = (np.asarray(wrench, dtype=float)[None] - self.normalization.mean) / self.normalization.std
        mixture = predict(self.network, place, prepared, centred)
        features = fin_frame_features(place, centred).astype(np.float32)
        arrays = (mixture.weight, mixture.mean, mixture.std, self.network.attention(features))
        return Insight(*(np.asarray(values[0], dtype=float) for values in arrays))


def best_of_each_component(component: NDArray[np.int64], score: Array, n_seeds: int) -> NDArray[np.int64]:
    """The best candidates (N, n_seeds) of N rows of K, at most one from each mixture component; counted
    through all rows.

    At low temperature the samples of one component lie close together and would all descend to the
    same allocation.
    """
    rows, k = score.shape
    m = int(component.max()) + 1
    place = np.arange(rows)[:, None]
    worst_first = (-score).argsort(axis=1)
    worst_first += place * k
    best = np.zeros(rows * m, dtype=np.int64)
    # Later assignments win, so the best candidate of each component is what stays.
    best[component.take(worst_first) + place * m] = worst_first
    order = score.take(best.reshape(rows, m)).argsort(axis=1)[:, :n_seeds]
    order += place * m
    return best.take(order)


def _samples(proposal: Proposal, std: Array, layout: Layout) -> Candidates:
    """The raw candidates for a single target."""
    order = proposal.error[0].argsort()
    command, component, wrench, error, _, _ = (values[0].take(order, axis=0) for values in proposal)
    names = tuple(f"component {k + 1}" for k in component.tolist())
    return Candidates(command, wrench * std, error, *costs(layout, command), names)
