"""The allocator network: GATv2 and Transformer over the graph of fins, then a mixture density head.

Paper, "Layout-independent allocation" and "Implementation details". The network sees tensors only;
`finlab.inference.features` makes them from a layout and a target.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from finlab.inference.mixture import LOG_STD_BOUND
from finlab.inference.weights import NetworkConfig
from finlab.layout.angles import is_full_turn
from finlab.training.networks.gatv2 import DenseGATv2
from finlab.training.networks.mixture import Mixture


class AllocatorNetwork(nn.Module):
    """Node features and a target wrench in, a mixture over all fins' commands out."""

    def __init__(self, config: NetworkConfig, n_features: int) -> None:
        """Make the network.

        Args:
            config: its sizes.
            n_features: width of the node features.
        """
        super().__init__()
        self.config = config
        width = config.width
        sizes = [n_features] + [width] * config.graph_layers
        self.graph = nn.ModuleList(
            DenseGATv2(a, b, config.heads) for a, b in zip(sizes, sizes[1:], strict=False)
        )
        self.skip = nn.Linear(n_features, width)
        self.wrench = nn.Sequential(nn.Linear(6, width), nn.SiLU(), nn.Linear(width, width))
        self.join = nn.Linear(2 * width, width)
        layer = nn.TransformerEncoderLayer(
            width, config.heads, config.feedforward, dropout=0.0, batch_first=True, norm_first=True
        )
        self.transformer = nn.TransformerEncoder(layer, config.transformer_layers, enable_nested_tensor=False)
        self.norm = nn.LayerNorm(width)
        per_component = 7 if config.joint else 6
        self.head = nn.Linear(width, config.n_components * per_component)
        self.weight = nn.Linear(width, config.n_components)

    def encode(self, x: Tensor, target: Tensor, mask: Tensor | None) -> Tensor:
        """Per-fin embeddings (B, n, width) of features (B, n, F) and normalized targets (B, 6)."""
        hidden = x
        for layer in self.graph:
            hidden = nn.functional.elu(layer(hidden, mask)[0])
        hidden = hidden + self.skip(x)
        wrench = self.wrench(target)[:, None].expand(-1, x.shape[1], -1)
        hidden = self.join(torch.cat([hidden, wrench], dim=-1))
        padding = None if mask is None else ~mask
        embedded: Tensor = self.norm(self.transformer(hidden, src_key_padding_mask=padding))
        return embedded

    def attention(self, x: Tensor, mask: Tensor | None = None) -> Tensor:
        """Attention weights (B, n, n) of the first GATv2 layer, averaged over heads: what it looks at."""
        weights: Tensor = self.graph[0](x, mask)[1]
        return weights.mean(-1)

    def forward(
        self, x: Tensor, target: Tensor, lower: Tensor, upper: Tensor, mask: Tensor | None = None
    ) -> Mixture:
        """The mixture for B robots.

        Args:
            x: node features (B, n, F).
            target: normalized target wrench (B, 6).
            lower: lower command limits (B, n, 3).
            upper: upper command limits (B, n, 3).
            mask: True where a fin exists (B, n); None where all do.
        """
        hidden = self.encode(x, target, mask)
        batch, n, _ = hidden.shape
        raw = self.head(hidden).float().view(batch, n, self.config.n_components, -1)
        log_std = LOG_STD_BOUND * torch.tanh(0.5 * raw[..., -3:])
        if not self.config.joint:
            logits = self.weight(hidden).float()
            return Mixture(logits, raw[..., :3], log_std, torch.zeros_like(lower[..., 0], dtype=torch.bool))
        mean = torch.cat([torch.tanh(raw[..., :2]), self._direction(raw[..., 2:4], lower, upper)], dim=-1)
        pooled = hidden if mask is None else hidden * mask[..., None]
        count = float(n) if mask is None else mask.sum(1, keepdim=True).to(hidden.dtype)
        logits = self.weight(pooled.sum(1) / count).float()
        return Mixture(logits, mean, log_std, is_full_turn(upper[..., 2] - lower[..., 2]))

    @staticmethod
    def _direction(vector: Tensor, lower: Tensor, upper: Tensor) -> Tensor:
        """Zero direction (B, n, M, 1) in normalized coordinates, from a vector in the fin's thrust plane.

        The vector's angle is an absolute zero direction, so the network never has to learn where a
        limit range starts. Outside an arc the gradient passes as if there were no limit.
        """
        angle = torch.atan2(vector[..., 1], vector[..., 0] + 1e-6)
        half = (0.5 * (upper - lower)[..., 2]).clamp_min(1e-6)[..., None]
        middle = 0.5 * (upper + lower)[..., 2][..., None]
        offset = torch.remainder(angle - middle + math.pi, 2 * math.pi) - math.pi
        clamped = torch.minimum(torch.maximum(offset, -half), half)
        return ((offset + (clamped - offset).detach()) / half)[..., None]
