"""The paper's surrogate in torch, and the terms of both losses, for robots of mixed numbers of
fins.

Robots are padded to n fins; the padding mask (B, n) is True where there is one. The network itself
is `NetworkConfig`.
"""

from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn import functional

from finlab.research.networks import layers
from finlab.research.networks.trained import to_command, to_normalized
from finlab.research.paper.network import Mixture, raw_features
from finlab.research.paper.surrogate import FORCE_UNIT, SurrogateConfig
from finlab.research.paper.training.samples import SampleBatch
from finlab.research.training.loop import Weights, first_weights

FIRST_WEIGHT = 2.0
"""Largest first weight of the surrogate's first layer: angles enter as plain numbers whose sines
must be learned, and wide first weights start nearer to that."""


def features(batch: SampleBatch) -> Tensor:
    """Node features x_i (B, n, 10) of a batch's robots, scaled as `raw_features` says."""
    x: Tensor = raw_features(batch.position, batch.mounting_angle, batch.lower, batch.upper)
    return x


def surrogate_weights(config: SurrogateConfig, seed: int, device: torch.device) -> Weights:
    """First weights of the physics surrogate by name, which depend on the seed alone."""
    weights = first_weights(config.shapes(), seed, device)
    with torch.no_grad():
        first = weights[f"{config.layers()[0]}.weight"]
        first *= FIRST_WEIGHT / first.abs().max()
        for part in ("weight", "bias"):  # at first no layout is stretched or shifted
            weights[f"affine.{part}"].zero_()
    return weights


def surrogate_wrench(
    config: SurrogateConfig, w: Weights, command: Tensor, batch: SampleBatch
) -> Tensor:
    """Returns wrenches (B, 6) by the physics surrogate [N, N m] (Eq. 4).

    F_i = f([x_i, u_i]), tau_i = r_i x F_i, w = sum [F_i; tau_i], then the affine correction from
    the pooled descriptor of the layout.

    Args:
        config: sizes of the surrogate.
        w: its weights.
        command: (B, n, 3) [rad, Hz, rad].
        batch: the robots.
    """
    x = features(batch)
    mask = batch.mask
    inputs = torch.cat([x, to_normalized(command, batch.lower, batch.upper)], -1)
    first, *others = config.layers()
    hidden = layers.linear(w, first, inputs[mask])
    for name in others:
        hidden = layers.linear(w, name, functional.silu(hidden))
    of_fins = hidden.to(command.dtype) * FORCE_UNIT  # of all fins that are no padding
    force = of_fins.new_zeros(command.shape).masked_scatter(mask[..., None], of_fins)
    torque = torch.linalg.cross(batch.position, force)
    wrench = torch.cat([force, torque], -1).sum(1)
    described = torch.tanh(layers.linear(w, "descriptor.0", x))
    descriptor = (described * mask[..., None]).sum(1) / mask.sum(1, keepdim=True)
    scale, bias = layers.linear(w, "affine", descriptor).to(command.dtype).chunk(2, -1)
    corrected: Tensor = wrench * (1.0 + scale) + bias
    return corrected


WrenchOf = Callable[[Tensor, SampleBatch], Tensor]
"""Wrenches (B, 6) of commands (B, n, 3) of a batch's robots."""


def physics(surrogate: WrenchOf, batch: SampleBatch, std: Tensor) -> Tensor:
    """L_phys (Eq. 5): squared error of the normalized wrench of the recorded commands."""
    return ((surrogate(batch.command, batch) - batch.wrench) / std).square().sum(-1)


def imitation(mixture: Mixture, batch: SampleBatch) -> Tensor:
    """L_imit = -log p(u* | G) (B,) of the recorded commands (Eq. 7), the sum over fins."""
    recorded = to_normalized(batch.command, batch.lower, batch.upper)
    likelihood: Tensor = mixture.log_prob(recorded[:, None])[:, 0]
    return -(likelihood * batch.mask).sum(1)


def guidance(
    mixture: Mixture,
    surrogate: WrenchOf,
    batch: SampleBatch,
    std: Tensor,
    noise: tuple[Tensor, Tensor],
) -> Tensor:
    """L_guide (Eq. 6): squared normalized error of one sample of the mixture, by the surrogate.

    `noise` is uniform (B, n, 1) and standard normal (B, n, 1, 3), as `Mixture.sample` takes it.
    """
    raw = to_command(mixture.sample(*noise)[:, 0], batch.lower, batch.upper)
    # The gradient passes the clamp, or samples outside the limits would teach nothing.
    command = raw + (raw.clamp(batch.lower, batch.upper) - raw).detach()
    return physics(surrogate, batch._replace(command=command), std)


def negative_entropy(mixture: Mixture, mask: Tensor) -> Tensor:
    """L_ent = sum_k pi_k log pi_k (B,) (Eq. 7), the mean over the fins where `mask` (B, n) is
    True."""
    log_weight = mixture.logits.log_softmax(-1)
    value = (log_weight.exp() * log_weight).sum(-1)
    mean: Tensor = (value * mask).sum(1) / mask.sum(1)
    return mean
