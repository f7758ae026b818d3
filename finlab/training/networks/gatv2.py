"""Dense GATv2 attention over fully connected graphs of up to a few dozen fins.

Brody, Alon, Yahav, "How Attentive are Graph Attention Networks?", ICLR 2022. Graphs here are small
and complete, so a padded dense form with a mask is simpler and faster than edge lists; a test holds
it against `torch_geometric.nn.GATv2Conv`.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn


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
