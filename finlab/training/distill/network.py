"""The distilled network: how hard each fin should work, in one pass, and what its answers cost."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor, nn

from finlab.forces.force_space import REST, RIDGE
from finlab.physics.energy import DEFAULT_WEIGHTS, energy_of_shares


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
        """Shares (B, n) in 0..1 of features (B, n, F); padded fins (mask False) do not count."""
        share = mask / mask.sum(-1, keepdim=True)
        hidden = torch.relu(self.first(x))
        for own, everyone in zip(self.own, self.all, strict=True):
            mean = torch.einsum("bn,bnw->bw", share, hidden)
            hidden = hidden + torch.relu(own(hidden) + everyone(mean)[:, None])
        return torch.sigmoid(self.last(hidden)[..., 0])


FULL_ENERGY = energy_of_shares(1.0, 1.0, 0.0)
"""Energy proxy of a fin at full thrust, pointing where that costs nothing."""
DIRECTION = DEFAULT_WEIGHTS.zero_direction / math.pi**2
"""Energy per squared zero direction [1/rad^2] of a fin that turns fully."""
OVERLOAD = 3.0
"""Cost of asking a fin for twice what it has, in units of energy."""


class Forces(NamedTuple):
    """Planar forces of B targets on n fins."""

    size: Tensor
    """Thrust over the fin's largest (B, n)."""
    direction: Tensor
    """Zero direction (B, n) [rad]."""


def decode(share: Tensor, columns: Tensor, maximum: Tensor, mask: Tensor, target: Tensor) -> Forces:
    """The forces that shares lead to.

    Args:
        share: fourth root of thrust over largest thrust (B, n).
        columns: normalized wrench per newton (B, n, 2, 6).
        maximum: largest thrust (B, n) [N].
        mask: True (B, n) where there is a fin.
        target: normalized targets (B, 6).
    """
    # m = T / e'(T), as in `force_space.mobility`; in double precision, since weights span six decades.
    weight = (share.double() ** 4).clamp_min(REST) ** 1.5 * maximum.double() ** 2 * mask
    rows = columns.double()
    gram = torch.einsum("bn,bnci,bncj->bij", weight, rows, rows)
    trace = gram.diagonal(dim1=1, dim2=2).sum(-1)
    ridge = (RIDGE * trace + 1e-12)[:, None, None] * torch.eye(6, dtype=gram.dtype)
    multiplier = torch.linalg.solve(gram + ridge, target.double()[..., None])[..., 0]
    force = torch.einsum("bnci,bi->bnc", rows, multiplier) * weight[..., None]
    size = (force.square().sum(-1) + 1e-18).sqrt() / maximum
    direction = torch.atan2(force[..., 1], force[..., 0] + 1e-12)
    return Forces(size.float(), direction.float())


def energy(forces: Forces, mask: Tensor) -> Tensor:
    """Energy proxy (B,), with what is asked beyond a fin's largest thrust punished."""
    size = forces.size
    beat: Tensor = FULL_ENERGY * (size + 1e-6).sqrt().clamp_max(1.0)
    # A fin at rest points where it costs nothing.
    turned = DIRECTION * forces.direction.square() * (size / 0.01).clamp_max(1.0)
    spent: Tensor = (beat + turned + OVERLOAD * (size - 1.0).clamp_min(0.0)) * mask
    return spent.sum(-1)
