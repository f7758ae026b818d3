"""The learned allocator: the network proposes, the surrogate ranks, a search finds the cheapest answer.

Predict (mixture of the network) -> sample K candidates -> rank by the surrogate's error and energy ->
drive the best ones, and a few sub-layouts, to the nearest cheap exact allocation in force space ->
Levenberg-Marquardt on the commands. Only the learned surrogate is seen on the way; the analytic fin
model scores the answer afterwards.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

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

Array = NDArray[Any]

CHUNK = 256
"""Targets that are solved together; keeps memory flat for any number of targets."""
TOLERANCE = 2e-4
"""Normalized error (by the surrogate) below which an answer counts as exact and energy decides."""
PATIENCE = ((5, 0), (25, 32))
"""For the few targets that the quick way did not reach: Levenberg-Marquardt steps, and how many of the
network's raw candidates join, in stages."""


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
        n_seeds: int = 6,
        n_refined: int = 6,
        search_steps: int = 4,
        refine_steps: int = 1,
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
            raise CheckpointError(
                f"checkpoint {checkpoint.name!r}: method `learned` needs a joint-mixture network"
            )
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
        std = self.normalization.std
        target = targets / std
        centred = target - self.normalization.mean / std
        proposal = propose(self.network, prepared, centred, target, self.n_candidates, self.temperature, seed)
        command = self._search(prepared, target, self._seeds(prepared, proposal))
        pool = self._refine(prepared, target, command, self.refine_steps)
        for steps, extra in PATIENCE:
            missed = pool.error[:, 0] > TOLERANCE
            if not missed.any():
                break
            more = np.concatenate(
                [pool.command[missed], proposal.command[missed, :extra].astype(np.float64)], axis=1
            )
            longer = self._refine(prepared, target[missed], more, steps)
            for kept, new in zip(pool, longer, strict=True):
                kept[missed] = new[:, : kept.shape[1]]
        best = pool.command[:, 0]
        wrench = pool.wrench[:, 0] * std
        if not keep:
            return Solution(best, wrench)
        return Solution(
            best, wrench, lambda: _candidates(pool, std), lambda: _samples(proposal, prepared, std)
        )

    def _seeds(self, prepared: Prepared, proposal: Proposal) -> Array:
        """Thrust seeds (N, S, n): the best candidate of each component, and sub-layouts."""
        score = proposal.error * proposal.error + self.gamma * proposal.energy
        chosen = _best_of_each_component(proposal.component, score, self.n_seeds)
        seeds = proposal.thrust[np.arange(len(score))[:, None], chosen].astype(np.float64)
        if not self.subsets:
            return seeds
        shared = np.broadcast_to(prepared.subsets, (len(score), *prepared.subsets.shape))
        return np.concatenate([seeds, shared], axis=1)

    def _search(self, prepared: Prepared, target: Array, thrust: Array) -> Array:
        """Cheapest commands (N, n_refined, n, 3) reached from thrust seeds (N, S, n)."""
        rows, n_seeds, n = thrust.shape
        flat = np.repeat(target, n_seeds, axis=0)
        planar = force_space.descend(prepared.planar, flat, thrust.reshape(-1, n), self.search_steps)
        command, energy = force_space.realize(prepared.planar, planar)
        error = np.einsum("ri,ri->r", planar.residual, planar.residual)
        score = (100.0 * error + self.gamma * energy).reshape(rows, n_seeds)
        kept = np.argsort(score, axis=1)[:, : self.n_refined] + np.arange(rows)[:, None] * n_seeds
        return command[kept]

    def _refine(self, prepared: Prepared, target: Array, command: Array, steps: int) -> Pool:
        """Refined commands (N, P, n, 3), best first: the cheapest exact one, or the most exact one."""
        rows, p, n, _ = command.shape
        refined = refine(prepared.commands, np.repeat(target, p, axis=0), command.reshape(-1, n, 3), steps)
        energy = command_energy(refined.command, prepared.upper)
        rank = np.where(refined.error > TOLERANCE, 1e3 + refined.error, energy).reshape(rows, p)
        order = np.argsort(rank, axis=1) + np.arange(rows)[:, None] * p
        return Pool(refined.command[order], refined.wrench[order], refined.error[order], energy[order])


class Pool(NamedTuple):
    """P refined answers to each of N targets, best first."""

    command: Array
    """(N, P, n, 3)."""
    wrench: Array
    """Normalized wrench (N, P, 6) by the surrogate."""
    error: Array
    """Normalized error (N, P) by the surrogate."""
    energy: Array
    """(N, P)."""


def _candidates(pool: Pool, std: Array) -> Candidates:
    """The refined answers to a single target."""
    command, wrench, error, energy = (values[0] for values in pool)
    return Candidates(command, wrench * std, error, energy, ("refined",) * len(command))


def _samples(proposal: Proposal, prepared: Prepared, std: Array) -> Candidates:
    """The raw candidates for a single target."""
    order = np.argsort(proposal.error[0])
    names = tuple(f"mode {k + 1}" for k in proposal.component[0][order])
    command = proposal.command[0][order].astype(np.float64)
    return Candidates(
        np.clip(command, prepared.lower, prepared.upper),
        proposal.wrench[0][order] * std,
        proposal.error[0][order].astype(np.float64),
        proposal.energy[0][order].astype(np.float64),
        names,
    )


def _best_of_each_component(component: NDArray[np.int64], score: Array, n_seeds: int) -> NDArray[np.int64]:
    """Indices (N, n_seeds) of the best candidates, at most one from each mixture component.

    At low temperature the samples of one component lie close together and would all descend to the
    same allocation.
    """
    rows = np.arange(len(score))[:, None]
    worst_first = np.argsort(-score, axis=1)
    best = np.zeros((len(score), int(component.max()) + 1), dtype=np.int64)
    # Later assignments win, so the best candidate of each component is what stays.
    best[rows, component[rows, worst_first]] = worst_first
    order = np.argsort(score[rows, best], axis=1)[:, :n_seeds]
    return best[rows, order]
