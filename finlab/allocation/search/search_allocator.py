"""The default method: the cheapest exact commands, searched for by the fins' own laws.

The stages are in `pipeline`; here are the policies, the batches and what is offered beside the answer.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from functools import lru_cache
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.evaluate import effort_of, power_of
from finlab.allocation.in_time import in_time
from finlab.allocation.policy import Policy
from finlab.allocation.question import usable_fins
from finlab.allocation.search.pipeline import SEARCH, Pipeline
from finlab.allocation.search.prepared import Prepared, resting_fins
from finlab.allocation.search.refined_candidates import FallbackForces, RefinedCandidates, nearest_forces
from finlab.allocation.search.settings import SearchSettings
from finlab.allocation.solution import Candidates, Solution
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.forces.cost_bound import cost_bound
from finlab.forces.fin_sets import planar_sets
from finlab.forces.force_space import PlanarProblem, descend
from finlab.forces.out_of_reach import Nearest, nearest, nearest_along, nearest_in_turn
from finlab.layout import Layout
from finlab.networks.normalization import Normalization
from finlab.networks.threads import single_threaded_products
from finlab.physics.objective import Objective

CHUNK = 512
"""Targets that are solved together; keeps memory flat for any number of targets."""


class Beginning(NamedTuple):
    """Where a search begins, other than from all fins and the sub-layouts; and how that is named."""

    seeds: Array | None = None
    """Planar forces (N, S, 2, n) [N]; None for sizes of forces that all targets share."""
    names: tuple[str, ...] | None = None
    """What the seeds of a single target are called; None for the fins that rest."""
    samples: Callable[[], Candidates] | None = None
    """The seeds of a single target as candidates, where they were drawn."""


class SearchAllocator(Allocator):
    """Exact on any fin whose law or table is known, without a network."""

    name = "search"
    # A smaller wrench in the same direction still turns a robot to where it should go; the nearest one may
    # only push it on.
    policy_under_way = "direction"
    settings_class = SearchSettings
    settings: SearchSettings

    def __init__(self, normalization: Normalization, **settings: Any) -> None:
        """Make it.

        Args:
            normalization: the yardstick of the error; nothing else is taken from a checkpoint.
            settings: fields of the method's settings.

        Raises:
            AllocationError: a setting that no search can work with.
        """
        self.normalization = normalization
        self.settings = self.settings_class(**settings)
        self.pipeline = Pipeline(normalization.std, self.settings)
        # All products here are too small to be shared among threads; chunks of targets are not.
        self._one_thread = single_threaded_products()

    @property
    def objective(self) -> Objective:
        """What is kept least."""
        return self.pipeline.objective

    def _made_with(self, options: dict[str, Any]) -> Self:
        other = copy(self)
        other.settings = self.settings_class(**options)
        if other.settings.aim == self.objective:  # all that is known of layouts depends on nothing else
            other.pipeline = self.pipeline.with_settings(other.settings)
        else:
            other.pipeline = Pipeline(self.normalization.std, other.settings)
        return other

    def _solve(
        self,
        layout: Layout,
        targets: Array,
        *,
        seed: int,
        previous: Array | None,
        fallback: FallbackForces = nearest_forces,
    ) -> Solution:
        prepared = self.pipeline.prepare(layout).at(self.flow, self.normalization.std)
        if len(targets) == 1:
            with self._one_thread():
                beginning = self._beginning(prepared, targets, seed)
                refined = self.pipeline.solve(
                    prepared, targets, previous, seeds=beginning.seeds, fallback=fallback
                )
            names = beginning.names or _seed_names(layout)
            if previous is not None:  # its own way is what the search begins with
                names = ("the way it moves now", *names)
            return self._single(prepared, targets, refined, names)._replace(samples=beginning.samples)

        def solve(start: int) -> RefinedCandidates:
            some = targets[start : start + CHUNK]
            seeds = self._beginning(prepared, some, seed + start).seeds
            return self.pipeline.solve(prepared, some, seeds=seeds, fallback=fallback)

        with self._one_thread(), ThreadPoolExecutor(os.cpu_count()) as executor:
            parts = list(executor.map(solve, range(0, len(targets), CHUNK)))
        return Solution(np.concatenate([part.command[:, 0] for part in parts]))

    def _beginning(self, prepared: Prepared, targets: Array, seed: int) -> Beginning:
        """Where the search for targets (N, 6) begins."""
        return Beginning()

    def _single(
        self, prepared: Prepared, targets: Array, refined: RefinedCandidates, names: tuple[str, ...]
    ) -> Solution:
        """The answer to one target (1, 6), and what may be asked about it; `names` of the seeds."""
        own = _sources(refined.origin[0], names)

        def explored() -> Candidates:
            found = self.pipeline.explore(prepared, targets, refined)
            # The answer's own candidates come first; the others are what the wider search has found.
            wider = found.origin[0, refined.origin.shape[1] :]
            source = own + _sources(wider, _seed_names(prepared.plant.layout))
            exact = max(SEARCH.alternative_error * prepared.exactness, 1.01 * found.error[0, 0])
            kept = np.flatnonzero(found.error[0] <= exact)
            exact_ones = RefinedCandidates._make(values[:, kept] for values in found)
            return self._candidates(prepared, exact_ones, tuple(source[k] for k in kept))

        return Solution(
            refined.command[:, 0],
            candidates=lambda: self._candidates(prepared, refined, own),
            alternatives=explored,
        )

    def _candidates(
        self, prepared: Prepared, refined: RefinedCandidates, source: tuple[str, ...]
    ) -> Candidates:
        """The refined answers to a single target, and where each comes from."""
        command, wrench, error, cost, _ = (values[0] for values in refined)
        layout, std = prepared.plant.layout, self.normalization.std
        # What was kept least is known already.
        power = cost if self.objective.is_power else power_of(layout, command)
        return Candidates(command, wrench * std, error, effort_of(layout, command), power, source)

    def bound(self, result: Allocation) -> float:
        """A lower bound on the power [W] of any answer to the question of a result, by the convex dual.

        It holds as far as the compiled fins do: to about one part in a thousand, and in a hundred where weak
        forces are asked of soft fins.

        Raises:
            AllocationError: effort is kept least, which has no such bound, or the wrench is out of reach, so
                that there is no exact answer.
        """
        if not self.objective.convex:
            raise AllocationError("bound: proven for power alone; take objective 'power'")
        if not result.reachable:
            raise AllocationError("bound: the wrench is out of reach, so no answer has a cost to bound")
        fins = usable_fins(result.layout, result.failed)
        prepared = self.pipeline.prepare(fins.healthy)
        wanted, seed = result.target / self.normalization.std, prepared.seeds[:1]
        planar = descend(prepared.planar, wanted[None], seed, SEARCH.bound_steps)
        least = cost_bound(prepared.planar, wanted, planar.multiplier[0])
        return min(least, float(prepared.cost(result.command[None, fins.alive])[0]))

    def _in_time(self, layout: Layout, target: Array, reference: Array) -> Array:
        return in_time(layout, target, reference, self.settings.period_s)

    def _check_policy(self, policy: Policy) -> None:
        """All policies are known."""

    def _solve_by(
        self, policy: Policy, layout: Layout, target: Array, *, seed: int, previous: Array | None
    ) -> Solution:
        if policy.is_plain:
            return self._solve(layout, target, seed=seed, previous=previous)
        missed = []

        def give_up(*_: object) -> None:
            missed.append(True)

        plain = self._solve(layout, target, seed=seed, previous=previous, fallback=give_up)
        # What servos alone hold back is within reach, and comes at one of the next ticks.
        if not missed or self._reaches(layout, plain, target)[0]:
            return plain
        # What the policy asks for within reach is one wrench; that one is then delivered as any other.
        std = self.normalization.std
        served = _within_reach(self.pipeline.prepare(layout).planar, policy, target[0] / std)
        return self._solve(
            layout, served.wrench * std, seed=seed, previous=previous, fallback=lambda *_: served.force
        )


def _within_reach(problem: PlanarProblem, policy: Policy, target: Array) -> Nearest:
    """The one wrench to deliver in place of one that is out of reach, normalized, and forces that do so.

    Args:
        problem: the layout.
        policy: what counts.
        target: the wrench (6,) that was asked for.
    """
    sets = planar_sets(problem)
    if policy.kind == "direction":
        return nearest_along(sets, target)
    if policy.kind == "priority":
        return nearest_in_turn(sets, target, policy.groups)
    weights = np.array(policy.axis_weights, np.float64)
    with np.errstate(divide="ignore"):
        return nearest(sets, target[None], (weights.max() / weights) ** 2)


def _sources(origin: NDArray[np.intp], names: tuple[str, ...]) -> tuple[str, ...]:
    """Where answers come from: the names of their seeds."""
    return tuple([names[k] if 0 <= k < len(names) else "another start" for k in origin.tolist()])


@lru_cache(maxsize=128)
def _seed_names(layout: Layout) -> tuple[str, ...]:
    """What a candidate is called by the fins that its seed rests."""
    names = layout.names
    rests = [
        f"without {' and '.join(names[i] for i in fins)}" if fins else "all fins"
        for fins in resting_fins(len(names))
    ]
    return (*rests, *["all fins, unevenly"] * len(names))
