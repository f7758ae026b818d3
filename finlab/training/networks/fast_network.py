"""The distilled network: how hard each fin should work, in one pass and without sampling."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn


@dataclass(frozen=True)
class FastConfig:
    """Sizes of the distilled network."""

    width: int = 96
    """Width of its layers."""
    rounds: int = 3
    """How many times each fin hears of all others."""


class FastNetwork(nn.Module):
    """Node features in, the fourth root of each fin's thrust over its largest out.

    Each round, a fin sees itself and the mean over all fins; that is all a robot of a few fins needs, and
    it takes a third of the operations of attention.
    """

    def __init__(self, config: FastConfig, n_features: int) -> None:
        """Make it for node features of this width."""
        super().__init__()
        self.config = config
        width = config.width
        self.first = nn.Linear(n_features, width)
        self.own = nn.ModuleList(nn.Linear(width, width) for _ in range(config.rounds))
        self.all = nn.ModuleList(nn.Linear(width, width, bias=False) for _ in range(config.rounds))
        self.last = nn.Linear(width, 1)

    def forward(self, x: Tensor, mask: Tensor) -> Tensor:
        """Shares (B, n) in 0..1 of features (B, n, F); padded fins (mask False) are not heard."""
        heard = mask / mask.sum(-1, keepdim=True)
        hidden = torch.relu(self.first(x))
        for own, everyone in zip(self.own, self.all, strict=True):
            mean = torch.einsum("bn,bnw->bw", heard, hidden)
            hidden = hidden + torch.relu(own(hidden) + everyone(mean)[:, None])
        return torch.sigmoid(self.last(hidden)[..., 0])
