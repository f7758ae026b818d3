"""The paper's two networks on PyTorch's own layers, for robots of mixed numbers of fins in one batch.

Robots are padded to n fins; `mask` (B, n) is True where there is one. The names of the weights are those of
`NetworkConfig` and `SurrogateConfig`, which answer without PyTorch.
"""

from collections.abc import Callable
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from finlab.networks.layers import LEAK
from finlab.networks.trained import to_command, to_normalized
from finlab.paper.network import LOG_STD_BOUND, RAW_SIZE, Mixture, NetworkConfig, raw_features
from finlab.paper.surrogate import DESCRIPTOR, FORCE_UNIT, SurrogateConfig
from finlab.paper.training.samples import Batch

FIRST_WEIGHT = 2.0
"""Largest first weight of the surrogate's first layer: angles enter as plain numbers whose sines must be
learned, and wide first weights start nearer to that."""


def features(batch: Batch) -> Tensor:
    """Node features x_i (B, n, 10)."""
    x: Tensor = raw_features(batch.position, batch.mounting_angle, batch.lower, batch.upper)
    return x


class GraphAttention(nn.Module):
    """GATv2 on complete graphs with self loops; heads are concatenated."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.source, self.target = nn.Linear(width, width), nn.Linear(width, width)
        self.attention = nn.Parameter(nn.init.xavier_uniform_(torch.empty(heads, width // heads)))
        self.bias = nn.Parameter(torch.zeros(width))

    def forward(self, x: Tensor, mask: Tensor) -> Tensor:
        """Features (B, n, width) of the same; no fin listens to one that does not exist."""
        heads = self.attention.shape
        source = self.source(x)
        hidden = functional.leaky_relu(source[:, None] + self.target(x)[:, :, None], LEAK)
        score = (hidden.unflatten(-1, heads) * self.attention).sum(-1)  # (B, n, n, heads)
        weight = score.masked_fill(~mask[:, None, :, None], -torch.inf).softmax(2)
        seen = torch.einsum("bijh,bjhc->bihc", weight.to(source.dtype), source.unflatten(-1, heads))
        return seen.flatten(2) + self.bias


class AllocatorNetwork(nn.Module):
    """Encoding phase and mixture (Eq. 2) of the paper: robots and normalized wrenches in, a mixture out."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        width, self.n_components = config.width, config.n_components
        self.enter, self.wrench = nn.Linear(RAW_SIZE, width), nn.Linear(6, width)
        self.graph = nn.ModuleList(GraphAttention(width, config.heads) for _ in range(config.graph_layers))
        self.join = nn.Linear(2 * width, width)
        layer = nn.TransformerEncoderLayer(
            width, config.heads, config.feedforward, dropout=0.0, batch_first=True, norm_first=True
        )
        self.transformer = nn.TransformerEncoder(layer, config.transformer_layers, enable_nested_tensor=False)
        for parameter in self.transformer.parameters():  # the encoder copies one layer
            if parameter.dim() > 1:
                nn.init.xavier_uniform_(parameter)
        self.norm = nn.LayerNorm(width)
        self.head, self.weight = (
            nn.Linear(width, 6 * config.n_components),
            nn.Linear(width, config.n_components),
        )

    def forward(self, x: Tensor, target: Tensor, mask: Tensor) -> Mixture:
        """Mixtures over each fin's command in normalized coordinates, of node features (B, n, 10) and
        normalized wrenches (B, 6); the mask (B, n) is True where there is a fin."""
        hidden = self.enter(x)
        for layer in self.graph:
            hidden = hidden + functional.elu(layer(hidden, mask))
        condition = self.wrench(target)[:, None].expand(-1, x.shape[1], -1)
        hidden = self.join(torch.cat([hidden, condition], -1))
        hidden = self.norm(self.transformer(hidden, src_key_padding_mask=~mask))
        with torch.autocast(x.device.type, enabled=False):
            raw = self.head(hidden.float()).unflatten(-1, (self.n_components, 6))
            logits = self.weight(hidden.float())
        return Mixture(logits, raw[..., :3], LOG_STD_BOUND * torch.tanh(0.5 * raw[..., 3:]))


class Surrogate(nn.Module):
    """The physics surrogate (Eq. 4): F_i = f([x_i, u_i]), tau_i = r_i x F_i, w = sum [F_i; tau_i], then the
    affine correction from the pooled descriptor of the layout."""

    def __init__(self, config: SurrogateConfig) -> None:
        super().__init__()
        linear = [nn.Linear(*pair) for pair in pairwise([RAW_SIZE + 3, *config.hidden, 3])]
        hidden = [part for layer in linear[:-1] for part in (layer, nn.SiLU())]
        self.net = nn.Sequential(*hidden, linear[-1])
        self.descriptor = nn.Sequential(nn.Linear(RAW_SIZE, DESCRIPTOR), nn.Tanh())
        self.affine = nn.Linear(DESCRIPTOR, 12)
        with torch.no_grad():
            first = linear[0].weight
            first *= FIRST_WEIGHT / first.abs().max()
            for parameter in self.affine.parameters():  # at first no layout is stretched or shifted
                parameter.zero_()

    def forward(self, command: Tensor, batch: Batch) -> Tensor:
        """Wrenches (B, 6) [N, N m] of commands (B, n, 3) of a batch's robots."""
        x, mask = features(batch), batch.mask
        inputs = torch.cat([x, to_normalized(command, batch.lower, batch.upper)], -1)
        own = self.net(inputs[mask]).to(command.dtype) * FORCE_UNIT
        force = own.new_zeros(command.shape).masked_scatter(mask[..., None], own)
        torque = torch.linalg.cross(batch.position, force)
        wrench = torch.cat([force, torque], -1).sum(1)
        described = (self.descriptor(x) * mask[..., None]).sum(1) / mask.sum(1, keepdim=True)
        scale, bias = self.affine(described).to(command.dtype).chunk(2, -1)
        answer: Tensor = wrench * (1.0 + scale) + bias
        return answer


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
