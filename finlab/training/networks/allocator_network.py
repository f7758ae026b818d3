"""The paper's network: dense GATv2 attention over fully connected graphs of up to a few dozen fins.

Brody, Alon, Yahav, "How Attentive are Graph Attention Networks?", ICLR 2022. Graphs here are small
and complete, so a padded dense form with a mask is simpler and faster than edge lists; a test holds
it against `torch_geometric.nn.GATv2Conv`.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor, nn

from finlab.inference.features import RAW_SIZE
from finlab.inference.mixture import LOG_STD_BOUND
from finlab.inference.weights import NetworkConfig


class DenseGATv2(nn.Module):
    """One GATv2 layer on complete graphs with self loops; heads are concatenated."""

    def __init__(self, in_features: int, out_features: int, heads: int) -> None:
        """Make it; `out_features` is the width of all heads together, a multiple of their number."""
        super().__init__()
        if out_features % heads:
            raise ValueError(f"out_features {out_features} must be a multiple of heads {heads}")
        self.heads = heads
        self.source = nn.Linear(in_features, out_features)
        self.target = nn.Linear(in_features, out_features)
        self.attention = nn.Parameter(torch.empty(heads, out_features // heads))
        self.bias = nn.Parameter(torch.zeros(out_features))
        nn.init.xavier_uniform_(self.attention)

    def forward(self, x: Tensor, mask: Tensor | None = None) -> Tensor:
        """New features (B, n, out_features) of nodes (B, n, in_features) that attend to all of their graph;
        `mask` (B, n) is True where a node exists, None where all do."""
        batch, n, _ = x.shape
        source = self.source(x).view(batch, 1, n, self.heads, -1)
        target = self.target(x).view(batch, n, 1, self.heads, -1)
        hidden = nn.functional.leaky_relu(source + target, 0.2)  # (B, n, n, heads, c)
        # One product with the attention vectors in block form, of which the gradient is a product as well.
        score = hidden.flatten(-2) @ torch.block_diag(*self.attention[:, None]).T  # (B, n, n, heads)
        if mask is not None:
            score = score.masked_fill(~mask[:, None, :, None], float("-inf"))
        weight = score.softmax(dim=2)
        out = torch.einsum("bijh,bjhc->bihc", weight, source[:, 0]).reshape(batch, n, -1)
        return out + self.bias


class Mixture(NamedTuple):
    """A mixture of M diagonal Gaussians per fin, for B robots of n fins."""

    logits: Tensor
    """Unnormalized log weights (B, n, M)."""
    mean: Tensor
    """Means (B, n, M, 3) in normalized coordinates."""
    log_std: Tensor
    """Log standard deviations (B, n, M, 3) in normalized coordinates."""

    def log_prob(self, x: Tensor, mask: Tensor) -> Tensor:
        """Log likelihood (B,) of normalized commands x (B, n, 3); padded fins (mask False) count nothing."""
        z = (x[:, :, None] - self.mean) * torch.exp(-self.log_std)
        log_normal = (-0.5 * z.square() - self.log_std - 0.5 * math.log(2 * math.pi)).sum(-1)  # (B, n, M)
        return (torch.logsumexp(self.logits.log_softmax(-1) + log_normal, dim=-1) * mask).sum(1)

    def sample(self, uniform: Tensor, normal: Tensor) -> Tensor:
        """Normalized commands (B, n, 3), drawn by numbers uniform in [0, 1) (B, n, 1) and standard normal
        ones (B, n, 3)."""
        choice = (uniform > self.logits.softmax(-1).cumsum(-1)).sum(-1).clamp(max=self.mean.shape[2] - 1)
        index = choice[..., None, None].expand(-1, -1, 1, 3)
        mean, log_std = (part.gather(2, index)[:, :, 0] for part in (self.mean, self.log_std))
        return mean + log_std.exp() * normal


class AllocatorNetwork(nn.Module):
    """Node features and a target wrench in, a mixture over each fin's commands out."""

    def __init__(self, config: NetworkConfig) -> None:
        """Make it of these sizes."""
        super().__init__()
        self.config = config
        width = config.width
        self.enter = nn.Linear(RAW_SIZE, width)
        self.graph = nn.ModuleList(DenseGATv2(width, width, config.heads) for _ in range(config.graph_layers))
        self.wrench = nn.Linear(6, width)
        self.join = nn.Linear(2 * width, width)
        layer = nn.TransformerEncoderLayer(
            width, config.heads, config.feedforward, dropout=0.0, batch_first=True, norm_first=True
        )
        self.transformer = nn.TransformerEncoder(layer, config.transformer_layers, enable_nested_tensor=False)
        self.norm = nn.LayerNorm(width)
        self.head = nn.Linear(width, config.n_components * 6)
        self.weight = nn.Linear(width, config.n_components)

    def forward(self, x: Tensor, target: Tensor, mask: Tensor | None = None) -> Mixture:
        """The mixture for node features (B, n, 10) and normalized targets (B, 6); `mask` (B, n) is True where
        a fin exists, None where all do."""
        hidden = self.enter(x)
        for layer in self.graph:
            hidden = hidden + nn.functional.elu(layer(hidden, mask))
        wrench = self.wrench(target)[:, None].expand(-1, x.shape[1], -1)
        hidden = self.join(torch.cat([hidden, wrench], dim=-1))
        padding = None if mask is None else ~mask
        hidden = self.norm(self.transformer(hidden, src_key_padding_mask=padding))
        raw = self.head(hidden).float().unflatten(-1, (self.config.n_components, 6))
        log_std = LOG_STD_BOUND * torch.tanh(0.5 * raw[..., 3:])
        return Mixture(self.weight(hidden).float(), raw[..., :3], log_std)
