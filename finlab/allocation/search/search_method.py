"""The default method: the cheapest exact commands, searched for by the fins' own laws.

The stages are in `pipeline`; here are the policies, the batches and what is offered beside the answer.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.evaluate import REACHED, effort_of, power_of
from finlab.allocation.in_time import in_time
from finlab.allocation.method import Method, Takes
from finlab.allocation.policy import Policy
from finlab.allocation.search.pipeline import SEARCH, Pipeline
from finlab.allocation.search.prepared import Prepared, resting_fins
from finlab.allocation.search.refined_candidates import FallbackForces, RefinedCandidates, nearest_forces
from finlab.allocation.search.settings import SearchSettings
from finlab.allocation.settings import Settings
from finlab.allocation.solution import Candidates, Solution
from finlab.arrays import Array
from finlab.forces.fin_sets import planar_sets
from finlab.forces.force_space import PlanarProblem
from finlab.forces.out_of_reach import Nearest, nearest, nearest_along, nearest_in_turn
from finlab.layout import Layout
from finlab.networks.threads import single_threaded_products
from finlab.networks.trained import TrainedWeights
from finlab.physics.objective import Objective

USUAL_SHARE = 0.1
"""What a robot is mostly asked for, as a share of its yardstick."""
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


class Search(Method):
    """Exact on any fin whose law or table is known, without a network."""

    name = "dual"
    takes: ClassVar[Takes] = "fins"
    # A smaller wrench in the same direction still turns a robot to where it should go; the nearest one may
    # only push it on.
    policy_under_way = "direction"
    settings_class = SearchSettings
    settings: SearchSettings

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, weights: TrainedWeights | None = None
    ) -> None:
        super().__init__(layout, settings, scale, weights)
        self.sigma = USUAL_SHARE * scale if weights is None else weights.normalization.std
        self.pipeline = Pipeline(self.sigma, self.settings)
        self.prepared = self.pipeline.prepare(layout)
        # All products here are too small to be shared among threads; chunks of targets are not.
        self._one_thread = single_threaded_products()

    @property
    def objective(self) -> Objective:
        """What is kept least."""
        return self.pipeline.objective

    def _solve(
        self,
        targets: Array,
        *,
        seed: int,
        previous: Array | None,
        fallback: FallbackForces = nearest_forces,
    ) -> Solution:
        prepared = self.prepared
        if len(targets) == 1:
            with self._one_thread():
                beginning = self._beginning(prepared, targets, seed)
                refined = self.pipeline.solve(
                    prepared, targets, previous, seeds=beginning.seeds, fallback=fallback
                )
            return self._single(targets[0], refined, self._names(beginning, previous))._replace(
                samples=beginning.samples
            )

        def solve(start: int) -> RefinedCandidates:
            some = targets[start : start + CHUNK]
            seeds = self._beginning(prepared, some, seed + start).seeds
            return self.pipeline.solve(prepared, some, seeds=seeds, fallback=fallback)

        with self._one_thread(), ThreadPoolExecutor(os.cpu_count()) as executor:
            parts = list(executor.map(solve, range(0, len(targets), CHUNK)))
        return Solution(np.concatenate([part.command[:, 0] for part in parts]))

    def _names(self, beginning: "Beginning", previous: Array | None) -> tuple[str, ...]:
        """What the seeds of a single target are called."""
        names = beginning.names or _seed_names(self.layout)
        # The robot's own way is what the search begins with.
        return names if previous is None else ("the way it moves now", *names)

    def _beginning(self, prepared: Prepared, targets: Array, seed: int) -> Beginning:
        """Where the search for targets (N, 6) begins."""
        return Beginning()

    def _single(self, target: Array, refined: RefinedCandidates, names: tuple[str, ...]) -> Solution:
        """The answer to one target (1, 6), and what may be asked about it; `names` of the seeds."""
        own = _sources(refined.origin[0], names)
        return Solution(refined.command[:, 0], candidates=lambda: self._candidates(target, refined, own))

    def alternatives(
        self, target: Array, *, policy: Policy, previous: Array | None, flow: Array | None, seed: int
    ) -> Candidates | None:
        """See `Method`."""
        prepared, targets = self.prepared, target[None]
        if (moved := self.at(flow)) is not self:
            return moved.alternatives(target, policy=policy, previous=previous, flow=None, seed=seed)
        solution = self.solve(targets, policy=policy, previous=previous, seed=seed)
        assert solution.candidates is not None
        first = solution.candidates()
        with self._one_thread():
            found = self.pipeline.explore(prepared, targets)
        own = np.linalg.norm((first.wrench[0] - target) / self.sigma)
        exact = max(SEARCH.alternative_error * prepared.exactness, 1.01 * float(own))
        kept = np.flatnonzero(found.error[0] <= exact)
        others = RefinedCandidates._make(values[:, kept] for values in found)
        source = _sources(others.origin[0], _seed_names(self.layout))
        # The answer's own candidates come first; the others are what the wider search has found.
        return first.beside(self._candidates(target, others, source))

    def _candidates(self, target: Array, refined: RefinedCandidates, source: tuple[str, ...]) -> Candidates:
        """The refined answers to a single target (6,), and where each comes from."""
        command, wrench, _, cost, _ = (values[0] for values in refined)
        given = wrench * self.sigma
        error = np.linalg.norm((given - target) / self.scale, axis=-1)
        # What was kept least is known already.
        power = cost if self.objective.is_power else power_of(self.layout, command)
        return Candidates(command, given, error, effort_of(self.layout, command), power, source)

    def at(self, flow: Array | None) -> Self:
        """See `Method`."""
        other = super().at(flow)
        if other is not self:
            other.prepared = self.prepared.at(flow, self.sigma)
        return other

    def in_time(self, target: Array, reference: Array) -> Array:
        """See `Method`."""
        return in_time(self.layout, target, reference, self.settings.period_s)

    def solve(
        self,
        targets: Array,
        *,
        policy: Policy,
        previous: Array | None = None,
        flow: Array | None = None,
        seed: int = 0,
    ) -> Solution:
        """See `Method`."""
        if len(targets) == 0:
            return Solution(np.empty((0, self.layout.n_fins, 3)))
        if (moved := self.at(flow)) is not self:
            return moved.solve(targets, policy=policy, previous=previous, seed=seed)
        if len(targets) == 1:
            return self._solve_by(policy, targets, seed=seed, previous=previous)
        solution = self._solve(targets, seed=seed, previous=None)
        if not policy.is_plain:
            command = solution.command
            error = np.linalg.norm((self.plant.wrench(command) - targets) / self.scale, axis=-1)
            for row in np.flatnonzero(error > REACHED):
                one = self._solve_by(policy, targets[row : row + 1], seed=seed, previous=None)
                command[row] = one.command[0]
        return solution

    def _solve_by(self, policy: Policy, target: Array, *, seed: int, previous: Array | None) -> Solution:
        if policy.is_plain:
            return self._solve(target, seed=seed, previous=previous)
        missed = []

        def give_up(*_: object) -> None:
            missed.append(True)

        plain = self._solve(target, seed=seed, previous=previous, fallback=give_up)
        error = np.linalg.norm((self.plant.wrench(plain.command[0]) - target[0]) / self.scale)
        # What servos alone hold back is within reach, and comes at one of the next ticks.
        if not missed or error <= REACHED:
            return plain
        # What the policy asks for within reach is one wrench; that one is then delivered as any other.
        served = _within_reach(self.prepared.planar, policy, target[0] / self.sigma, self.scale / self.sigma)
        return self._solve(
            served.wrench * self.sigma, seed=seed, previous=previous, fallback=lambda *_: served.force
        )


def _within_reach(problem: PlanarProblem, policy: Policy, target: Array, scale: Array) -> Nearest:
    """The one wrench to deliver in place of one that is out of reach, normalized, and forces that do so.

    Args:
        problem: the layout.
        policy: what counts.
        target: the wrench (6,) that was asked for.
        scale: what the axis weights of a policy are given for (6,), normalized.
    """
    sets = planar_sets(problem)
    if policy.kind == "direction":
        return nearest_along(sets, target)
    if policy.kind == "priority":
        return nearest_in_turn(sets, target, policy.groups)
    weights = np.array(policy.axis_weights, np.float64) / scale
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
