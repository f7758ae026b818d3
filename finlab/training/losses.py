"""The terms of the training loss. Each answers one number per sample (B,), so that any split of a batch
over processes gives the same mean."""

import torch
from torch import Tensor

from finlab.inference.normalization import clamp_to_limits, to_command, to_normalized
from finlab.physics.energy import fin_energy
from finlab.training.networks.allocator_network import Mixture
from finlab.training.networks.surrogate import Surrogate
from finlab.training.presets import AllocatorTraining
from finlab.training.sampling import Batch

HUBER = 0.02
"""Normalized wrench error below which the guidance is quadratic and above which it is linear: linear
growth makes exact tracking win over energy, and the corner keeps gradients finite."""


def imitation(mixture: Mixture, batch: Batch, *, spread_only: bool) -> Tensor:
    """Negative log-likelihood of the recorded commands (paper: L_imit).

    With `spread_only`, means and weights are held and only the standard deviations learn from it.
    """
    if spread_only:
        mixture = mixture._replace(mean=mixture.mean.detach(), logits=mixture.logits.detach())
    target = to_normalized(batch.command, batch.lower, batch.upper)
    return -mixture.log_prob(target, batch.mask)


def tracking_error(
    surrogate: Surrogate, command: Tensor, batch: Batch, target: Tensor, std: Tensor
) -> Tensor:
    """Normalized wrench residual (B, K, 6) of commands (B, K, n, 3), by the surrogate."""
    one = (t[:, None] for t in (batch.position, batch.mounting_angle, batch.lower, batch.upper, batch.mask))
    wrench: Tensor = surrogate(command, *one)
    return wrench / std - target[:, None]


def energy(command: Tensor, batch: Batch) -> Tensor:
    """The paper's J_en (B, K) of commands (B, K, n, 3), with the default weights."""
    energies: Tensor = fin_energy(command, batch.upper[:, None]) * batch.mask[:, None]
    return energies.sum(-1)


def sample_guidance(
    mixture: Mixture,
    surrogate: Surrogate,
    batch: Batch,
    target: Tensor,
    std: Tensor,
    noise: torch.Generator,
    share: tuple[slice, int] | None = None,
) -> Tensor:
    """The paper's L_guide: squared normalized error of one sample; `share` as in `Mixture.sample`."""
    x = mixture.sample(1, 1.0, noise, share=share)
    lower, upper = batch.lower[:, None], batch.upper[:, None]
    raw = to_command(x, lower, upper)
    # The gradient passes the clamp, or samples outside the limits would teach nothing.
    command = raw + (clamp_to_limits(raw, lower, upper) - raw).detach()
    return tracking_error(surrogate, command, batch, target, std).square().sum(-1).mean(1)


def mode_guidance(
    mixture: Mixture,
    surrogate: Surrogate,
    batch: Batch,
    target: Tensor,
    std: Tensor,
    weights: AllocatorTraining,
) -> tuple[Tensor, Tensor]:
    """Soft best of all components: each is scored by error and energy, weighted by the mixture's weights.

    -s log sum_k pi_k exp(-L_k / s) rewards one good component and teaches the weights to find it. Of
    `weights` count `energy`, `softness` s and `every_mode`.

    Returns:
        The loss (B,) and the smallest normalized error among the components (B,).
    """
    command = to_command(mixture.mean.transpose(1, 2), batch.lower[:, None], batch.upper[:, None])
    squared = tracking_error(surrogate, command, batch, target, std).square().sum(-1)
    loss = torch.sqrt(squared + HUBER**2) - HUBER + weights.energy * energy(command, batch)
    s = weights.softness
    soft = -s * torch.logsumexp(mixture.logits.log_softmax(-1) - loss / s, dim=-1)
    return soft + weights.every_mode * loss.mean(1), squared.detach().amin(1).sqrt()


def negative_entropy(mixture: Mixture, mask: Tensor) -> Tensor:
    """The paper's L_ent = sum_k pi_k log pi_k (B,), the mean over fins where each fin has its own mixture."""
    log_weight = mixture.logits.log_softmax(-1)
    value = (log_weight.exp() * log_weight).sum(-1)
    return value if mixture.joint else (value * mask).sum(1) / mask.sum(1)
