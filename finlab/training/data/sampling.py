"""Forward sampling: random layouts, random commands within their limits, and the wrenches these cause.

This is all the knowledge of physics that training needs: no inverse is ever solved for. It is fast
enough to draw fresh samples for each step instead of reading them from a disk.
"""

from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from finlab.layout.arrays import LayoutArrays
from finlab.layout.fin_model import FinModelSpec
from finlab.layout.random import TRAINING_FINS, random_layouts
from finlab.physics import FinLaw, assemble_wrench, make_law
from finlab.training.data.reserved import find_reserved, shipped_reserved


class Batch(NamedTuple):
    """B training samples, each on its own random layout padded to n fins, float32.

    Padding has position, angle and command zero and nominal limits.
    """

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
    """(B, n, 3) [rad, Hz, rad], uniform within the limits."""

    wrench: Tensor
    """(B, 6) that the command causes [N, N m]."""


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
        """Describes the stream.

        Args:
            seed: of all draws.
            batch_size: samples in each batch.
            n_fins: least and most fins, uniform; arrays are padded to the most.
            fin_model: law of all fins; the default `drag` when None.
            varied_limits: share of layouts whose fins get limits of their own; the rest keep the nominal.
        """
        self.seed = seed
        self.batch_size = batch_size
        self.n_fins = n_fins
        self.fin_model = make_law(FinModelSpec()) if fin_model is None else fin_model
        self.varied_limits = varied_limits

    def batch(self, step: int) -> Batch:
        """Returns batch number `step`."""
        rng = np.random.default_rng([self.seed, step])
        layouts = random_layouts(rng, self.batch_size, self.n_fins, limits=self.varied_limits)
        _leave_reserved(layouts)
        share = rng.random(layouts.lower.shape)
        command = (layouts.lower + share * (layouts.upper - layouts.lower)) * layouts.mask[..., None]
        place = layouts.position, layouts.mounting_angle, layouts.mask
        wrench = assemble_wrench(self.fin_model, command, *place)
        arrays = (*layouts, command, wrench)
        return Batch._make(_tensor(part) for part in arrays)


def seeded_generator(seed: int, stream: int, device: torch.device | str = "cpu") -> torch.Generator:
    """Returns a generator whose numbers depend on (seed, stream) alone, unrelated between streams."""
    state = np.random.SeedSequence([seed, stream]).generate_state(1, np.uint64)[0]
    return torch.Generator(device=device).manual_seed(int(state >> np.uint64(1)))


def _leave_reserved(layouts: LayoutArrays) -> None:
    """Moves, in place, the first fin of any reserved layout to the body's other side; it stays uniform."""
    rows = find_reserved(layouts, shipped_reserved())
    layouts.position[rows, 0] *= -1.0


def _tensor(values: NDArray[Any]) -> Tensor:
    """The same values in single precision; truth values as they are."""
    return torch.from_numpy(values if values.dtype == bool else values.astype(np.float32))
