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
from finlab.research.networks.padding import Padding
from finlab.research.paper.network import Mixture
from finlab.research.paper.surrogate import FORCE_UNIT, SurrogateConfig
from finlab.research.paper.training.samples import SampleBatch
from finlab.research.training.loop import Weights, first_weights

FIRST_WEIGHT = 2.0
"""Largest first weight of the surrogate's first layer: angles enter as plain numbers whose sines
must be learned, and wide first weights start nearer to that."""


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
        command: (B, n, 3) in normalized coordinates.
        batch: the robots.
    """
    padding = Padding.of(batch.mask)
    inputs = padding.rows(torch.cat([batch.features, command], -1))
    first, *others = config.layers()
    hidden = few_inputs(w, first, inputs)
    for name in others:
        hidden = layers.linear(w, name, functional.silu(hidden))
    of_fins = hidden.to(command.dtype) * FORCE_UNIT
    force = padding.padded(of_fins) * batch.mask[..., None]
    torque = torch.linalg.cross(batch.position, force)
    wrench = torch.cat([force.sum(1), torque.sum(1)], -1)
    affine = layers.linear(w, "affine", descriptor(w, batch))
    scale, bias = affine.to(command.dtype).chunk(2, -1)
    return torch.addcmul(wrench + bias, wrench, scale)


def descriptor(w: Weights, batch: SampleBatch) -> Tensor:
    """The descriptor (B, 64) of each layout: the mean over its fins of tanh z, z of a linear layer.

    tanh z = 2 s(2 z) - 1 with the logistic function s, which torch computes six times as quickly.
    """
    doubled = {f"twice.{part}": 2.0 * w[f"descriptor.0.{part}"] for part in ("weight", "bias")}
    logistic = few_inputs(doubled, "twice", batch.features).to(batch.features.dtype).sigmoid()
    total = (logistic * batch.mask[..., None]).sum(1)
    mean: Tensor = total / (0.5 * batch.mask.sum(1, keepdim=True)) - 1.0
    return mean


def few_inputs(w: Weights, name: str, x: Tensor) -> Tensor:
    """The outputs of a linear layer whose inputs are few.

    Its weights are laid out input by input: then their gradient is the product of the transposed
    inputs, not of the transposed outputs, which takes a third of the time.
    """
    weight = w[f"{name}.weight"].t().contiguous().t()
    outputs: Tensor = functional.linear(x, weight, w[f"{name}.bias"])
    return outputs


WrenchOf = Callable[[Tensor, SampleBatch], Tensor]
"""Wrenches (B, 6) of normalized commands (B, n, 3) of a batch's robots."""


def physics(surrogate: WrenchOf, batch: SampleBatch, std: Tensor) -> Tensor:
    """L_phys (Eq. 5): squared error of the normalized wrench of the recorded commands."""
    return ((surrogate(batch.command, batch) - batch.wrench) / std).square().sum(-1)


def imitation(mixture: Mixture, batch: SampleBatch) -> Tensor:
    """L_imit = -log p(u* | G) (B,) of the recorded commands (Eq. 7), the sum over fins."""
    likelihood: Tensor = mixture.log_prob(batch.command[:, None])[:, 0]
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
    raw = mixture.sample(*noise)[:, 0]
    # The gradient passes the clamp, or samples outside the limits would teach nothing.
    command = raw + (raw.clamp(-1.0, 1.0) - raw).detach()
    return physics(surrogate, batch._replace(command=command), std)


def negative_entropy(mixture: Mixture, mask: Tensor) -> Tensor:
    """L_ent = sum_k pi_k log pi_k (B,) (Eq. 7), the mean over the fins where `mask` (B, n) is
    True."""
    log_weight = mixture.logits.log_softmax(-1)
    value = (log_weight.exp() * log_weight).sum(-1)
    mean: Tensor = (value * mask).sum(1) / mask.sum(1)
    return mean
