"""From a network's proposal to the cheapest exact commands, in numpy alone.

Predict (mixture of the network) -> sample K candidates -> rank by the surrogate's error and energy ->
drive the best ones, and a few sub-layouts, to the nearest cheap exact allocation in force space ->
Levenberg-Marquardt on the commands. Nothing here knows the analytic fin model.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.foresight import foresee
from finlab.allocation.learned.insist import FIRST_PATIENCE, Lead, insist, nearest_forces
from finlab.allocation.learned.pool import TOLERANCE, Pool, rank, refine_pool
from finlab.allocation.learned.prepared import Prepared, prepare
from finlab.allocation.learned.proposal import Proposal, Proposer, propose
from finlab.allocation.learned.settings import Settings
from finlab.allocation.learned.steady import TURNS, planar_thrust, turn_little, turn_short
from finlab.allocation.learned.weighted_sum import lessen
from finlab.errors import AllocationError
from finlab.forces import force_space
from finlab.inference.learned_fin import LearnedFin
from finlab.inference.network import NumpyNetwork
from finlab.inference.weights import LearnedWeights
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights

Array = NDArray[Any]

PROMISING = 0.02
"""Normalized error below which a search counts as successful: refinement removes the rest."""
EXPLORERS = 64
"""Random seeds of the wide search for other ways."""
EXPLORING_STEPS = 40
"""Reweighting steps of that search: what it tells should be the bottoms of their valleys."""
PLAN_STEPS = 4
"""Levenberg-Marquardt steps on a command that was planned ahead."""
SLIGHT = 5e-3
"""Normalized error for a tick that is better than a fast turn: half of what counts as delivered."""


class Pipeline:
    """Answers targets on layouts without failures; every array is numpy's."""

    def __init__(
        self, weights: LearnedWeights, settings: Settings, energy_weights: EnergyWeights = DEFAULT_WEIGHTS
    ) -> None:
        """Take over trained weights; energies are compared by `energy_weights`."""
        if settings.energy_tradeoff > 0.0 and energy_weights.inertial > 0.0:
            raise AllocationError(
                "energy_tradeoff: the weighted sum needs an energy of squares, got energy_weights with "
                "inertial power; leave energy_tradeoff at 0 or take other energy_weights"
            )
        self.settings, self.normalization = settings, weights.normalization
        self.network = NumpyNetwork(weights.network, weights.heads, weights.n_components)
        self.propose: Proposer = partial(propose, self.network)
        fin = LearnedFin(weights.surrogate, weights.reference, weights.force_unit)
        std = self.normalization.std
        self.prepare = lru_cache(maxsize=128)(lambda layout: prepare(layout, fin, std, energy_weights))

    def solve(
        self,
        prepared: Prepared,
        targets: Array,
        seed: int,
        previous: Array | None,
        *,
        lead: Lead = nearest_forces,
    ) -> tuple[Pool, Proposal]:
        """Refined answers, best first, to a few targets (N, 6), and the network's raw proposal.

        Args:
            prepared: the layout.
            targets: desired wrenches (N, 6).
            seed: of the samples.
            previous: command (n, 3) of the previous tick, for a single target.
            lead: where to start from when targets were missed; None from it gives them up.
        """
        std, settings = self.normalization.std, self.settings
        target = targets / std
        centred = target - self.normalization.mean / std
        proposal = self.propose(prepared, centred, target, settings.n_candidates, settings.temperature, seed)
        if previous is None:
            seeds = self._seeds(prepared, proposal)
            pool = self._descend(prepared, target, proposal, seeds, lead)
            return self._weigh(prepared, target, pool, None), proposal
        pool = self._descend_steadily(prepared, target, proposal, previous, lead)
        pool = self._weigh(prepared, target, pool, previous)
        # Arcs that pass the seam are brought back inside the fin's own limits.
        return pool._replace(command=prepared.commands.clamp(pool.command)), proposal

    def explore(self, prepared: Prepared, targets: Array, answer: Pool, proposal: Proposal) -> Pool:
        """Many refined answers to one target (1, 6): the answer itself, then all that wide seeds lead to.

        Every candidate of the network seeds a search of its own, as do random shares of thrust.
        """
        target = targets / self.normalization.std
        top = prepared.planar.curves.maximum
        drawn = np.random.default_rng(0).random((EXPLORERS, len(top))) ** 2 * top
        spread = np.concatenate([proposal.thrust[0].astype(np.float64), prepared.subsets, drawn])
        command = self._search(prepared, target, spread[None], False, keep=len(spread), steps=EXPLORING_STEPS)
        found = refine_pool(prepared, target, command, FIRST_PATIENCE)
        return Pool(*(np.concatenate(both, axis=1) for both in zip(answer, found, strict=True)))

    def _descend_steadily(
        self, prepared: Prepared, target: Array, proposal: Proposal, previous: Array, lead: Lead
    ) -> Pool:
        """Answers that turn the fins as little as the target allows, with an eye on the next ticks.

        Fins at rest turn towards where they will be needed, or else where they would be cheapest.
        """
        seeds = self._seeds(prepared, proposal)
        free = self._descend(prepared, target, proposal, seeds, lead)
        aim = free.command[0, 0, :, 2]
        kept = planar_thrust(prepared.commands, previous)
        seeds = np.concatenate([kept[None, None], seeds], axis=1)
        near = turn_little(prepared, previous, aim, TURNS[0])
        pool = self._descend(near, target, proposal, seeds, lead, beside=free.command[0])
        plan = foresee(prepared, previous, target[0], pool.command[0, 0], free.command[0])
        if plan is not None:
            near = turn_little(prepared, previous, plan.ready, TURNS[1])
            start = near.commands.clamp(turn_short(near, plan.command))
            planned = refine_pool(near, target, start[None, None], PLAN_STEPS)
            if planned.error[0, 0] <= max(TOLERANCE, pool.error[0, 0]):
                pool = Pool(*(np.concatenate(parts, axis=1) for parts in zip(planned, pool, strict=True)))
        for width in TURNS[1:]:
            if pool.error[0, 0] <= (TOLERANCE if width == TURNS[1] else SLIGHT):
                break
            near = turn_little(prepared, previous, aim, width)
            pool = self._descend(near, target, proposal, seeds, lead, beside=free.command[0])
        return pool

    def _weigh(self, prepared: Prepared, target: Array, pool: Pool, previous: Array | None) -> Pool:
        """Trade error for energy, where the settings ask for the weighted sum."""
        weight = self.settings.energy_tradeoff
        if weight == 0.0:
            return pool
        if previous is not None:
            prepared = turn_little(prepared, previous, pool.command[0, 0, :, 2], TURNS[0])
        rows, p, n, _ = pool.command.shape
        start = prepared.commands.clamp(pool.command.reshape(-1, n, 3))
        found, energy = lessen(
            prepared.commands, np.repeat(target, p, axis=0), start, prepared.energy, weight
        )
        total = (found.error**2 + weight * energy).reshape(rows, p)
        order = total.argsort(axis=1) + np.arange(0, rows * p, p)[:, None]
        return Pool(*(values.take(order, axis=0) for values in (*found, energy)))

    def _descend(
        self,
        prepared: Prepared,
        target: Array,
        proposal: Proposal,
        seeds: Array,
        lead: Lead,
        beside: Array | None = None,
    ) -> Pool:
        """Search from thrust seeds (N, S, n), refine, and insist where that did not reach the target.

        From tick to tick, `beside` are commands (P, n, 3) that answer the single target whatever the turns:
        the search in narrow arcs may miss them where they are within these.
        """
        steady, steps = beside is not None, self.settings.refine_steps
        command = self._search(prepared, target, seeds, steady)
        if beside is not None:
            within = prepared.commands.clamp(turn_short(prepared, beside))
            command, steps = np.concatenate([command, within[None]], axis=1), steps + 1
        pool = refine_pool(prepared, target, command, steps, steady)
        missed = pool.error[:, 0] > TOLERANCE
        if missed.any():
            insist(prepared, target, proposal, pool, missed, lead)
        return pool

    def _seeds(self, prepared: Prepared, proposal: Proposal) -> Array:
        """Thrust seeds (N, S, n): the best candidate of each component, and sub-layouts."""
        score = proposal.error * proposal.error + self.settings.gamma * proposal.energy
        chosen = _best_of_each_component(proposal.component, score, self.settings.n_seeds)
        rows, k = score.shape
        count = chosen.shape[1]
        seeds = np.empty((rows, count + len(prepared.subsets) * self.settings.subsets, len(prepared.lower)))
        chosen += np.arange(0, rows * k, k)[:, None]
        seeds[:, :count] = proposal.thrust.reshape(rows * k, -1).take(chosen, axis=0)
        if self.settings.subsets:
            seeds[:, count:] = prepared.subsets
        return seeds

    def _search(
        self,
        prepared: Prepared,
        target: Array,
        thrust: Array,
        steady: bool,
        keep: int | None = None,
        steps: int | None = None,
    ) -> Array:
        """Cheapest commands (N, n_refined, n, 3) reached from thrust seeds (N, S, n).

        With `steady`, the first seed is where the robot is; what it leads to stays first.
        """
        rows, n_seeds, n = thrust.shape
        flat = target if rows == 1 else np.repeat(target, n_seeds, axis=0)
        steps = steps or self.settings.search_steps or (4 if n < 6 else 12)
        planar = force_space.descend(prepared.planar, flat, thrust.reshape(-1, n), steps)
        command, energy = force_space.realize(prepared.planar, planar)
        error = np.einsum("ri,ri->r", planar.residual, planar.residual)
        score = rank(energy, error, PROMISING**2).reshape(rows, n_seeds)
        if steady:
            score[:, 0] = -1.0
        kept = (
            score.argsort(axis=1)[:, : keep or self.settings.n_refined]
            + np.arange(0, rows * n_seeds, n_seeds)[:, None]
        )
        return command.take(kept, axis=0)


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
