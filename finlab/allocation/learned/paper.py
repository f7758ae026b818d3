"""The paper's own pipeline: sample the mixture, rank by the surrogate, refine with Adam."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from finlab.allocation.allocation import Candidates, Solution
from finlab.allocation.allocator import Allocator
from finlab.errors import AllocationError
from finlab.inference.features import fin_frame_features, geometry, raw_features
from finlab.inference.weights import TrainedWeights
from finlab.layout import FinModelSpec, Layout, stack_layouts
from finlab.physics.energy import command_energy
from finlab.training.data.sampling import seeded_generator
from finlab.training.networks.checkpoint import Checkpoint
from finlab.training.networks.mixture import Mixture, clamp_to_limits, to_command, to_normalized

Array = NDArray[np.float64]

CHUNK = 250
"""Targets that are solved together; keeps memory flat for any number of targets."""
ADAM_RATE = 0.03
"""Adam's step, in units of half a limit range."""


class PaperAllocator(Allocator):
    """Mixture density network, physics-guided ranking and gradient refinement, as printed.

    What the paper does not print is a choice made here: gamma, Adam's rate, the number of refined
    candidates and steps.
    """

    name = "paper"

    def __init__(
        self,
        weights: TrainedWeights,
        *,
        n_candidates: int = 64,
        temperature: float = 0.02,
        gamma: float = 1e-4,
        n_refined: int = 2,
        n_steps: int = 80,
        warm_start: str = "mdn",
        ranking: str = "physics",
        refine: bool = True,
        mean_only: bool = False,
    ) -> None:
        """Make it from the weights of a checkpoint.

        Args:
            weights: trained networks of any preset.
            n_candidates: number K of candidates drawn from the mixture.
            temperature: T of the sampling; 0.02 in the paper.
            gamma: weight of the energy in J = J_norm + gamma J_en.
            n_refined: best-ranked candidates that are refined.
            n_steps: Adam steps.
            warm_start: `mdn` samples the mixture, `random` draws uniform commands (ablation).
            ranking: `physics` ranks by J, `nll` by the mixture's likelihood (ablation).
            refine: whether to refine at all (ablation).
            mean_only: take the mixture's mean and nothing else (ablation).
        """
        weights.check_network()
        for value, known, key in (
            (warm_start, ("mdn", "random"), "warm_start"),
            (ranking, ("physics", "nll"), "ranking"),
        ):
            if value not in known:
                raise AllocationError(f"{key}: expected one of {', '.join(known)}, got {value!r}")
        checkpoint = Checkpoint.of(weights)
        assert checkpoint.network is not None
        self.weights, self.checkpoint = weights, weights.name
        self.normalization = weights.normalization
        self.fin_model = FinModelSpec.from_values(weights.fin_model)
        self.network, self.surrogate = checkpoint.network, checkpoint.surrogate
        self.n_candidates, self.temperature, self.gamma = n_candidates, temperature, gamma
        self.n_refined, self.n_steps = n_refined, n_steps
        self.warm_start, self.ranking, self.refine, self.mean_only = warm_start, ranking, refine, mean_only
        self._mean, self._std = (torch.tensor(v, dtype=torch.float32) for v in self.normalization)

    def _made_with(self, options: dict[str, Any]) -> PaperAllocator:
        return PaperAllocator(self.weights, **options)

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        robot = _Robot(layout)
        parts = []
        for start in range(0, len(targets), CHUNK):
            parts.append(
                self._solve_chunk(robot, targets[start : start + CHUNK], seed + start, len(targets) == 1)
            )
        if len(parts) == 1:
            return parts[0]
        wrench = [part.wrench_surrogate for part in parts if part.wrench_surrogate is not None]
        return Solution(np.concatenate([part.command for part in parts]), np.concatenate(wrench))

    def _solve_chunk(self, robot: _Robot, targets: Array, seed: int, keep: bool) -> Solution:
        target = (torch.tensor(targets, dtype=torch.float32) - self._mean) / self._std
        generator = seeded_generator(seed, stream=0)
        with torch.no_grad():
            mixture = self._predict(robot, target)
            if self.mean_only:
                x = _mean_of(mixture)[:, None]
            elif self.warm_start == "random":
                shape = (len(targets), self.n_candidates, robot.n, 3)
                x = 2.0 * torch.rand(shape, generator=generator) - 1.0
            else:
                x = mixture.sample(self.n_candidates, self.temperature, generator)
            command = clamp_to_limits(to_command(x, robot.lower, robot.upper), robot.lower, robot.upper)
            score = self._score(robot, command, target)
            if self.ranking == "nll" and not self.mean_only:
                score = -self._likelihood(robot, mixture, command)
            best = score.topk(min(self.n_refined, score.shape[1]), largest=False).indices
            chosen = command.gather(1, best[..., None, None].expand(-1, -1, robot.n, 3))
        if self.refine and not self.mean_only:
            chosen = self._adam(robot, chosen, target)
        with torch.no_grad():
            # Without physics in the ranking the likeliest candidate stays the answer.
            order = self._score(robot, chosen, target).argsort(1)
            if self.ranking == "nll":
                order = torch.arange(chosen.shape[1]).expand(len(targets), -1)
            chosen = chosen.gather(1, order[..., None, None].expand(-1, -1, robot.n, 3))
            wrench = self._wrench(robot, chosen[:, :1])[:, 0]
        answer = robot.inside(chosen)
        solution = Solution(answer[:, 0], wrench.numpy().astype(np.float64))
        if not keep:
            return solution
        return solution._replace(
            candidates=lambda: self._candidates(robot, chosen, target, "refined"),
            samples=lambda: self._candidates(robot, command, target, "sample"),
        )

    def _predict(self, robot: _Robot, target: Tensor) -> Mixture:
        layout = (robot.position, robot.angle, robot.lower[None], robot.upper[None])
        if self.network.config.features == "raw":
            x = raw_features(*layout).expand(len(target), -1, -1)
        else:
            x = fin_frame_features(geometry(*layout, self._std), target)
        limits = (robot.lower.expand(len(target), -1, -1), robot.upper.expand(len(target), -1, -1))
        return self.network(x, target, *limits)

    def _wrench(self, robot: _Robot, command: Tensor) -> Tensor:
        """Wrenches (N, K, 6) of commands (N, K, n, 3) by the surrogate."""
        return self.surrogate(command, robot.position[0], robot.angle[0], robot.lower, robot.upper)

    def _score(self, robot: _Robot, command: Tensor, target: Tensor) -> Tensor:
        """J = J_norm + gamma J_en (N, K), by the surrogate."""
        error = (self._wrench(robot, command) - self._mean) / self._std - target[:, None]
        a, f, d = (command / robot.upper.abs().clamp_min(1e-3)).unbind(-1)
        energy = (a * a + f * f + 0.1 * d * d + a * f).sum(-1)
        return error.square().sum(-1) + self.gamma * energy

    def _likelihood(self, robot: _Robot, mixture: Mixture, command: Tensor) -> Tensor:
        """Log likelihood (N, K) of commands (N, K, n, 3)."""
        x = to_normalized(command, robot.lower, robot.upper)
        mask = torch.ones(x.shape[0], robot.n, dtype=torch.bool)
        return torch.stack([mixture.log_prob(x[:, k], mask) for k in range(x.shape[1])], dim=1)

    def _adam(self, robot: _Robot, command: Tensor, target: Tensor) -> Tensor:
        """Adam on the commands through the surrogate, inside the limits; keeps the best step of each."""
        x = to_normalized(command, robot.lower, robot.upper).requires_grad_(True)
        optimizer = torch.optim.Adam([x], lr=ADAM_RATE)
        for step in range(self.n_steps):
            optimizer.param_groups[0]["lr"] = ADAM_RATE * (1.0 - 0.95 * step / self.n_steps)
            score = self._score(robot, to_command(x, robot.lower, robot.upper), target)
            (x.grad,) = torch.autograd.grad(score.sum(), x)
            optimizer.step()
            with torch.no_grad():
                x.clamp_(-1.0, 1.0)
        return to_command(x.detach(), robot.lower, robot.upper)

    def _candidates(self, robot: _Robot, command: Tensor, target: Tensor, source: str) -> Candidates:
        """Candidates of a single target, best first; commands (1, K, n, 3)."""
        with torch.no_grad():
            wrench = self._wrench(robot, command)
            error = (((wrench - self._mean) / self._std) - target[:, None]).norm(dim=-1)[0]
        order = error.argsort()
        inside = robot.inside(command[:, order])[0]
        energy = command_energy(inside, robot.upper.numpy())
        pick = wrench[0, order].numpy().astype(np.float64), error[order].numpy().astype(np.float64)
        return Candidates(inside, pick[0], pick[1], energy, (source,) * len(energy))


class _Robot:
    """One layout as float32 tensors."""

    def __init__(self, layout: Layout) -> None:
        arrays = stack_layouts([layout])
        self._lower, self._upper = arrays.lower[0], arrays.upper[0]
        self.position = torch.tensor(arrays.position, dtype=torch.float32)
        self.angle = torch.tensor(arrays.mounting_angle, dtype=torch.float32)
        self.lower = torch.tensor(self._lower, dtype=torch.float32)
        self.upper = torch.tensor(self._upper, dtype=torch.float32)
        self.n = layout.n_fins

    def inside(self, command: Tensor) -> Array:
        """Commands in double precision, inside the limits to the last bit."""
        return np.clip(command.numpy().astype(np.float64), self._lower, self._upper)


def _mean_of(mixture: Mixture) -> Tensor:
    """Mean (N, n, 3) of a mixture, in normalized coordinates."""
    weight = mixture.logits.softmax(-1)
    weight = weight[:, None, :, None] if mixture.joint else weight[..., None]
    return (weight * mixture.mean).sum(2)
