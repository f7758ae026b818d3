"""The paper's learned, differentiable model of the fin physics: commands in, wrench out.

It is trained on forward samples of the fin model. At inference the paper's allocator asks this alone, never
the fin model that judges it. Torque is computed from force and position.
"""

from itertools import pairwise

import torch
from torch import Tensor, nn

from finlab.inference.features import raw_features
from finlab.inference.normalization import to_normalized
from finlab.inference.surrogate import FORCE_UNIT
from finlab.inference.weights import DESCRIPTOR, SurrogateConfig
from finlab.layout.arrays import force_columns
from finlab.physics.wrench import wrench_of_forces


class Surrogate(nn.Module):
    """The paper's surrogate: an MLP of the ten node features and the command, and an affine correction.

    F_i = f([x_i, u_i]) in the body frame, wrench = sum of (F_i, r_i x F_i), then scale and bias
    from a descriptor of the layout pooled over its fins.
    """

    def __init__(self, config: SurrogateConfig) -> None:
        """Make it; see `SurrogateConfig`."""
        super().__init__()
        self.config = config
        blocks = [
            part for sizes in pairwise([13, *config.hidden, 3]) for part in (nn.Linear(*sizes), nn.SiLU())
        ]
        self.net = nn.Sequential(*blocks[:-1])
        # Angles enter as plain numbers and their sines must be learned; wider first weights start
        # nearer to that (measured: a sixth of the loss after the same minute).
        nn.init.uniform_(next(self.net.parameters()), -0.8, 0.8)
        self.descriptor = nn.Sequential(nn.Linear(10, DESCRIPTOR), nn.Tanh())
        self.affine = nn.Linear(DESCRIPTOR, 12)
        nn.init.zeros_(self.affine.weight)
        nn.init.zeros_(self.affine.bias)

    def forward(
        self,
        command: Tensor,
        position: Tensor,
        mounting_angle: Tensor,
        lower: Tensor,
        upper: Tensor,
        mask: Tensor | None = None,
    ) -> Tensor:
        """Wrench (..., 6) of commands (..., n, 3) on layouts broadcastable to them."""
        x = raw_features(position, mounting_angle, lower, upper)
        x = x.expand(*command.shape[:-1], x.shape[-1])
        force = self.net(torch.cat([x, to_normalized(command, lower, upper)], dim=-1)) * FORCE_UNIT
        if mask is not None:
            force = force * mask[..., None]
        # The perceptron speaks in the body frame, that of a fin whose shaft points forward.
        wrench = wrench_of_forces(force, force_columns(position, torch.zeros_like(mounting_angle)))
        here = x.new_ones(x.shape[:-1]) if mask is None else mask.to(x.dtype).expand(x.shape[:-1])
        described = self.descriptor(x) * here[..., None]
        scale, bias = self.affine(described.sum(-2) / here.sum(-1, keepdim=True)).chunk(2, dim=-1)
        corrected: Tensor = wrench * (1.0 + scale) + bias
        return corrected
