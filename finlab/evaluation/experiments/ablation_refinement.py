"""The paper's pipeline with Levenberg-Marquardt steps in place of Adam's; all other stages are the same."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from finlab.allocation.learned.paper import PaperAllocator
from finlab.inference.weights import TrainedWeights
from finlab.training.networks.mixture import to_command, to_normalized

STEPS = 20
"""A step differentiates six wrench components where Adam's differentiates one score: 20 steps take about as
long as the 80 of Adam."""
DAMPING = 1e-4
"""First damping of every candidate, in normalized error per half a limit range, squared."""


class PaperWithLevenbergMarquardt(PaperAllocator):
    """Method `paper`, refined by Levenberg-Marquardt on the surrogate's error."""

    def __init__(self, weights: TrainedWeights, *, n_lm_steps: int = STEPS, **options: Any) -> None:
        """Make it from the weights of a checkpoint.

        Args:
            weights: as for `PaperAllocator`.
            n_lm_steps: Levenberg-Marquardt steps.
            options: of `PaperAllocator`.
        """
        super().__init__(weights, **options)
        self.n_lm_steps = n_lm_steps

    def _adam(self, robot: Any, command: Tensor, target: Tensor) -> Tensor:
        """Refined commands (N, K, n, 3); steps that make a candidate worse are undone."""
        x = to_normalized(command, robot.lower, robot.upper)
        wanted = target[:, None]
        damping = torch.full(x.shape[:2], DAMPING)
        error, jacobian = self._error_and_jacobian(robot, x, wanted)
        for _ in range(self.n_lm_steps):
            trial = (x + _step(x, error, jacobian, damping)).clamp(-1.0, 1.0)
            new_error, new_jacobian = self._error_and_jacobian(robot, trial, wanted)
            better = new_error.square().sum(-1) < error.square().sum(-1)
            damping = torch.where(better, damping * 0.2, damping * 10.0 + 1e-6)
            x = torch.where(better[..., None, None], trial, x)
            error = torch.where(better[..., None], new_error, error)
            jacobian = torch.where(better[..., None, None], new_jacobian, jacobian)
        return to_command(x, robot.lower, robot.upper)

    def _error_and_jacobian(self, robot: Any, x: Tensor, wanted: Tensor) -> tuple[Tensor, Tensor]:
        """Normalized error (N, K, 6) of positions x (N, K, n, 3) between the limits, and its derivatives
        (N, K, 6, 3 n)."""
        x = x.detach().requires_grad_(True)
        wrench = self._wrench(robot, to_command(x, robot.lower, robot.upper))
        error = (wrench - self._mean) / self._std - wanted
        rows = [
            torch.autograd.grad(error[..., axis].sum(), x, retain_graph=axis < 5)[0].flatten(-2)
            for axis in range(6)
        ]
        return error.detach(), torch.stack(rows, dim=-2)


def _step(x: Tensor, error: Tensor, jacobian: Tensor, damping: Tensor) -> Tensor:
    """Smallest damped change (N, K, n, 3) that cancels the error to first order; what sits at a limit and
    would leave it is held."""
    at = x.flatten(-2)
    free = jacobian
    for _ in range(2):
        gram = free @ free.transpose(-1, -2) + damping[..., None, None] * torch.eye(6)
        change = -(free.transpose(-1, -2) @ torch.linalg.solve(gram, error[..., None]))[..., 0]
        leaves = ((at <= -1.0) & (change < 0)) | ((at >= 1.0) & (change > 0))
        free = free.masked_fill(leaves[..., None, :], 0.0)
    return change.reshape(x.shape)
