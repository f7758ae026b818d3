"""The learned allocator: a network proposes, the surrogate ranks, a search finds the cheapest answer.

Only the learned surrogate is used here; the analytic fin model scores the answer afterwards. The stages
are in `pipeline`; here are the policies, the batches and the notes to the user.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import fields
from functools import cache
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.allocator import Allocator
from finlab.allocation.learned.levenberg_marquardt import refine
from finlab.allocation.learned.pipeline import SEARCH, Pipeline
from finlab.allocation.learned.prepared import Prepared
from finlab.allocation.learned.proposal import Proposal, predict
from finlab.allocation.learned.refined_candidates import FallbackForces, RefinedCandidates, nearest_forces
from finlab.allocation.learned.settings import Settings
from finlab.allocation.policy import Policy
from finlab.allocation.solution import Candidates, Insight, Solution
from finlab.errors import CheckpointError
from finlab.forces.force_space import PlanarProblem
from finlab.forces.nearest import Nearest, nearest, nearest_along, nearest_in_turn
from finlab.inference.features import fin_frame_features
from finlab.inference.threads import single_threaded_products
from finlab.inference.weights import TrainedWeights
from finlab.layout import FinModelSpec, Layout
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights

Array = NDArray[Any]

CHUNK = 256
"""Targets that are solved together; keeps memory flat for any number of targets."""


class LearnedAllocator(Allocator):
    """The product's default method."""

    name = "learned"
    weights: TrainedWeights

    def __init__(
        self,
        weights: TrainedWeights,
        *,
        energy_weights: EnergyWeights = DEFAULT_WEIGHTS,
        **settings: Any,
    ) -> None:
        """Make it from the weights of a checkpoint.

        Args:
            weights: trained weights.
            energy_weights: by which answers are compared; `POWER_WEIGHTS` for the least inertial power.
            settings: fields of `Settings`.

        Raises:
            AllocationError: settings that leave nothing to answer with.
            CheckpointError: the checkpoint's networks are of another kind.
        """
        _check_kind(weights)
        if not isinstance(energy_weights, EnergyWeights):
            raise TypeError(f"energy_weights: expected EnergyWeights, got {energy_weights!r}")
        self.settings = Settings(**settings)
        self.weights, self.checkpoint = weights, weights.name
        self.normalization = weights.normalization
        self.energy_weights = energy_weights
        self.pipeline = Pipeline(self.weights, self.settings, energy_weights)
        # All products here are too small to be shared among threads; chunks of targets are not.
        self._one_thread = single_threaded_products()
        self.fin_model = FinModelSpec.from_values(self.weights.fin_model)

    @classmethod
    def option_names(cls) -> list[str]:
        """Names of the settings."""
        return ["energy_weights", *(field.name for field in fields(Settings))]

    @property
    def options(self) -> dict[str, Any]:
        """Present settings, by name."""
        return {"energy_weights": self.energy_weights, **vars(self.settings)}

    def _made_with(self, options: dict[str, Any]) -> Self:
        energy_weights = options.pop("energy_weights")
        if energy_weights != self.energy_weights:
            return type(self)(self.weights, energy_weights=energy_weights, **options)
        # Networks, and what is known of layouts, do not depend on the settings.
        other = copy(self)
        other.settings = Settings(**options)
        other.pipeline = self.pipeline.with_settings(other.settings)
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
        prepared = self.pipeline.prepare(layout)
        if len(targets) == 1:
            with self._one_thread():
                refined, proposal = self.pipeline.solve(prepared, targets, seed, previous, fallback=fallback)
            std = self.normalization.std
            return Solution(
                refined.command[:, 0],
                refined.wrench[:, 0] * std,
                candidates=lambda: _candidates(refined, std),
                samples=lambda: _samples(proposal, prepared, std),
                alternatives=lambda: _alternatives(
                    self.pipeline.explore(prepared, targets, refined, proposal), std
                ),
            )

        def solve(start: int) -> RefinedCandidates:
            return self.pipeline.solve(prepared, targets[start : start + CHUNK], seed + start, None)[0]

        with self._one_thread(), ThreadPoolExecutor(os.cpu_count()) as executor:
            parts = list(executor.map(solve, range(0, len(targets), CHUNK)))
        command = np.concatenate([part.command[:, 0] for part in parts])
        wrench = np.concatenate([part.wrench[:, 0] for part in parts]) * self.normalization.std
        return Solution(command, wrench)

    def insight(self, layout: Layout, wrench: ArrayLike) -> Insight:
        """What the network makes of a target (6,) [N, N m] for a layout whose fins all work."""
        prepared, network = self.pipeline.prepare(layout), self.pipeline.network
        centred = (np.asarray(wrench, dtype=float)[None] - self.normalization.mean) / self.normalization.std
        mixture = predict(network, prepared, centred)
        features = fin_frame_features(prepared.geometry, centred).astype(np.float32)
        arrays = (mixture.weight, mixture.mean, mixture.std, network.attention(features))
        return Insight(*(np.asarray(values[0], dtype=float) for values in arrays))

    def refined(self, layout: Layout, wrench: ArrayLike, command: Array, n_steps: int) -> Array:
        """A command (n, 3) of fins that all work after some Levenberg-Marquardt steps."""
        target = np.asarray(wrench, dtype=float)[None] / self.normalization.std
        found = refine(self.pipeline.prepare(layout).commands, target, command[None], n_steps)
        return np.asarray(found.command[0])

    def _surrogate_forces(self, layout: Layout, command: Array) -> Array:
        fins = self.pipeline.prepare(layout).commands
        axes = fins.columns[..., :3] * self.normalization.std[:3]  # of each fin, in the body frame
        forces: Array = np.matmul(fins.fin.force(command)[..., None, :], axes)[..., 0, :]
        return forces

    def _check_policy(self, policy: Policy) -> None:
        """All policies are known."""

    def _solve_by(
        self, policy: Policy, layout: Layout, target: Array, *, seed: int, previous: Array | None
    ) -> Solution:
        if policy.is_plain:
            return self._solve(layout, target, seed=seed, previous=previous)
        plain = self._solve(layout, target, seed=seed, previous=previous, fallback=lambda *_: None)
        if self._reaches(layout, plain, target)[0]:
            return plain
        # What the policy asks for within reach is one wrench; that one is then delivered as any other.
        std = self.normalization.std
        served = _within_reach(self.pipeline.prepare(layout).planar, policy, target[0] / std)
        return self._solve(
            layout, served.wrench * std, seed=seed, previous=previous, fallback=lambda *_: served.force
        )


