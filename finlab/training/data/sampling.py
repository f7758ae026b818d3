"""Forward sampling: random layouts, random commands within their limits, and the wrenches these cause.

This is all the knowledge of physics that training needs: no inverse is ever solved for. Everything happens
in torch on one device, fast enough to draw fresh samples for each step instead of reading them.
"""

import math
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from finlab.layout.fin import Limits
from finlab.layout.fin_model import FinModelSpec
from finlab.layout.random import (
    AMPLITUDE_MAX_RANGE,
    ARC_RANGE,
    ARC_SHARE,
    FREQUENCY_MAX_RANGE,
    TRAINING_BOX,
    TRAINING_FINS,
)
from finlab.physics import FinLaw, assemble_wrench, make_law
from finlab.training.data.reserved import ReservedLayouts, shipped_reserved


class LayoutBatch(NamedTuple):
    """B random layouts padded to n fins, float32. Padding has position, angle zero and nominal limits."""

    position: Tensor
    """(B, n, 3), body frame [m]."""

    mounting_angle: Tensor
    """(B, n), in [-pi, pi) [rad]."""

    lower: Tensor
    """(B, n, 3) [rad, Hz, rad]."""

    upper: Tensor
    """(B, n, 3) [rad, Hz, rad]."""

    mask: Tensor
    """(B, n) bool, True where there is a fin."""


class Batch(NamedTuple):
    """B training samples, each on its own random layout padded to n fins, float32."""

    position: Tensor
    """(B, n, 3), body frame [m]."""

    mounting_angle: Tensor
    """(B, n), in [-pi, pi) [rad]."""

    lower: Tensor
    """(B, n, 3) [rad, Hz, rad]."""

    upper: Tensor
    """(B, n, 3) [rad, Hz, rad]."""

    mask: Tensor
    """(B, n) bool, True where there is a fin."""

    command: Tensor
    """(B, n, 3) [rad, Hz, rad], uniform within the limits; zero in padding."""

    wrench: Tensor
    """(B, 6) that the command causes [N, N m]."""


def seeded_generator(seed: int, stream: int, device: torch.device | str = "cpu") -> torch.Generator:
    """Returns a generator whose numbers depend on (seed, stream) alone, unrelated between streams."""
    state = np.random.SeedSequence([seed, stream]).generate_state(1, np.uint64)[0]
    return torch.Generator(device=device).manual_seed(int(state >> np.uint64(1)))


def sample_layouts(
    generator: torch.Generator,
    n: int,
    n_fins: tuple[int, int] = TRAINING_FINS,
    varied_limits: float = 0.5,
) -> LayoutBatch:
    """Returns n random layouts on the generator's device, distributed as `finlab.layout.random_layouts`.

    Args:
        generator: source of randomness.
        n: how many layouts.
        n_fins: least and most fins, uniform; arrays are padded to the most.
        varied_limits: share of layouts whose fins get limits of their own, the rest keep the nominal ones.
    """
    device, width = generator.device, n_fins[1]
    count = torch.randint(n_fins[0], width + 1, (n, 1), generator=generator, device=device)
    mask = torch.arange(width, device=device) < count
    # One plane (n, width) per quantity: whole planes are several times faster to work on than their columns.
    draw = torch.rand(9, n, width, generator=generator, device=device)
    place = [(2.0 * draw[axis] - 1.0) * (TRAINING_BOX[axis] * mask) for axis in range(3)]
    mounting_angle = (2.0 * draw[3] - 1.0) * (math.pi * mask)
    position = torch.stack(place, dim=-1)
    _avoid(position, mounting_angle, mask, shipped_reserved())

    varied = (torch.rand(n, 1, generator=generator, device=device) < varied_limits) & mask
    arc = varied & (draw[4] < ARC_SHARE)
    half_arc = _between(ARC_RANGE, draw[5]) / 2
    center = (2.0 * draw[6] - 1.0) * (math.pi - half_arc)
    nominal = Limits()
    least = torch.tensor(nominal.lower, device=device).expand(n, width, 3).unbind(dim=-1)
    most = [
        torch.where(varied, _between(AMPLITUDE_MAX_RANGE, draw[7]), nominal.amplitude[1]),
        torch.where(varied, _between(FREQUENCY_MAX_RANGE, draw[8]), nominal.frequency[1]),
        torch.where(arc, center + half_arc, nominal.zero_direction[1]),
    ]
    lower = torch.stack([*least[:2], torch.where(arc, center - half_arc, nominal.zero_direction[0])], dim=-1)
    upper = torch.stack(most, dim=-1)
    return LayoutBatch(position, mounting_angle, lower, upper, mask)


def sample_commands(generator: torch.Generator, lower: Tensor, upper: Tensor) -> Tensor:
    """Returns commands uniform within limits (..., 3), one for each; float32 as the limits are."""
    draw = torch.rand(lower.shape, generator=generator, device=generator.device, dtype=lower.dtype)
    # The minimum guards against rounding: lower + 1 * (upper - lower) may come out above upper.
    return torch.minimum(lower + draw * (upper - lower), upper)


class ForwardSampler:
    """An endless stream of fresh training batches.

    Batch k depends on (seed, k) alone, so a run that resumes at step k sees what it would have seen.
    """

    def __init__(
        self,
        seed: int,
        batch_size: int,
        n_fins: tuple[int, int] = TRAINING_FINS,
        fin_model: FinLaw | None = None,
        varied_limits: float = 0.5,
    ) -> None:
        """Describes the stream; see `sample_layouts`. `fin_model` is the default law when None."""
        self.seed = seed
        self.batch_size = batch_size
        self.n_fins = n_fins
        self.fin_model = make_law(FinModelSpec()) if fin_model is None else fin_model
        self.varied_limits = varied_limits

    @torch.no_grad()
    def batch(self, step: int) -> Batch:
        """Returns batch number `step`."""
        generator = seeded_generator(self.seed, step)
        layouts = sample_layouts(generator, self.batch_size, self.n_fins, self.varied_limits)
        command = sample_commands(generator, layouts.lower, layouts.upper) * layouts.mask.unsqueeze(-1)
        wrench = assemble_wrench(
            self.fin_model, command, layouts.position, layouts.mounting_angle, layouts.mask
        )
        return Batch(*layouts, command=command, wrench=wrench)


def _between(ends: tuple[float, float], draw: Tensor) -> Tensor:
    return ends[0] + (ends[1] - ends[0]) * draw


def _avoid(position: Tensor, mounting_angle: Tensor, mask: Tensor, reserved: ReservedLayouts) -> None:
    """Moves, in place, the first fin of any reserved layout to the body's other side; it stays uniform.

    Such a layout is all but impossible to draw. So a sieve looks at the first fin's place alone, and the few
    layouts left are compared in full.
    """
    sieve = reserved.sieve
    cell = ((position[:, 0] + sieve.reach) * (1.0 / sieve.cell)).long().clamp_(0, sieve.occupied.shape[0] - 1)
    occupied = torch.from_numpy(sieve.occupied).to(position.device)
    suspects = torch.nonzero(occupied[cell[:, 0], cell[:, 1]]).squeeze(1)
    if len(suspects) == 0:
        return
    found = reserved.matches(
        position[suspects].cpu().numpy(), mounting_angle[suspects].cpu().numpy(), mask[suspects].cpu().numpy()
    )
    rows = suspects[torch.from_numpy(found).to(suspects.device)]
    position[rows, 0] = -position[rows, 0]
