"""Mixture densities over fin commands, in coordinates where every limit range is [-1, 1].

Two kinds share one code. In the paper each fin has its own mixture, so the components of different
fins are sampled apart and need not belong together. A *joint* mixture has one weight per component
for the whole robot: component k of all fins is one coherent way to move.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor


class Mixture(NamedTuple):
    """A mixture of M diagonal Gaussians per fin, for B robots of n fins."""

    logits: Tensor
    """Unnormalized log weights: (B, M) for a joint mixture, (B, n, M) for one mixture per fin."""
    mean: Tensor
    """Means (B, n, M, 3) in normalized coordinates."""
    log_std: Tensor
    """Log standard deviations (B, n, M, 3) in normalized coordinates."""
    wraps: Tensor
    """True (B, n) where the zero direction is a full circle and is treated as an angle of period 2."""

    @property
    def joint(self) -> bool:
        """Whether one component is chosen for all fins together."""
        return self.logits.dim() == 2

    def deviation(self, x: Tensor) -> Tensor:
        """Difference x - mean (B, n, M, 3) of normalized commands x (B, n, 3), wrapped where angles wrap."""
        delta = x[:, :, None] - self.mean
        wrapped = torch.remainder(delta[..., 2] + 1.0, 2.0) - 1.0
        last = torch.where(self.wraps[:, :, None], wrapped, delta[..., 2])
        return torch.cat([delta[..., :2], last[..., None]], dim=-1)

    def log_prob(self, x: Tensor, mask: Tensor) -> Tensor:
        """Log likelihood (B,) of normalized commands x (B, n, 3); padded fins (mask False) count nothing."""
        z = self.deviation(x) * torch.exp(-self.log_std)
        log_normal = (-0.5 * z.square() - self.log_std - 0.5 * math.log(2 * math.pi)).sum(-1)  # (B, n, M)
        log_weight = self.logits.log_softmax(-1)
        if self.joint:
            return torch.logsumexp(log_weight + (log_normal * mask[..., None]).sum(1), dim=-1)
        return (torch.logsumexp(log_weight + log_normal, dim=-1) * mask).sum(1)

    def sample(
        self,
        n_samples: int,
        temperature: float,
        generator: torch.Generator | None = None,
        *,
        share: tuple[slice, int] | None = None,
    ) -> Tensor:
        """Draw normalized commands (B, n_samples, n, 3).

        Temperature T sharpens the choice of component (weights to the power 1/T) and scales the
        variance of each Gaussian by T, as usual for mixture density networks; T = 1 samples the
        density itself.

        Args:
            n_samples: how many.
            temperature: T, from 0.
            generator: source of randomness.
            share: which rows of a larger batch these are, and its size; the noise is that of the larger
                batch, however it is shared among processes.
        """
        batch, n, m, _ = self.mean.shape
        rows, total = share or (slice(0, batch), batch)
        size = (total, n_samples) if self.joint else (total, n, n_samples)
        dtype, device = self.mean.dtype, self.mean.device
        draw = torch.rand(size, generator=generator, dtype=dtype, device=device)[rows]
        noise = torch.randn((total, n, n_samples, 3), generator=generator, dtype=dtype, device=device)[rows]
        cumulative = (self.logits / max(temperature, 1e-6)).softmax(-1).cumsum(-1)
        choice = (draw[..., None] > cumulative[..., None, :]).sum(-1).clamp(max=m - 1)
        if self.joint:
            choice = choice[:, None].expand(batch, n, n_samples)
        index = choice[..., None].expand(-1, -1, -1, 3)
        mean, std = self.mean.gather(2, index), self.log_std.gather(2, index).exp()
        return (mean + math.sqrt(temperature) * std * noise).transpose(1, 2)
