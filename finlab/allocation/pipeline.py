"""From a network's proposal to the cheapest exact commands, in numpy alone.

Predict (mixture of the network) -> sample K candidates -> rank by the surrogate's error and energy ->
drive the best ones, and a few sub-layouts, to the nearest cheap exact allocation in force space ->
Levenberg-Marquardt on the commands. Nothing here knows the analytic fin model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation import force_space
from finlab.allocation.energy import DEFAULT_WEIGHTS, EnergyWeights
from finlab.allocation.force_space import PlanarProblem
from finlab.allocation.foresight import foresee
from finlab.allocation.learned_fin import LearnedFin
from finlab.allocation.levenberg_marquardt import refine
from finlab.allocation.nearest import nearest, wrench_of
from finlab.allocation.numpy_network import NumpyNetwork
from finlab.allocation.prepared import Prepared, prepare
from finlab.allocation.proposal import Proposal, Proposer, propose
from finlab.allocation.steady import TURNS, planar_thrust, turn_little, turn_short
from finlab.allocation.weighted_sum import lessen
from finlab.allocation.weights import LearnedWeights
from finlab.errors import AllocationError

Array = NDArray[Any]

TOLERANCE = 2e-4
"""Normalized error (by the surrogate) below which an answer counts as exact and energy decides."""
PROMISING = 0.02
"""Normalized error below which a search counts as successful: refinement removes the rest."""
INEXACT = 1e9
"""Rank of inexact answers, behind every exact one. Energies reach thousands where an arc of zero directions
ends near zero, since the energy divides by that end."""
GRAIN = 5e-5
"""Normalized error by which one inexact answer may be worse than another that is cheaper."""
SPARING_STEPS = 3
"""Levenberg-Marquardt steps after an inexact answer was made cheaper."""
FIRST_PATIENCE, NEAREST_PATIENCE, LAST_PATIENCE = 5, 8, 25
"""Levenberg-Marquardt steps for the few targets that the quick way did not reach: at once, from the
nearest wrench that the fins can deliver, and from fresh starts."""
RESTARTS = 32
"""Fresh starts for the very few that even so stay further away than they need to."""
EXPLORERS = 64
"""Random seeds of the wide search for other ways."""
EXPLORING_STEPS = 40
"""Reweighting steps of that search: what it tells should be the bottoms of their valleys."""
NEEDLESS = (5e-4, 2e-3)
"""Normalized error beyond what is proven to be needed that is not worth further starts: a constant and a
share."""
PLAN_STEPS = 4
"""Levenberg-Marquardt steps on a command that was planned ahead."""
SLIGHT = 5e-3
"""Normalized error for a tick that is better than a fast turn: half of what counts as delivered."""
SWITCH_GAIN = 0.01
"""Share of its energy that a robot in motion must save before it changes the way it moves."""


@dataclass(frozen=True)
class Settings:
    """How widely and how long the pipeline searches."""

    n_candidates: int = 64
    """Number K of candidates drawn from the mixture."""
    temperature: float = 0.02
    """T of the sampling; 0.02 in the paper."""
    gamma: float = 1e-2
    """Weight of the energy in the ranking J = J_norm + gamma J_en."""
    n_seeds: int = 6
    """Candidates that enter the search."""
    n_refined: int = 4
    """Allocations that are refined and offered as candidates."""
    search_steps: int | None = None
    """Reweighting steps of the search in force space; None: 4, and 12 from six fins on, where there is
    more to choose from."""
    refine_steps: int = 1
    """Levenberg-Marquardt steps."""
    subsets: bool = True
    """Whether sub-layouts are searched as well."""
    energy_weight: float = 0.0
    """w of the weighted sum `err_norm^2 + w J_en` to minimize; 0: the least energy among exact answers."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.energy_weight < np.inf:
            raise AllocationError(f"energy_weight: expected a number from 0, got {self.energy_weight}")
        if self.n_candidates < 1 or self.n_seeds < 1 or self.n_refined < 1 or not self.temperature >= 0.0:
            raise AllocationError(
                "method 'learned' needs at least one candidate, seed and refined answer and a temperature "
                f"from 0, got n_candidates={self.n_candidates}, n_seeds={self.n_seeds}, "
                f"n_refined={self.n_refined}, temperature={self.temperature}"
            )


Lead = Callable[[PlanarProblem, Array], Array | None]
"""From targets (R, 6) that were missed to planar forces (R, n, 2) [N] that come near them, or None."""


def nearest_forces(problem: PlanarProblem, target: Array) -> Array:
    """The forces (R, n, 2) whose wrench is nearest."""
    return nearest(problem, target).force


