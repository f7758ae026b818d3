"""Dense GATv2 attention over fully connected graphs of up to a few dozen fins.

Brody, Alon, Yahav, "How Attentive are Graph Attention Networks?", ICLR 2022. Graphs here are small
and complete, so a padded dense form with a mask is simpler and faster than edge lists; a test holds
it against `torch_geometric.nn.GATv2Conv`.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor, nn

from finlab.inference.mixture import LOG_STD_BOUND
from finlab.inference.weights import NetworkConfig
from finlab.layout.angles import is_full_turn


class DenseGATv2(nn.Module):
    """One GATv2 layer on complete graphs with self loops; heads are concatenated."""

    def __init__(self, in_features: int, out_features: int, heads: int) -> None:
        """Make the layer.

        Args:
            in_features: width of the node features.
            out_features: width of the result, all heads together.
            heads: number of attention heads; must divide `out_features`.
        """
        super().__init__()
        if out_features % heads:
            raise ValueError(f"out_features {out_features} must be a multiple of heads {heads}")
        self.heads = heads
        self.source = nn.Linear(in_features, out_features)
        self.target = nn.Linear(in_features, out_features)
        self.attention = nn.Parameter(torch.empty(heads, out_features // heads))
        self.bias = nn.Parameter(torch.zeros(out_features))
        nn.init.xavier_uniform_(self.attention)

    def forward(self, x: Tensor, mask: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """Attend over all nodes of each graph.

        Args:
            x: node features (B, n, in_features).
            mask: True where a node exists (B, n); None where all do.

        Returns:
            New features (B, n, out_features) and the attention weights (B, n, n, heads), from the
            third axis (source) to the second (target).
        """
        batch, n, _ = x.shape
        source = self.source(x).view(batch, 1, n, self.heads, -1)
        target = self.target(x).view(batch, n, 1, self.heads, -1)
        hidden = nn.functional.leaky_relu(source + target, 0.2)  # (B, n, n, heads, c)
        score = (hidden * self.attention).sum(-1)  # (B, n, n, heads)
        if mask is not None:
            score = score.masked_fill(~mask[:, None, :, None], float("-inf"))
        weight = score.softmax(dim=2)
        out = torch.einsum("bijh,bjhc->bihc", weight, source[:, 0]).reshape(batch, n, -1)
        return out + self.bias, weight


class Mixture(NamedTuple):
    """A mixture of M diagonal Gaussians per fin, for B robots of n fins."""

    logits: Tensor
    """Unnormalized log weights: (B, M) for a joint mixture, (B, n, M) for one mixture per fin."""
    mean: Tensor
    """Means (B, n, M, 3) in normalized coordinates."""
    log_std: Tensor
    """Log standard deviations (B, n, M, 3) in normalized coordinates."""
    wraps: Tensor
    """True (B, n) where the zero direction is a full circle and is treated as an angle of period 2."""

    @property
    def joint(self) -> bool:
        """Whether one component is chosen for all fins together."""
        return self.logits.dim() == 2

    def deviation(self, x: Tensor) -> Tensor:
        """Difference x - mean (B, n, M, 3) of normalized commands x (B, n, 3), wrapped where angles wrap."""
        delta = x[:, :, None] - self.mean
        wrapped = torch.remainder(delta[..., 2] + 1.0, 2.0) - 1.0
        last = torch.where(self.wraps[:, :, None], wrapped, delta[..., 2])
        return torch.cat([delta[..., :2], last[..., None]], dim=-1)

    def log_prob(self, x: Tensor, mask: Tensor) -> Tensor:
        """Log likelihood (B,) of normalized commands x (B, n, 3); padded fins (mask False) count nothing."""
        z = self.deviation(x) * torch.exp(-self.log_std)
        log_normal = (-0.5 * z.square() - self.log_std - 0.5 * math.log(2 * math.pi)).sum(-1)  # (B, n, M)
        log_weight = self.logits.log_softmax(-1)
        if self.joint:
            return torch.logsumexp(log_weight + (log_normal * mask[..., None]).sum(1), dim=-1)
        return (torch.logsumexp(log_weight + log_normal, dim=-1) * mask).sum(1)

    def sample(
        self,
        n_samples: int,
        temperature: float,
        generator: torch.Generator | None = None,
        *,
        share: tuple[slice, int] | None = None,
    ) -> Tensor:
        """Draw normalized commands (B, n_samples, n, 3).

        Temperature T sharpens the choice of component (weights to the power 1/T) and scales the
        variance of each Gaussian by T, as usual for mixture density networks; T = 1 samples the
        density itself.

        Args:
            n_samples: how many.
            temperature: T, from 0.
            generator: source of randomness.
            share: which rows of a larger batch these are, and its size; the noise is that of the larger
                batch, however it is shared among processes.
        """
        batch, n, m, _ = self.mean.shape
        rows, total = share or (slice(0, batch), batch)
        size = (total, n_samples) if self.joint else (total, n, n_samples)
        dtype, device = self.mean.dtype, self.mean.device
        draw = torch.rand(size, generator=generator, dtype=dtype, device=device)[rows]
        noise = torch.randn((total, n, n_samples, 3), generator=generator, dtype=dtype, device=device)[rows]
        cumulative = (self.logits / max(temperature, 1e-6)).softmax(-1).cumsum(-1)
        choice = (draw[..., None] > cumulative[..., None, :]).sum(-1).clamp(max=m - 1)
        if self.joint:
            choice = choice[:, None].expand(batch, n, n_samples)
        index = choice[..., None].expand(-1, -1, -1, 3)
        mean, std = self.mean.gather(2, index), self.log_std.gather(2, index).exp()
        return (mean + math.sqrt(temperature) * std * noise).transpose(1, 2)


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