def _check_kind(weights: TrainedWeights) -> None:
    """Raise a `CheckpointError` for networks that this method cannot work with."""
    if weights.surrogate_config.kind != "coefficient":
        raise CheckpointError(
            f"checkpoint {weights.name!r}: method `learned` needs a surrogate of kind `coefficient`, "
            f"got {weights.surrogate_config.kind!r}; use method `paper` with this checkpoint"
        )
    if not weights.check_network().joint:
        raise CheckpointError(f"checkpoint {weights.name!r}: method `learned` needs a joint-mixture network")


def _within_reach(problem: PlanarProblem, policy: Policy, target: Array) -> Nearest:
    """The one wrench to deliver in place of one that is out of reach, normalized, and forces that do so.

    Args:
        problem: the layout.
        policy: what counts.
        target: the wrench (6,) that was asked for.
    """
    if policy.kind == "direction":
        return nearest_along(problem.sets, target)
    if policy.kind == "priority":
        return nearest_in_turn(problem.sets, target, policy.groups)
    weights = np.array(policy.axis_weights, np.float64)
    with np.errstate(divide="ignore"):
        return nearest(problem.sets, target[None], (weights.max() / weights) ** 2)


def _candidates(refined: RefinedCandidates, std: Array) -> Candidates:
    """The refined answers to a single target."""
    command, wrench, error, energy = (values[0] for values in refined)
    return Candidates(command, wrench * std, error, energy, ("refined",) * len(command))


def _alternatives(refined: RefinedCandidates, std: Array) -> Candidates:
    """The exact answers to a single target, the chosen one first; all where none is exact."""
    exact = refined.error[0] <= max(SEARCH.alternative_error, 1.01 * refined.error[0, 0])
    return _candidates(RefinedCandidates(*(values[:, exact] for values in refined)), std)


def _samples(proposal: Proposal, prepared: Prepared, std: Array) -> Candidates:
    """The raw candidates for a single target."""
    order = proposal.error[0].argsort()
    command = np.maximum(proposal.command[0].take(order, axis=0), prepared.lower)
    return Candidates(
        # Rounded to single precision, limits may be a bit wider.
        np.minimum(command, prepared.upper, out=command),
        proposal.wrench[0].take(order, axis=0) * std,
        proposal.error[0].take(order),
        proposal.energy[0].take(order).astype(np.float64),
        tuple(map(_component_name, proposal.component[0].take(order).tolist())),
    )


@cache
def _component_name(k: int) -> str:
    """What a sample is called that was drawn from a component of the mixture."""
    return f"mode {k + 1}"
