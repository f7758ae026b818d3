"""The terms of the paper's training loss. Each answers one number per sample (B,), so that any split of a
batch over processes gives the same mean."""

from torch import Tensor

from finlab.inference.normalization import clamp_to_limits, to_command, to_normalized
from finlab.training.networks.allocator_network import Mixture
from finlab.training.networks.surrogate import Surrogate
from finlab.training.sampling import Batch


def imitation(mixture: Mixture, batch: Batch) -> Tensor:
    """Negative log-likelihood of the recorded commands (paper: L_imit)."""
    return -mixture.log_prob(to_normalized(batch.command, batch.lower, batch.upper), batch.mask)


def tracking_error(
    surrogate: Surrogate, command: Tensor, batch: Batch, target: Tensor, std: Tensor
) -> Tensor:
    """Normalized wrench residual (B, 6) of commands (B, n, 3), by the surrogate."""
    limits = (batch.lower, batch.upper, batch.mask)
    wrench: Tensor = surrogate(command, batch.position, batch.mounting_angle, *limits)
    return wrench / std - target


def sample_guidance(
    mixture: Mixture,
    surrogate: Surrogate,
    batch: Batch,
    target: Tensor,
    std: Tensor,
    noise: tuple[Tensor, Tensor],
) -> Tensor:
    """The paper's L_guide: squared normalized error of one sample; `noise` as `Mixture.sample` takes it."""
    raw = to_command(mixture.sample(*noise), batch.lower, batch.upper)
    # The gradient passes the clamp, or samples outside the limits would teach nothing.
    command = raw + (clamp_to_limits(raw, batch.lower, batch.upper) - raw).detach()
    return tracking_error(surrogate, command, batch, target, std).square().sum(-1)


def negative_entropy(mixture: Mixture, mask: Tensor) -> Tensor:
    """The paper's L_ent = sum_k pi_k log pi_k (B,), the mean over fins."""
    log_weight = mixture.logits.log_softmax(-1)
    value = (log_weight.exp() * log_weight).sum(-1)
    entropy: Tensor = (value * mask).sum(1) / mask.sum(1)
    return entropy
