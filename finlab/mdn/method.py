"""Method `mdn`: a mixture density network proposes ways to deliver a wrench, and each is searched to its end.

The paper's idea with exact physics behind it. The network gives a joint mixture over the planar forces of all
fins; its components stand for different ways. Each proposal is where a search in force space of its own
begins, with the fins' own laws, and so is each answer's name. What no component stands for is not found: that
is what the method is compared for. The answers are exact because of the search, not because of the network.
"""

from typing import ClassVar

import numpy as np

from finlab.allocation.evaluate import costs
from finlab.allocation.method import Takes
from finlab.allocation.search.prepared import Prepared
from finlab.allocation.search.search_method import Beginning, Search
from finlab.allocation.search.settings import MdnSettings
from finlab.allocation.settings import Settings
from finlab.allocation.solution import Candidates
from finlab.arrays import Array
from finlab.forces.force_space import polar, realize
from finlab.layout import Layout
from finlab.mdn.features import Seen, robot_view, see
from finlab.mdn.network import ForceMixture, ForceNetworkConfig
from finlab.mdn.proposal import Proposal, propose
from finlab.networks.trained import TrainedWeights


class Mdn(Search):
    """The search, started from what a network proposes and from nowhere else."""

    name = "mdn"
    takes: ClassVar[Takes] = "horizontal fins"
    settings_class = MdnSettings
    settings: MdnSettings
    weights: TrainedWeights

    def __init__(self, layout: Layout, settings: Settings, scale: Array, weights: TrainedWeights) -> None:
        self.config = weights.network_of(ForceNetworkConfig)
        super().__init__(layout, settings, scale, weights)
        self._network = weights.single_precision
        self._view = robot_view(self.prepared.planar, not self.objective.convex)

    def proposals(self, targets: Array, seed: int) -> Proposal:
        """The network's proposals for targets (N, 6)."""
        seen = see(self._view, targets / self.sigma)
        drawn = self.settings.n_candidates, self.settings.temperature, seed
        return propose(self.mixture(seen), self._view, seen, *drawn)

    def mixture(self, seen: Seen) -> ForceMixture:
        """What the network gives for what it sees of some targets."""
        return self.config(self._network, seen.nodes, seen.pairs)

    def _beginning(self, prepared: Prepared, targets: Array, seed: int) -> Beginning:
        proposal = self.proposals(targets, seed)
        names = tuple(f"component {k + 1}" for k in proposal.component[0].tolist())
        return Beginning(
            proposal.force,
            names,
            lambda: _samples(prepared, proposal.force[0], targets / self.sigma, names),
        )


def _samples(prepared: Prepared, force: Array, target: Array, names: tuple[str, ...]) -> Candidates:
    """Proposed forces (K, 2, n) [N] for a single target (1, 6), normalized, as the cheapest commands with
    them."""
    command, _ = realize(prepared.planar, polar(prepared.planar, force.swapaxes(1, 2)))
    command = prepared.commands.feasible(command)
    wrench = prepared.commands.wrench(command)
    error = np.linalg.norm(wrench - target, axis=-1)
    layout = prepared.plant.layout
    return Candidates(command, prepared.plant.wrench(command), error, *costs(layout, command), names)
