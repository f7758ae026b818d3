"""From a network's proposal to the cheapest exact commands, in numpy alone.

Predict (mixture of the network) -> sample K candidates -> rank by the surrogate's error and energy ->
drive the best ones, and a few sub-layouts, to the nearest cheap exact allocation in force space ->
Levenberg-Marquardt on the commands. Nothing here knows the analytic fin model.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.prepared import Prepared, prepare
from finlab.allocation.learned.proposal import Proposal, propose
from finlab.allocation.learned.receding_horizon import plan_ahead
from finlab.allocation.learned.refined_candidates import (
    MISSED,
    RANKING,
    FallbackForces,
    RefinedCandidates,
    nearest_forces,
    rank,
    refine_candidates,
    refine_missed,
)
from finlab.allocation.learned.settings import Settings
from finlab.allocation.learned.turn_limits import TURNS, limit_turn, planar_thrust, unwrap_to_arc
from finlab.allocation.learned.weighted_sum import minimize_weighted_sum
from finlab.errors import AllocationError
from finlab.forces import force_space
from finlab.inference.learned_fin import LearnedFin
from finlab.inference.network import NumpyNetwork
from finlab.inference.weights import TrainedWeights
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights

Array = NDArray[Any]


@dataclass(frozen=True)
class SearchSettings:
    """What the search does that users need not set."""

    promising_error: float = 0.02
    """Normalized error below which a search in force space counts as successful: refinement removes the
    rest."""
    few_fins_steps: int = 4
    """Reweighting steps of the search with up to five fins."""
    many_fins_steps: int = 12
    """The same from six fins on, where there are more local minima to leave."""
    wide_seeds: int = 64
    """Random seeds of the wide search for alternatives."""
    wide_steps: int = 40
    """Reweighting steps of that search, enough to converge: alternatives are counted by their local
    minima."""
    alternative_error: float = 1e-3
    """Normalized error, by the surrogate, up to which another answer is an alternative."""
    plan_lm_steps: int = 4
    """Levenberg-Marquardt steps on a command of the receding horizon."""
    passing_error: float = 5e-3
    """Normalized error for a tick that is better than a fast turn: half of what counts as delivered."""


SEARCH = SearchSettings()
"""What every pipeline uses."""


class Pipeline:
    """Answers targets on layouts without failures; every array is numpy's."""

    def __init__(
        self, weights: TrainedWeights, settings: Settings, energy_weights: EnergyWeights = DEFAULT_WEIGHTS
    ) -> None:
        """Take over trained weights; energies are compared by `energy_weights`."""
        sizes = weights.check_network()
        self.energy_weights = energy_weights
        self.settings, self.normalization = self._checked(settings), weights.normalization
        self.network = NumpyNetwork(weights.network, sizes.heads, sizes.n_components)
        fin = LearnedFin(weights.surrogate)
        std = self.normalization.std
        self.prepare = lru_cache(maxsize=128)(lambda layout: prepare(layout, fin, std, energy_weights))

    def with_settings(self, settings: Settings) -> Pipeline:
        """The same networks, and the same layouts prepared, with other settings."""
        other = copy(self)
        other.settings = self._checked(settings)
        return other

    def _checked(self, settings: Settings) -> Settings:
        if settings.energy_tradeoff > 0.0 and self.energy_weights.inertial > 0.0:
            raise AllocationError(
                "energy_tradeoff: the weighted sum needs an energy of squares, got energy_weights with "
                "inertial power; leave energy_tradeoff at 0 or take other energy_weights"
            )
        return settings

    def solve(
        self,
        prepared: Prepared,
        targets: Array,
        seed: int,
        previous: Array | None,
        *,
        fallback: FallbackForces = nearest_forces,
    ) -> tuple[RefinedCandidates, Proposal]:
        """Refined answers, best first, to a few targets (N, 6), and the network's raw proposal.

        Args:
            prepared: the layout.
            targets: desired wrenches (N, 6).
            seed: of the samples.
            previous: command (n, 3) of the previous tick, for a single target.
            fallback: where to start from when targets were missed; None from it ends their search.
        """
        std, settings = self.normalization.std, self.settings
        target = targets / std
        centred = target - self.normalization.mean / std
        drawn = settings.n_candidates, settings.temperature, seed
        proposal = propose(self.network, prepared, centred, target, *drawn)
        if previous is None:
            seeds = self._seeds(prepared, proposal)
            candidates = self._descend(prepared, target, proposal, seeds, fallback)
            return self._trade_error_for_energy(prepared, target, candidates, None), proposal
        candidates = self._descend_from_previous(prepared, target, proposal, previous, fallback)
        candidates = self._trade_error_for_energy(prepared, target, candidates, previous)
        # Arcs that pass the seam are brought back inside the fin's own limits.
        return candidates._replace(command=prepared.commands.clamp(candidates.command)), proposal

    def explore(
        self, prepared: Prepared, targets: Array, answer: RefinedCandidates, proposal: Proposal
    ) -> RefinedCandidates:
        """Many refined answers to one target (1, 6): the answer itself, then all that many seeds lead to.

        Every candidate of the network seeds a search of its own, as do random shares of thrust.
        """
        target = targets / self.normalization.std
        top = prepared.planar.curves.maximum
        drawn = np.random.default_rng(0).random((SEARCH.wide_seeds, len(top))) ** 2 * top
        spread = np.concatenate([proposal.thrust[0].astype(np.float64), prepared.subsets, drawn])
        command = self._search(
            prepared, target, spread[None], False, keep=len(spread), steps=SEARCH.wide_steps
        )
        found = refine_candidates(prepared, target, command, MISSED.first_lm_steps)
        return found.with_first(answer)

    def _descend_from_previous(
        self, prepared: Prepared, target: Array, proposal: Proposal, previous: Array, fallback: FallbackForces
    ) -> RefinedCandidates:
        """Answers that turn the fins as little as the target allows, with regard to the next ticks.

        Fins at rest turn towards where they will be needed, or else where they would be cheapest.
        """
        seeds = self._seeds(prepared, proposal)
        free = self._descend(prepared, target, proposal, seeds, fallback)
        aim = free.command[0, 0, :, 2]
        kept = planar_thrust(prepared.commands, previous)
        seeds = np.concatenate([kept[None, None], seeds], axis=1)
        near = limit_turn(prepared, previous, aim, TURNS[0])
        candidates = self._descend(near, target, proposal, seeds, fallback, known=free.command[0])
        plan = plan_ahead(prepared, previous, target[0], candidates.command[0, 0], free.command[0])
        if plan is not None:
            near = limit_turn(prepared, previous, plan.ready, TURNS[1])
            start = near.commands.clamp(unwrap_to_arc(near, plan.command))
            planned = refine_candidates(near, target, start[None, None], SEARCH.plan_lm_steps)
            if planned.error[0, 0] <= max(RANKING.exact_error, candidates.error[0, 0]):
                candidates = candidates.with_first(planned)
        for width in TURNS[1:]:
            if candidates.error[0, 0] <= (RANKING.exact_error if width == TURNS[1] else SEARCH.passing_error):
                break
            near = limit_turn(prepared, previous, aim, width)
            candidates = self._descend(near, target, proposal, seeds, fallback, known=free.command[0])
        return candidates

    def _trade_error_for_energy(
        self, prepared: Prepared, target: Array, candidates: RefinedCandidates, previous: Array | None
    ) -> RefinedCandidates:
        """Trade error for energy, where the settings ask for the weighted sum."""
        weight = self.settings.energy_tradeoff
        if weight == 0.0:
            return candidates
        if previous is not None:
            prepared = limit_turn(prepared, previous, candidates.command[0, 0, :, 2], TURNS[0])
        rows, p, n, _ = candidates.command.shape
        start = prepared.commands.clamp(candidates.command.reshape(-1, n, 3))
        found, energy = minimize_weighted_sum(
            prepared.commands, np.repeat(target, p, axis=0), start, prepared.energy, weight
        )
        total = (found.error**2 + weight * energy).reshape(rows, p)
        order = total.argsort(axis=1) + np.arange(0, rows * p, p)[:, None]
        return RefinedCandidates(*(values.take(order, axis=0) for values in (*found, energy)))

    def _descend(
        self,
        prepared: Prepared,
        target: Array,
        proposal: Proposal,
        seeds: Array,
        fallback: FallbackForces,
        known: Array | None = None,
    ) -> RefinedCandidates:
        """Search from thrust seeds (N, S, n), refine, and go on where that did not reach the target.

        From tick to tick, `known` are commands (P, n, 3) that answer the single target whatever the turns:
        the search in narrow arcs may miss them where they are within these.
        """
        keep_mode, steps = known is not None, self.settings.refine_steps
        command = self._search(prepared, target, seeds, keep_mode)
        if known is not None:
            within = prepared.commands.clamp(unwrap_to_arc(prepared, known))
            command, steps = np.concatenate([command, within[None]], axis=1), steps + 1
        candidates = refine_candidates(prepared, target, command, steps, keep_mode)
        missed = candidates.error[:, 0] > RANKING.exact_error
        if missed.any():
            refine_missed(prepared, target, proposal, candidates, missed, fallback)
        return candidates

    def _seeds(self, prepared: Prepared, proposal: Proposal) -> Array:
        """Thrust seeds (N, S, n): the best candidate of each component, and sub-layouts."""
        score = proposal.error * proposal.error + self.settings.gamma * proposal.energy
        chosen = _best_of_each_component(proposal.component, score, self.settings.n_seeds)
        rows, count = chosen.shape
        n = len(prepared.lower)
        seeds = np.empty((rows, count + len(prepared.subsets) * self.settings.subsets, n))
        seeds[:, :count] = proposal.thrust.reshape(-1, n).take(chosen, axis=0)
        if self.settings.subsets:
            seeds[:, count:] = prepared.subsets
        return seeds

    def _search(
        self,
        prepared: Prepared,
        target: Array,
        thrust: Array,
        keep_mode: bool,
        keep: int | None = None,
        steps: int | None = None,
    ) -> Array:
        """Cheapest commands (N, n_refined, n, 3) reached from thrust seeds (N, S, n).

        With `keep_mode`, the first seed is how the robot moves now; what it leads to stays first.
        """
        rows, n_seeds, n = thrust.shape
        flat = target if rows == 1 else np.repeat(target, n_seeds, axis=0)
        usual = SEARCH.few_fins_steps if n < 6 else SEARCH.many_fins_steps
        steps = steps or self.settings.search_steps or usual
        planar = force_space.descend(prepared.planar, flat, thrust.reshape(-1, n), steps)
        command, energy = force_space.realize(prepared.planar, planar)
        error = np.einsum("ri,ri->r", planar.residual, planar.residual)
        score = rank(energy, error, SEARCH.promising_error**2).reshape(rows, n_seeds)
        if keep_mode:
            score[:, 0] = -1.0
        kept = (
            score.argsort(axis=1)[:, : keep or self.settings.n_refined]
            + np.arange(0, rows * n_seeds, n_seeds)[:, None]
        )
        return command.take(kept, axis=0)


def _best_of_each_component(component: NDArray[np.int64], score: Array, n_seeds: int) -> NDArray[np.int64]:
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
