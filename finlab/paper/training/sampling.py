"""The paper's data set: random layouts, random commands within their limits, and the wrenches these cause.

This is all the knowledge of physics that training needs: no inverse is ever solved for.
"""

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from finlab.arrays import AnyArray
from finlab.errors import DataError
from finlab.layout.arrays import LayoutArrays
from finlab.layout.random import random_layouts
from finlab.paper.training.recipes import SampledTraining
from finlab.physics import FinLaw, assemble_wrench

CHUNK = 200_000
"""Samples that are drawn together, in double precision."""


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


def fresh_batch(law: FinLaw, size: int, seed: int, varied_limits: float = 0.5) -> Batch:
    """Samples of one law, each on a layout of its own; such a share of them has limits of its own."""
    rng = np.random.default_rng([seed, 0])
    layouts = random_layouts(rng, size, limits=varied_limits)
    command, wrench = _random_commands(rng, law, layouts, 1)
    return Batch._make(map(_tensor, (*layouts, command[:, 0], wrench[:, 0])))


class RecordedSamples:
    """The data set of a training, and its batches.

    It is drawn once and kept in the memory of the device that trains (the printed 5 million samples take half
    a gigabyte), and walked through in a new order in each epoch. What it holds depends on the seed alone, the
    order of its batches on seed and kind of device.
    """

    def __init__(self, law: FinLaw, training: SampledTraining, seed: int, device: torch.device) -> None:
        """Draw everything; a `DataError` where a batch holds more samples than there are."""
        self.size, self.batch_size = training.layouts * training.commands, training.batch_size
        if self.batch_size > self.size:
            raise DataError(
                f"batches of {self.batch_size} samples need at least as many, got {training.layouts} layouts "
                f"x {training.commands} commands; draw more or take smaller batches"
            )
        self._seed, self._device, self._commands = seed, device, training.commands
        rng = np.random.default_rng(seed)
        robots = random_layouts(rng, training.layouts, limits=training.varied_limits)
        # Columns of a sample: commands of all fins, then the wrench.
        n = robots.mask.shape[1]
        self._samples = torch.empty(self.size, 3 * n + 6, device=device)
        together = max(1, CHUNK // self._commands)
        for first in range(0, training.layouts, together):
            some = LayoutArrays._make(part[first : first + together] for part in robots)
            rows = slice(first * self._commands, (first + len(some.mask)) * self._commands)
            command, wrench = _random_commands(rng, law, some, self._commands)
            self._samples[rows, :-6] = _tensor(command.reshape(-1, 3 * n)).to(device)
            self._samples[rows, -6:] = _tensor(wrench.reshape(-1, 6)).to(device)
        self._robots = [_tensor(part).to(device) for part in robots]
        self._epoch, self._order = -1, torch.empty(0)

    def batch(self, step: int) -> Batch:
        """Batch number `step`; what does not fill a batch is left out of an epoch."""
        epoch, place = divmod(step, self.size // self.batch_size)
        if epoch != self._epoch:
            generator = seeded_generator(self._seed, epoch, self._device)
            self._order = torch.randperm(self.size, generator=generator, device=self._device)
            self._epoch = epoch
        chosen = self._order[place * self.batch_size : (place + 1) * self.batch_size]
        sample = self._samples[chosen]
        robots = [part[chosen // self._commands] for part in self._robots]
        return Batch._make([*robots, sample[:, :-6].unflatten(-1, (-1, 3)), sample[:, -6:]])


def seeded_generator(seed: int, stream: int, device: torch.device) -> torch.Generator:
    """A generator whose numbers depend on (seed, stream) alone, unrelated between streams."""
    state = np.random.SeedSequence([seed, stream]).generate_state(1, np.uint64)[0]
    return torch.Generator(device=device).manual_seed(int(state >> np.uint64(1)))


def _random_commands(
    rng: np.random.Generator, law: FinLaw, layouts: LayoutArrays, n: int
) -> tuple[AnyArray, AnyArray]:
    """Commands (B, n, fins, 3) uniform within the limits of each layout, and their wrenches (B, n, 6)."""
    lower, upper, mask = (part[:, None] for part in (layouts.lower, layouts.upper, layouts.mask))
    share = rng.random((len(mask), n, *lower.shape[2:]))
    command = (lower + share * (upper - lower)) * mask[..., None]
    place = layouts.position[:, None], layouts.mounting_angle[:, None], mask
    return command, assemble_wrench(law, command, *place)


def _tensor(values: AnyArray) -> Tensor:
    """The same values in single precision; truth values as they are."""
    return torch.from_numpy(values if values.dtype == bool else values.astype(np.float32))
