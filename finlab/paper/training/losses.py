"""The terms of the paper's losses; each answers one number per sample (B,).

Targets are normalized by the data set's mu and sigma; mu cancels where two wrenches are compared.
"""

from collections.abc import Callable

from torch import Tensor

from finlab.networks.normalization import to_command, to_normalized
from finlab.paper.network import Mixture
from finlab.paper.training.data import Batch

WrenchOf = Callable[[Tensor, Batch], Tensor]
"""Wrenches (B, 6) of commands (B, n, 3) of a batch's robots."""


def physics(surrogate: WrenchOf, batch: Batch, std: Tensor) -> Tensor:
    """L_phys (Eq. 5): squared error of the normalized wrench of the recorded commands."""
    return ((surrogate(batch.command, batch) - batch.wrench) / std).square().sum(-1)


def imitation(mixture: Mixture, batch: Batch) -> Tensor:
    """L_imit = -log p(u* | G) of the recorded commands."""
    recorded = to_normalized(batch.command, batch.lower, batch.upper)
    likelihood: Tensor = mixture.log_prob(recorded[:, None])[:, 0]
    return -(likelihood * batch.mask).sum(1)


def guidance(
    mixture: Mixture, surrogate: WrenchOf, batch: Batch, std: Tensor, noise: tuple[Tensor, Tensor]
) -> Tensor:
    """L_guide (Eq. 6): squared normalized error of one sample of the mixture, by the surrogate.

    `noise` is uniform (B, n, 1) and standard normal (B, n, 1, 3), as `Mixture.sample` takes it.
    """
    raw = to_command(mixture.sample(*noise)[:, 0], batch.lower, batch.upper)
    # The gradient passes the clamp, or samples outside the limits would teach nothing.
    command = raw + (raw.clamp(batch.lower, batch.upper) - raw).detach()
    return physics(surrogate, batch._replace(command=command), std)


def negative_entropy(mixture: Mixture, mask: Tensor) -> Tensor:
    """L_ent = sum_k pi_k log pi_k, the mean over fins."""
    log_weight = mixture.logits.log_softmax(-1)
    value = (log_weight.exp() * log_weight).sum(-1)
    mean: Tensor = (value * mask).sum(1) / mask.sum(1)
    return mean
