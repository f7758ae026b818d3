"""The learned allocator: the network proposes, the surrogate ranks, a search finds the cheapest answer.

Predict (mixture of the network) -> sample K candidates -> rank by the surrogate's error and energy ->
drive the best ones, and a few sub-layouts, to the nearest cheap exact allocation in force space ->
Levenberg-Marquardt on the commands. Only the learned surrogate is seen on the way; the analytic fin
model scores the answer afterwards.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from finlab.allocation import force_space
from finlab.allocation.allocation import Candidates, Solution
from finlab.allocation.allocator import Allocator
from finlab.allocation.energy import command_energy
from finlab.allocation.learned_fin import LearnedFin
from finlab.allocation.levenberg_marquardt import refine
from finlab.allocation.numpy_network import NumpyNetwork
from finlab.allocation.policy import Policy
from finlab.allocation.prepared import Prepared, prepare
from finlab.allocation.proposal import Proposal, propose
from finlab.allocation.steady import TURNS, planar_thrust, turn_little
from finlab.allocation.unreachable import serve_in_turn
from finlab.errors import AllocationError, CheckpointError
from finlab.layout import FinModelSpec, Layout
from finlab.model.checkpoint import Checkpoint
from finlab.model.surrogate import FORCE_UNIT, CoefficientSurrogate

Array = NDArray[Any]

CHUNK = 256
"""Targets that are solved together; keeps memory flat for any number of targets."""
TOLERANCE = 2e-4
"""Normalized error (by the surrogate) below which an answer counts as exact and energy decides."""
PROMISING = 0.02
"""Normalized error below which a search counts as successful: refinement removes the rest."""
INEXACT = 1e9
"""Rank of inexact answers, behind every exact one. Energies reach thousands where an arc of zero directions
ends near zero, since the energy divides by that end."""
PATIENCE = ((5, 0), (25, 32))
"""For the few targets that the quick way did not reach: Levenberg-Marquardt steps, and how many fresh
starts join, in stages."""
RESTARTS = 32
"""Raw candidates from which an unreachable target is approached under weights or priorities."""
SWITCH_GAIN = 0.02
"""Share of its energy that a robot in motion must save before it changes the way it moves."""


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
        n_refined: int = 4,
        search_steps: int | None = None,
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
            search_steps: reweighting steps of the search in force space; by default 4, and 12 from six fins
                on, where there is more to choose from.
            refine_steps: Levenberg-Marquardt steps.
            subsets: whether sub-layouts are searched as well.
        """
        if n_candidates < 1 or n_seeds < 1 or n_refined < 1 or not temperature >= 0.0:
            raise AllocationError(
                "method 'learned' needs at least one candidate, seed and refined answer and a temperature "
                f"from 0, got n_candidates={n_candidates}, n_seeds={n_seeds}, n_refined={n_refined}, "
                f"temperature={temperature}"
            )
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
        # All products here are too small to be shared among threads; chunks of targets are not.
        self._threads = ThreadpoolController()
        self._fin_model = FinModelSpec.from_values(checkpoint.fin_model)
        state = {k: v.numpy() for k, v in checkpoint.surrogate.state_dict().items()}
        fin = LearnedFin(state, CoefficientSurrogate.REFERENCE, FORCE_UNIT)
        std = self.normalization.std
        self.prepare = lru_cache(maxsize=128)(lambda layout: prepare(layout, fin, std))
        self.notes = lru_cache(maxsize=128)(self._notes)

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        prepared = self.prepare(layout)
        notes = self.notes(layout)
        if len(targets) == 1:
            with self._threads.limit(limits=1, user_api="blas"):
                pool, proposal = self._solve_chunk(prepared, targets, seed, previous)
            std = self.normalization.std
            return Solution(
                pool.command[:, 0],
                pool.wrench[:, 0] * std,
                notes=notes,
                candidates=lambda: _candidates(pool, std),
                samples=lambda: _samples(proposal, prepared, std),
            )

        def solve(start: int) -> Pool:
            return self._solve_chunk(prepared, targets[start : start + CHUNK], seed + start, None)[0]

        with (
            self._threads.limit(limits=1, user_api="blas"),
            ThreadPoolExecutor(os.cpu_count()) as executor,
        ):
            parts = list(executor.map(solve, range(0, len(targets), CHUNK)))
        command = np.concatenate([part.command[:, 0] for part in parts])
        wrench = np.concatenate([part.wrench[:, 0] for part in parts]) * self.normalization.std
        return Solution(command, wrench, notes=notes)

    def _solve_by(
        self, policy: Policy, layout: Layout, target: Array, *, seed: int, previous: Array | None
    ) -> Solution:
        if policy.kind == "direction":
            return self._solve_direction(layout, target, seed=seed, previous=previous)
        solution = self._solve(layout, target, seed=seed, previous=previous)
        plain = policy.kind == "closest" and len(set(policy.axis_weights)) == 1
        if plain or self._reaches(layout, solution, target)[0]:
            return solution
        assert solution.candidates is not None and solution.samples is not None
        starts = np.concatenate([solution.candidates().command, solution.samples().command[:RESTARTS]])
        stages = (
            policy.stages
            if policy.kind == "priority"
            else [(np.array(policy.axis_weights), np.ones(6, bool))]
        )
        command = serve_in_turn(
            self.prepare(layout).commands, target[0] / self.normalization.std, stages, starts
        )
        wrench = self.prepare(layout).commands.wrench(command[None]) * self.normalization.std
        return solution._replace(command=command[None], wrench_surrogate=wrench)

    def _solve_chunk(
        self, prepared: Prepared, targets: Array, seed: int, previous: Array | None
    ) -> tuple[Pool, Proposal]:
        """Refined answers, best first, to a few targets (N, 6), and the network's raw proposal."""
        std = self.normalization.std
        target = targets / std
        centred = target - self.normalization.mean / std
        proposal = propose(self.network, prepared, centred, target, self.n_candidates, self.temperature, seed)
        if previous is None:
            return self._descend(prepared, target, proposal, self._seeds(prepared, proposal)), proposal
        # The fins turn as little as the target allows, those at rest towards where they would be cheapest.
        seeds = self._seeds(prepared, proposal)
        aim = self._descend(prepared, target, proposal, seeds).command[0, 0, :, 2]
        kept = planar_thrust(prepared.commands, previous)
        seeds = np.concatenate([kept[None, None], seeds], axis=1)
        for width in TURNS:
            near = turn_little(prepared, previous, aim, width)
            pool = self._descend(near, target, proposal, seeds, steady=True)
            if pool.error[0, 0] <= TOLERANCE:
                break
        # Arcs that pass the seam are brought back inside the fin's own limits.
        return pool._replace(command=prepared.commands.clamp(pool.command)), proposal

    def _descend(
        self, prepared: Prepared, target: Array, proposal: Proposal, seeds: Array, steady: bool = False
    ) -> Pool:
        """Search from thrust seeds (N, S, n), refine, and insist where that did not reach the target."""
        command = self._search(prepared, target, seeds, steady)
        pool = self._refine(prepared, target, command, self.refine_steps, steady)
        for steps, extra in PATIENCE:
            missed = pool.error[:, 0] > TOLERANCE
            if not missed.any():
                break
            fresh = _fresh_starts(prepared, target[missed], proposal.command[missed], extra)
            more = np.concatenate([pool.command[missed], fresh], axis=1)
            longer = self._refine(prepared, target[missed], more, steps)
            for kept, new in zip(pool, longer, strict=True):
                kept[missed] = new[:, : kept.shape[1]]
        return pool

    def _seeds(self, prepared: Prepared, proposal: Proposal) -> Array:
        """Thrust seeds (N, S, n): the best candidate of each component, and sub-layouts."""
        score = proposal.error * proposal.error + self.gamma * proposal.energy
        chosen = _best_of_each_component(proposal.component, score, self.n_seeds)
        seeds = proposal.thrust[np.arange(len(score))[:, None], chosen].astype(np.float64)
        if not self.subsets:
            return seeds
        shared = np.broadcast_to(prepared.subsets, (len(score), *prepared.subsets.shape))
        return np.concatenate([seeds, shared], axis=1)

    def _search(self, prepared: Prepared, target: Array, thrust: Array, steady: bool) -> Array:
        """Cheapest commands (N, n_refined, n, 3) reached from thrust seeds (N, S, n).

        With `steady`, the first seed is where the robot is; what it leads to stays first.
        """
        rows, n_seeds, n = thrust.shape
        flat = np.repeat(target, n_seeds, axis=0)
        steps = self.search_steps or (4 if n < 6 else 12)
        planar = force_space.descend(prepared.planar, flat, thrust.reshape(-1, n), steps)
        command, energy = force_space.realize(prepared.planar, planar)
        error = np.einsum("ri,ri->r", planar.residual, planar.residual)
        score = np.where(error > PROMISING**2, INEXACT * (1.0 + error), energy).reshape(rows, n_seeds)
        if steady:
            score[:, 0] = -1.0
        kept = np.argsort(score, axis=1)[:, : self.n_refined] + np.arange(rows)[:, None] * n_seeds
        return command[kept]

    def _refine(
        self, prepared: Prepared, target: Array, command: Array, steps: int, steady: bool = False
    ) -> Pool:
        """Refined commands (N, P, n, 3), best first: the cheapest exact one, or the most exact one.

        With `steady`, the first command is how the robot moves now; another must save the share
        `SWITCH_GAIN` of its energy to take its place.
        """
        rows, p, n, _ = command.shape
        repeated = np.repeat(target, p, axis=0)
        refined = refine(prepared.commands, repeated, command.reshape(-1, n, 3), steps)
        energy = command_energy(refined.command, prepared.upper)
        cost = energy.reshape(rows, p).copy()
        if steady:
            cost[:, 0] *= 1.0 - SWITCH_GAIN
        error = refined.error.reshape(rows, p)
        order = (
            np.argsort(np.where(error > TOLERANCE, INEXACT * (1.0 + error), cost), axis=1)
            + np.arange(rows)[:, None] * p
        )
        return Pool(refined.command[order], refined.wrench[order], refined.error[order], energy[order])

    def _notes(self, layout: Layout) -> tuple[str, ...]:
        """What the user should know before trusting an answer for this layout."""
        known = self._fin_model
        strangers = [
            fin.name
            for fin in layout.fins
            if fin.model.type != known.type or fin.model.values() != known.values()
        ]
        if not strangers:
            return ()
        return (
            f"checkpoint {self.checkpoint!r} knows fins of model {known.type!r} and takes these for "
            f"such: {', '.join(strangers)}; trust the plant's error or train a surrogate for them",
        )


def _fresh_starts(prepared: Prepared, target: Array, proposed: Array, count: int) -> Array:
    """Commands (N, count, n, 3): all fins loaded evenly, raw candidates of the network, random ones.

    Near the border of what a robot can do, all of the network's candidates may lie in one blind alley.
    """
    rows, _, n, _ = proposed.shape
    if count == 0:
        return np.empty((rows, 0, n, 3))
    even, _ = force_space.realize(prepared.planar, force_space.spread_evenly(prepared.planar, target))
    raw = proposed[:, : count // 2].astype(np.float64)
    lower, upper = prepared.commands.lower, prepared.commands.upper
    unit = np.random.default_rng(0).random((count - 1 - raw.shape[1], n, 3))
    spread = np.broadcast_to(lower + unit * (upper - lower), (rows, *unit.shape))
    return prepared.commands.clamp(np.concatenate([even[:, None], raw, spread], axis=1))


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
