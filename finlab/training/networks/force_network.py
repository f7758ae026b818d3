"""The network of method `mdn` in PyTorch: fins and pairs of fins in, a joint mixture over all forces out.

Transformer layers over the fins whose attention is GATv2's (Brody, Alon, Yahav, ICLR 2022) with features of
pairs: fin i scores leaky(source_j + target_i + pair_ij), and what it scores is also the message.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor, nn

from finlab.inference.force_network import LEAK, LOG_STD, NODE_SIZE, PAIR_SIZE
from finlab.inference.weights import ForceNetworkConfig


class ForceMixture(NamedTuple):
    """A mixture of M Gaussians over the forces of n fins together, for B targets.

    A force is told as the root of its share of the fin's largest one, in the fin's own frame.
    """

    logits: Tensor
    """Unnormalized log weights (B, M)."""
    mean: Tensor
    """(B, n, M, 2)."""
    log_std: Tensor
    """Of both components (B, n, M)."""

    def log_prob(self, way: Tensor, temper: float = 1.0) -> Tensor:
        """Log likelihoods (B, L) of L ways (B, L, n, 2) to deliver each target.

        With `temper` T above one components share what they stand for: T log sum exp(log p / T).
        """
        apart = way[:, :, :, None] - self.mean[:, None]  # (B, L, n, M, 2)
        scaled = apart.square().sum(-1) * torch.exp(-2.0 * self.log_std)[:, None]
        normal = -0.5 * scaled - (2.0 * self.log_std + math.log(2.0 * math.pi))[:, None]
        each = self.logits.log_softmax(-1)[:, None] + normal.sum(2)
        return temper * torch.logsumexp(each / temper, dim=-1)


class PairAttention(nn.Module):
    """Attention of fins to fins by what they are and how they can stand in for each other."""

    def __init__(self, width: int, heads: int) -> None:
        """Make it for hidden features of this width, a multiple of the heads."""
        super().__init__()
        self.heads = heads
        self.source = nn.Linear(width, width)
        self.target = nn.Linear(width, width, bias=False)
        self.pair = nn.Linear(PAIR_SIZE, width, bias=False)
        self.attention = nn.Parameter(torch.empty(heads, width // heads))
        self.out = nn.Linear(width, width)
        nn.init.xavier_uniform_(self.attention)

    def forward(self, x: Tensor, pairs: Tensor) -> tuple[Tensor, Tensor]:
        """New features (B, n, width) of features (B, n, width) and pairs (B, n, n, 4), and the weights
        (B, n, n, heads) with which each fin looks at each."""
        hidden = self.pair(pairs) + self.source(x)[:, None] + self.target(x)[:, :, None]
        hidden = nn.functional.leaky_relu(hidden, LEAK).unflatten(-1, (self.heads, -1))
        weight = (hidden * self.attention).sum(-1).softmax(dim=2)
        message = (weight[..., None] * hidden).sum(2).flatten(-2)
        return self.out(message), weight


class ForceLayer(nn.Module):
    """One Transformer layer, normalization first."""

    def __init__(self, config: ForceNetworkConfig) -> None:
        """Make it of the network's sizes."""
        super().__init__()
        width = config.width
        self.norm1, self.norm2 = nn.LayerNorm(width), nn.LayerNorm(width)
        self.look = PairAttention(width, config.heads)
        self.up, self.down = nn.Linear(width, config.feedforward), nn.Linear(config.feedforward, width)

    def forward(self, x: Tensor, pairs: Tensor) -> Tensor:
        """Hidden features (B, n, width) of the same and of pairs (B, n, n, 4)."""
        x = x + self.look(self.norm1(x), pairs)[0]
        fed: Tensor = x + self.down(torch.relu(self.up(self.norm2(x))))
        return fed


class ForceNetwork(nn.Module):
    """Features of fins and pairs in, a mixture over the forces of all fins out."""

    def __init__(self, config: ForceNetworkConfig) -> None:
        """Make it of these sizes."""
        super().__init__()
        self.config = config
        width, m = config.width, config.n_components
        self.enter = nn.Linear(NODE_SIZE, width)
        self.layers = nn.ModuleList(ForceLayer(config) for _ in range(config.layers))
        self.norm = nn.LayerNorm(width)
        self.head = nn.Linear(width, 3 * m)
        self.weight = nn.Linear(width, m)

    def forward(self, nodes: Tensor, pairs: Tensor) -> ForceMixture:
        """The mixture for fins (B, n, 27) and pairs (B, n, n, 4)."""
        hidden = self.enter(nodes)
        for layer in self.layers:
            hidden = layer(hidden, pairs)
        hidden = self.norm(hidden)
        raw = self.head(hidden).unflatten(-1, (self.config.n_components, 3)).float()
        log_std = LOG_STD[0] + LOG_STD[1] * torch.tanh(raw[..., 2])
        return ForceMixture(self.weight(hidden.mean(1)).float(), raw[..., :2], log_std)
