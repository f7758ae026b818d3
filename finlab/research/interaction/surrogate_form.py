"""The form of the paper's surrogate (Eq. 4), trained on what the laws leave, for comparison.

A perceptron gives each actuator's share of [x_i, u_i], place and force in the body frame, and a
descriptor of all stretches and shifts the sum.
"""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import nn

from finlab.arrays import Array
from finlab.fit.interaction.samples import Samples, left_by_laws
from finlab.layout import Layout
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.physics.objective import wrench_scale_of


def trained_surrogate(
    samples: Sequence[Samples], seed: int, steps: int = 1500, batch: int = 512
) -> Callable[[Layout], Callable[[Array], Array]]:
    """Trains it, and returns what it says of a robot: from forces (K, n, 3) [N] in the body frame
    to what comes beside their wrenches (K, 6) [N, N m]."""
    torch.manual_seed(seed)
    net = nn.Sequential(
        nn.Linear(7, 256), nn.GELU(), nn.Linear(256, 128), nn.GELU(), nn.Linear(128, 3)
    )
    describe = nn.Sequential(nn.Linear(7, 64), nn.GELU())
    affine = nn.Linear(64, 12)

    def rows(layout: Layout, force: Array, scale: Array, n: int) -> torch.Tensor:
        """Features (K, n, 9): place, force and size, whether there is an actuator, and the unit of
        arms."""
        x = np.zeros((len(force), n, 9))
        x[:, : layout.n, :3] = layout.position / 0.3
        x[:, : layout.n, 3:6] = force / scale[0]
        x[:, : layout.n, 6] = jet_geometry_of(layout).diameter / 0.1
        x[:, : layout.n, 7] = 1.0
        x[..., 8] = scale[0] / scale[3]
        return torch.tensor(x, dtype=torch.float32)

    def wrench(x: torch.Tensor) -> torch.Tensor:
        known = x[..., :7]
        alive = x[..., 7:8]
        share = net(known) * alive
        torque = torch.linalg.cross(0.3 * x[..., :3], share, dim=-1) * x[..., 8:]
        total = torch.cat([share, torque], dim=-1).sum(dim=1)
        pooled = (describe(known) * alive).sum(dim=1) / alive.sum(dim=1)
        stretch, shift = affine(pooled).chunk(2, dim=-1)
        result: torch.Tensor = total * (1.0 + stretch) + shift
        return result

    most = max(one.layout.n for one in samples)
    left = [left_by_laws(one) for one in samples]
    pairs = zip(samples, left, strict=True)
    known = torch.cat([rows(one.layout, own.force, own.scale, most) for one, own in pairs])
    missed = torch.tensor(np.concatenate([own.missed for own in left]), dtype=torch.float32)
    weights = [*net.parameters(), *describe.parameters(), *affine.parameters()]
    optimizer = torch.optim.Adam(weights, lr=2e-3)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps)
    for _ in range(steps):
        some = torch.randint(len(known), (batch,))
        loss = ((wrench(known[some]) - missed[some]) ** 2).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()

    def model(layout: Layout) -> Callable[[Array], Array]:
        scale = wrench_scale_of(layout)

        def function(force: Array) -> Array:
            with torch.no_grad():
                return np.asarray(
                    wrench(rows(layout, force, scale, layout.n)).double().numpy() * scale
                )

        return function

    return model
