"""Forward sampling: random layouts, random commands within their limits, and the wrenches these cause.

This is all the knowledge of physics that training needs: no inverse is ever solved for. It is fast
enough to draw fresh samples for each step instead of reading them from a disk.
"""

import functools
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from finlab.arrays import AnyArray
from finlab.assets import shipped_layouts
from finlab.layout.angles import wrapped
from finlab.layout.arrays import LayoutArrays, stack_layouts
from finlab.layout.fin import FinModelSpec
from finlab.layout.load import load_layout
from finlab.layout.random import TRAINING_FINS, random_layouts
from finlab.physics import FinLaw, assemble_wrench, make_law


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


@dataclass(frozen=True)
class ForwardSampler:
    """An endless stream of fresh training batches.

    Batch k depends on (seed, k) alone, so a run that resumes at step k sees what it would have seen.
    """

    seed: int
    """Of all draws."""
    batch_size: int
    """Samples in each batch."""
    n_fins: tuple[int, int] = TRAINING_FINS
    """Least and most fins, uniform; arrays are padded to the most."""
    fin_model: FinLaw = field(default_factory=lambda: make_law(FinModelSpec()))
    """Law of all fins; `drag` by default."""
    varied_limits: float = 0.5
    """Share of layouts whose fins get limits of their own; the rest keep the nominal."""

    def batch(self, step: int) -> Batch:
        """Returns batch number `step`."""
        rng = np.random.default_rng([self.seed, step])
        layouts = training_layouts(rng, self.batch_size, self.n_fins, self.varied_limits)
        command, wrench = random_commands(rng, self.fin_model, layouts, 1)
        arrays = (*layouts, command[:, 0], wrench[:, 0])
        return Batch._make(to_tensor(part) for part in arrays)


def training_layouts(
    rng: np.random.Generator, n: int, n_fins: tuple[int, int] = TRAINING_FINS, varied_limits: float = 0.5
) -> LayoutArrays:
    """Returns n random layouts, none of them shipped; so large a share has limits of its own."""
    layouts = random_layouts(rng, n, n_fins, limits=varied_limits)
    # The first fin of any reserved layout moves to the body's other side, where it is uniform as well.
    layouts.position[find_reserved(layouts, shipped_reserved()), 0] *= -1.0
    return layouts


def random_commands(
    rng: np.random.Generator, law: FinLaw, layouts: LayoutArrays, n: int
) -> tuple[AnyArray, AnyArray]:
    """Returns n commands (B, n, fins, 3) uniform within the limits of each layout, and their wrenches
    (B, n, 6)."""
    lower, upper, mask = (part[:, None] for part in (layouts.lower, layouts.upper, layouts.mask))
    share = rng.random((len(mask), n, *lower.shape[2:]))
    command = (lower + share * (upper - lower)) * mask[..., None]
    place = layouts.position[:, None], layouts.mounting_angle[:, None], mask
    return command, assemble_wrench(law, command, *place)


def seeded_generator(seed: int, stream: int, device: torch.device | str = "cpu") -> torch.Generator:
    """Returns a generator whose numbers depend on (seed, stream) alone, unrelated between streams."""
    state = np.random.SeedSequence([seed, stream]).generate_state(1, np.uint64)[0]
    return torch.Generator(device=device).manual_seed(int(state >> np.uint64(1)))


def to_tensor(values: AnyArray) -> Tensor:
    """The same values in single precision; truth values as they are."""
    return torch.from_numpy(values if values.dtype == bool else values.astype(np.float32))


POSITION_TOLERANCE = 2e-3
"""Fins closer than this count as the same place [m]."""
ANGLE_TOLERANCE = math.radians(1.0)
"""Shafts closer than this count as the same direction [rad]."""


@functools.cache
def shipped_reserved() -> LayoutArrays:
    """Returns the layouts shipped with finlab, read once."""
    return stack_layouts([load_layout(path) for path in shipped_layouts().values()])


def find_reserved(layouts: LayoutArrays, reserved: LayoutArrays) -> NDArray[np.bool_]:
    """Returns which layouts of a batch (B,) are reserved, fins in any order.

    A layout is one of the reserved ones when it has as many fins, each of its fins lies at one of
    theirs, and each of theirs at one of its own.
    """
    # Such a layout is all but impossible to draw. Only where the first fin lies at a reserved one is it
    # compared in full.
    places = reserved.position[reserved.mask]
    away = np.abs(layouts.position[:, :1] - places)
    found = np.asarray((away <= POSITION_TOLERANCE).all(-1).any(-1))
    suspects = LayoutArrays._make(part[found] for part in layouts)
    found[found] = _same(suspects, reserved)
    return found


def _same(layouts: LayoutArrays, reserved: LayoutArrays) -> NDArray[np.bool_]:
    """`find_reserved`, by looking at each pair of fins."""
    # Axes: layouts of the batch, reserved layouts, fins of the first, fins of the second.
    place, angle = (part[:, None, :, None] for part in (layouts.position, layouts.mounting_angle))
    here = layouts.mask[:, None, :, None]
    away = np.linalg.norm(place - reserved.position[:, None], axis=-1)
    turn = np.abs(wrapped(angle - reserved.mounting_angle[:, None]))
    near = (away <= POSITION_TOLERANCE) & (turn <= ANGLE_TOLERANCE) & here & reserved.mask[:, None]
    every_own = (near.any(axis=3) | ~here[..., 0]).all(axis=2)
    every_theirs = (near.any(axis=2) | ~reserved.mask).all(axis=2)
    as_many = here.sum(axis=(2, 3)) == reserved.mask.sum(axis=1)
    return np.asarray((as_many & every_own & every_theirs).any(axis=1))
