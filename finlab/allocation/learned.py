"""The learned allocator: the network proposes, the surrogate ranks, a search finds the cheapest exact command.

Predict (mixture of the network) -> sample K candidates -> rank by the surrogate's error and energy ->
drive the best ones, and a few sub-layouts, to the nearest cheap exact allocation in force space ->
Levenberg-Marquardt on the commands. Only the learned surrogate is seen on the way; the analytic fin
model scores the answer afterwards.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from finlab.allocation import force_space
from finlab.allocation.allocation import Candidates, Solution
from finlab.allocation.allocator import Allocator
from finlab.allocation.energy import command_energy
from finlab.allocation.learned_fin import LearnedFin
from finlab.allocation.levenberg_marquardt import refine
from finlab.allocation.numpy_network import NumpyNetwork
from finlab.allocation.prepared import Prepared, prepare
from finlab.allocation.proposal import Proposal, propose
from finlab.errors import CheckpointError
from finlab.layout import Layout
from finlab.model.checkpoint import Checkpoint
from finlab.model.surrogate import FORCE_UNIT, CoefficientSurrogate

Array = NDArray[np.float64]

CHUNK = 256
"""Targets that are solved together; keeps memory flat for any number of targets."""
TOLERANCE = 2e-4
"""Normalized error (by the surrogate) below which an answer counts as exact and energy decides."""


class LearnedAllocator(Allocator):
    """The product's default method."""

    name = "learned"

    def __init__(
        self,
        checkpoint: Checkpoint,
        *,
        n_candidates: int = 64,
        temperature: float = 0.02,
        gamma: float = 1e-2,
        n_seeds: int = 8,
        n_refined: int = 6,
        search_steps: int = 6,
        refine_steps: int = 3,
        subsets: bool = True,
    ) -> None:
        """Make it from a checkpoint.

        Args:
            checkpoint: trained networks; the surrogate must be of kind `coefficient`.
            n_candidates: number K of candidates drawn from the mixture.
            temperature: T of the sampling; 0.02 in the paper.
            gamma: weight of the energy in the ranking J = J_norm + gamma J_en.
            n_seeds: candidates that enter the search.
            n_refined: allocations that are refined and offered as candidates.
            search_steps: reweighting steps of the search in force space.
            refine_steps: Levenberg-Marquardt steps.
            subsets: whether sub-layouts are searched as well.
        """
        if not isinstance(checkpoint.surrogate, CoefficientSurrogate):
            raise CheckpointError(
                f"checkpoint {checkpoint.name!r}: method `learned` needs a surrogate of kind `coefficient`, "
                f"got {checkpoint.surrogate.config.kind!r}; use method `paper` with this checkpoint"
            )
        if checkpoint.network is None or not checkpoint.network.config.joint:
            raise CheckpointError(f"checkpoint {checkpoint.name!r}: method `learned` needs a joint-mixture network")
        self.checkpoint = checkpoint.name
        self.trained = checkpoint
        self.normalization = checkpoint.normalization
        network = {key: value.numpy() for key, value in checkpoint.network.state_dict().items()}
        sizes = checkpoint.network.config
        self.network = NumpyNetwork(network, sizes.heads, sizes.n_components)
        self.n_candidates, self.temperature, self.gamma = n_candidates, temperature, gamma
        self.n_seeds, self.n_refined = n_seeds, n_refined
        self.search_steps, self.refine_steps = search_steps, refine_steps
        self.subsets = subsets
        state = {k: v.numpy() for k, v in checkpoint.surrogate.state_dict().items()}
        fin = LearnedFin(state, CoefficientSurrogate.REFERENCE, FORCE_UNIT)
        std = self.normalization.std
        self.prepare = lru_cache(maxsize=128)(lambda layout: prepare(layout, fin, std))

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        prepared = self.prepare(layout)
        parts = [
            self._solve_chunk(prepared, targets[i : i + CHUNK], seed + i, len(targets) == 1)
            for i in range(0, len(targets), CHUNK)
        ]
        if len(parts) == 1:
            return parts[0]
        wrench = [part.wrench_surrogate for part in parts if part.wrench_surrogate is not None]
        return Solution(np.concatenate([part.command for part in parts]), np.concatenate(wrench))

    def _solve_chunk(self, prepared: Prepared, targets: Array, seed: int, keep: bool) -> Solution:
        rows = len(targets)
        target = targets / self.normalization.std
        centred = target - self.normalization.mean / self.normalization.std
        proposal = propose(self.network, prepared, centred, target, self.n_candidates, self.temperature, seed)
        score = proposal.error**2 + self.gamma * command_energy(proposal.command, prepared.upper)
        chosen = _best_of_each_component(proposal, score, self.n_seeds)
        seeds = np.take_along_axis(proposal.thrust, chosen[..., None], axis=1)
        if self.subsets:
            shared = np.broadcast_to(prepared.subsets, (rows, *prepared.subsets.shape))
            seeds = np.concatenate([seeds, shared], axis=1)
        command = self._search(prepared, target, seeds)
        command, error, energy = self._refine(prepared, target, command)
        missed = error.min(1) > TOLERANCE
        if missed.any():
            command[missed], error[missed], energy[missed] = self._insist(
                prepared, target[missed], proposal.command[missed], command[missed]
            )
        order = np.lexsort((energy, np.where(error > TOLERANCE, error, 0.0)), axis=-1)
        command = np.take_along_axis(command, order[..., None, None], axis=1)
        best = np.ascontiguousarray(command[:, 0])
        wrench = prepared.commands.wrench(best) * self.normalization.std
        if not keep:
            return Solution(best, wrench)
        return Solution(best, wrench, self._candidates(prepared, target, command[0]), self._samples(prepared, proposal))

    def _search(self, prepared: Prepared, target: Array, thrust: Array) -> Array:
        """Cheapest commands (N, n_refined, n, 3) reached from thrust seeds (N, S, n)."""
        rows, n_seeds, n = thrust.shape
        planar = force_space.descend(
            prepared.planar, np.repeat(target, n_seeds, axis=0), thrust.reshape(-1, n), self.search_steps
        )
        error = (planar.residual**2).sum(-1)
        score = (error * 100.0 + self.gamma * force_space.energy(prepared.planar, planar)).reshape(rows, n_seeds)
        kept = np.argsort(score, axis=1)[:, : self.n_refined] + np.arange(rows)[:, None] * n_seeds
        kept = kept.ravel()
        best = force_space.Planar(planar.thrust[kept], planar.direction[kept], planar.residual[kept])
        return force_space.commands(prepared.planar, best).reshape(rows, -1, n, 3)

    def _refine(
        self, prepared: Prepared, target: Array, command: Array, steps: int | None = None
    ) -> tuple[Array, Array, Array]:
        """Refined commands (N, P, n, 3), their normalized errors (N, P) by the surrogate and energies (N, P)."""
        rows, p, n, _ = command.shape
        repeated = np.repeat(target, p, axis=0)
        flat = refine(prepared.commands, repeated, command.reshape(-1, n, 3), steps or self.refine_steps)
        error = np.linalg.norm(repeated - prepared.commands.wrench(flat), axis=-1)
        energy = command_energy(flat, prepared.upper)
        return flat.reshape(rows, p, n, 3), error.reshape(rows, p), energy.reshape(rows, p)

    def _insist(
        self, prepared: Prepared, target: Array, proposed: Array, command: Array
    ) -> tuple[Array, Array, Array]:
        """More steps from more seeds, for the few targets that the quick way did not reach."""
        more = np.concatenate([command, proposed[:, :32]], axis=1)
        more, error, energy = self._refine(prepared, target, prepared.commands.clamp(more), 25)
        best = np.lexsort((energy, np.where(error > TOLERANCE, error, 0.0)), axis=-1)[:, : command.shape[1]]
        take = np.take_along_axis
        return take(more, best[..., None, None], axis=1), take(error, best, axis=1), take(energy, best, axis=1)

    def _candidates(self, prepared: Prepared, target: Array, command: Array) -> Candidates:
        wrench = prepared.commands.wrench(command)
        error = np.linalg.norm(wrench - target, axis=-1)
        names = ("refined",) * len(command)
        energy = command_energy(command, prepared.upper)
        return Candidates(command, wrench * self.normalization.std, error, energy, names)

    def _samples(self, prepared: Prepared, proposal: Proposal) -> Candidates:
        order = np.argsort(proposal.error[0])
        names = tuple(f"mode {k + 1}" for k in proposal.component[0][order])
        command = proposal.command[0][order]
        energy = command_energy(command, prepared.upper)
        wrench = proposal.wrench[0][order] * self.normalization.std
        return Candidates(command, wrench, proposal.error[0][order], energy, names)


def _best_of_each_component(proposal: Proposal, score: Array, n_seeds: int) -> NDArray[np.int64]:
    """Indices (N, n_seeds) of the best candidates, at most one from each mixture component.

    At low temperature the samples of one component lie close together and would all descend to the
    same allocation.
    """
    rows = np.arange(len(score))[:, None]
    worst_first = np.argsort(-score, axis=1)
    n_components = int(proposal.component.max()) + 1
    best = np.zeros((len(score), n_components), dtype=np.int64)
    # Later assignments win, so the best candidate of each component is what stays.
    best[rows, proposal.component[rows, worst_first]] = worst_first
    order = np.argsort(score[rows, best], axis=1)[:, :n_seeds]
    return best[rows, order]
