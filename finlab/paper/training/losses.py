"""The terms of the paper's training loss. Each answers one number per sample (B,)."""

from typing import NamedTuple

from torch import Tensor

from finlab.networks.normalization import clamp_to_limits, to_command, to_normalized
from finlab.paper.network import Mixture
from finlab.paper.surrogate import SurrogateConfig
from finlab.paper.training.sampling import Batch
from finlab.training.saving import Tensors


class Surrogate(NamedTuple):
    """The surrogate with some weights, on the robots of a batch."""

    config: SurrogateConfig
    weights: Tensors

    def wrench(self, command: Tensor, batch: Batch) -> Tensor:
        """Wrenches (B, 6) [N, N m] of commands (B, n, 3)."""
        place = batch.position, batch.mounting_angle, batch.lower, batch.upper, batch.mask
        wrench: Tensor = self.config.wrench(self.weights, command, *place)
        return wrench


def imitation(mixture: Mixture, batch: Batch) -> Tensor:
    """Negative log-likelihood of the recorded commands (paper: L_imit)."""
    recorded = to_normalized(batch.command, batch.lower, batch.upper)
    likelihood: Tensor = mixture.log_prob(recorded[:, None])[:, 0]
    return -(likelihood * batch.mask).sum(1)


def sample_guidance(
    mixture: Mixture,
    surrogate: Surrogate,
    batch: Batch,
    target: Tensor,
    std: Tensor,
    noise: tuple[Tensor, Tensor],
) -> Tensor:
    """The paper's L_guide: squared normalized error of one sample, by the surrogate.

    Args:
        mixture: the network's answer.
        surrogate: the learned fin physics.
        batch: the robots.
        target: normalized wrenches (B, 6).
        std: what wrenches are divided by (6,).
        noise: as `Mixture.sample` takes it, for one sample.
    """
    raw = to_command(mixture.sample(*noise)[:, 0], batch.lower, batch.upper)
    # The gradient passes the clamp, or samples outside the limits would teach nothing.
    command = raw + (clamp_to_limits(raw, batch.lower, batch.upper) - raw).detach()
    return (surrogate.wrench(command, batch) / std - target).square().sum(-1)


def negative_entropy(mixture: Mixture, mask: Tensor) -> Tensor:
    """The paper's L_ent = sum_k pi_k log pi_k (B,), the mean over fins."""
    log_weight = mixture.logits.log_softmax(-1)
    value = (log_weight.exp() * log_weight).sum(-1)
    entropy: Tensor = (value * mask).sum(1) / mask.sum(1)
    return entropy