class Pipeline:
    """Answers targets on layouts without failures; every array is numpy's."""

    def __init__(
        self, weights: LearnedWeights, settings: Settings, energy_weights: EnergyWeights = DEFAULT_WEIGHTS
    ) -> None:
        """Take over trained weights; energies are compared by `energy_weights`."""
        if settings.energy_weight > 0.0 and energy_weights.inertial > 0.0:
            raise AllocationError(
                "energy_weight: the weighted sum needs an energy of squares, got energy_weights with "
                "inertial power; leave energy_weight at 0 or take other energy_weights"
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
            return self._weigh(prepared, target, pool), proposal
        pool = self._descend_steadily(prepared, target, proposal, previous, lead)
        near = turn_little(prepared, previous, pool.command[0, 0, :, 2], TURNS[0])
        pool = self._weigh(near, target, pool)
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
        found = self._refine(prepared, target, command, FIRST_PATIENCE)
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
            planned = self._refine(near, target, start[None, None], PLAN_STEPS)
            if planned.error[0, 0] <= max(TOLERANCE, pool.error[0, 0]):
                pool = Pool(*(np.concatenate(parts, axis=1) for parts in zip(planned, pool, strict=True)))
        for width in TURNS[1:]:
            if pool.error[0, 0] <= (TOLERANCE if width == TURNS[1] else SLIGHT):
                break
            near = turn_little(prepared, previous, aim, width)
            pool = self._descend(near, target, proposal, seeds, lead, beside=free.command[0])
        return pool

    def _weigh(self, prepared: Prepared, target: Array, pool: Pool) -> Pool:
        """Trade error for energy, where the settings ask for the weighted sum."""
        weight = self.settings.energy_weight
        if weight == 0.0:
            return pool
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
        pool = self._refine(prepared, target, command, steps, steady)
        missed = pool.error[:, 0] > TOLERANCE
        if missed.any():
            self._insist(prepared, target, proposal, pool, missed, lead)
        return pool

    def _insist(
        self,
        prepared: Prepared,
        target: Array,
        proposal: Proposal,
        pool: Pool,
        missed: NDArray[np.bool_],
        lead: Lead,
    ) -> None:
        """Improve, in place, the answers to targets that were missed: they are hard, or out of reach."""
        self._try(prepared, target, pool, missed, None, FIRST_PATIENCE)
        missed = pool.error[:, 0] > TOLERANCE
        if not missed.any():
            return
        force = lead(prepared.planar, target[missed])
        if force is None:
            return
        needed = np.zeros(len(target))
        left = target[missed] - wrench_of(prepared.planar.columns, force)
        needed[missed] = np.linalg.norm(left, axis=-1)
        start, _ = force_space.realize(prepared.planar, force_space.polar(prepared.planar, force))
        self._try(prepared, target, pool, missed, start[:, None], NEAREST_PATIENCE)
        missed &= pool.error[:, 0] > np.maximum(TOLERANCE, NEEDLESS[0] + (1.0 + NEEDLESS[1]) * needed)
        if missed.any():
            fresh = _fresh_starts(prepared, proposal.command[missed], RESTARTS)
            self._try(prepared, target, pool, missed, fresh, LAST_PATIENCE)
        self._spare(prepared, target, pool)

    def _spare(self, prepared: Prepared, target: Array, pool: Pool) -> None:
        """Give inexact answers, in place, the amplitudes and frequencies by which their forces cost least."""
        missed = pool.error[:, 0] > TOLERANCE
        if missed.any():
            force = prepared.commands.fin.force(pool.command[missed, 0])[..., 1:]
            cheap, _ = force_space.realize(prepared.planar, force_space.polar(prepared.planar, force))
            self._try(prepared, target, pool, missed, cheap[:, None], SPARING_STEPS)

    def _try(
        self,
        prepared: Prepared,
        target: Array,
        pool: Pool,
        rows: NDArray[np.bool_],
        starts: Array | None,
        steps: int,
    ) -> None:
        """Refine some rows of a pool further, in place, together with new starts (rows, S, n, 3)."""
        command = pool.command[rows]
        if starts is not None:
            command = np.concatenate([command, prepared.commands.clamp(starts)], axis=1)
        longer = self._refine(prepared, target[rows], command, steps)
        for kept, new in zip(pool, longer, strict=True):
            kept[rows] = new[:, : kept.shape[1]]

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
        score = _rank(energy, error, PROMISING**2).reshape(rows, n_seeds)
        if steady:
            score[:, 0] = -1.0
        kept = (
            score.argsort(axis=1)[:, : keep or self.settings.n_refined]
            + np.arange(0, rows * n_seeds, n_seeds)[:, None]
        )
        return command.take(kept, axis=0)

    def _refine(
        self, prepared: Prepared, target: Array, command: Array, steps: int, steady: bool = False
    ) -> Pool:
        """Refined commands (N, P, n, 3), best first: the cheapest exact one, or the most exact one.

        With `steady`, the first command is how the robot moves now; another must save the share
        `SWITCH_GAIN` of its energy to take its place.
        """
        rows, p, n, _ = command.shape
        repeated = target if rows == 1 else np.repeat(target, p, axis=0)
        refined = refine(prepared.commands, repeated, command.reshape(-1, n, 3), steps)
        energy = prepared.energy(refined.command)
        cost = energy.reshape(rows, p)
        if steady:
            cost = cost.copy()
            cost[:, 0] *= 1.0 - SWITCH_GAIN
        error = refined.error.reshape(rows, p)
        order = _rank(cost, error, TOLERANCE, GRAIN).argsort(axis=1) + np.arange(0, rows * p, p)[:, None]
        return Pool(*(values.take(order, axis=0) for values in (*refined, energy)))


def _rank(energy: Array, error: Array, tolerance: float, grain: float = 0.0) -> Array:
    """What to sort answers by: the energy of exact ones, and behind them the error of the others.

    Errors in the same grain count as one, and the energy decides.
    """
    missed = error > tolerance
    if not missed.any():
        return energy
    coarse = grain * np.floor(error / grain) if grain else error
    return np.where(missed, INEXACT * (1.0 + coarse) + np.minimum(energy, grain * INEXACT), energy)


def _fresh_starts(prepared: Prepared, proposed: Array, count: int) -> Array:
    """Commands (N, count, n, 3): raw candidates of the network and random ones, half and half."""
    raw = proposed[:, : count // 2].astype(np.float64)
    lower, upper = prepared.commands.lower, prepared.commands.upper
    unit = np.random.default_rng(0).random((count - raw.shape[1], len(lower), 3))
    spread = np.broadcast_to(lower + unit * (upper - lower), (len(proposed), *unit.shape))
    return np.concatenate([raw, spread], axis=1)


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
