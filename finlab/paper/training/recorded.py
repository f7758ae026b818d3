"""The paper's data set: so many random layouts, with so many random commands and their wrenches on each.

It is drawn once and kept in the memory of the device that trains (the printed 5 million samples take half a
gigabyte), and walked through in a new order in each epoch.
"""

from dataclasses import dataclass, field

import numpy as np
import torch

from finlab.errors import DataError
from finlab.layout.arrays import LayoutArrays
from finlab.paper.training.recipes import SampledTraining
from finlab.paper.training.sampling import (
    Batch,
    random_commands,
    seeded_generator,
    to_tensor,
    training_layouts,
)
from finlab.physics import FinLaw

CHUNK = 200_000
"""Samples that are drawn together, in double precision."""


@dataclass
class RecordedSamples:
    """A data set of forward samples, and its batches.

    What it holds depends on the seed alone, the order of its batches on seed and kind of device.

    Raises:
        DataError: a batch holds more samples than there are.
    """

    seed: int
    """Of all draws."""
    law: FinLaw
    """Of all fins."""
    layouts: int
    """Number of random layouts."""
    commands: int
    """Commands on each."""
    varied_limits: float
    """Share of layouts whose fins get limits of their own."""
    batch_size: int
    """Samples in each batch."""
    device: torch.device = field(default_factory=lambda: torch.device("cpu"))
    """Where all is kept."""

    def __post_init__(self) -> None:
        self.size = self.layouts * self.commands
        if self.batch_size > self.size:
            raise DataError(
                f"batches of {self.batch_size} samples need at least as many, got {self.layouts} layouts x "
                f"{self.commands} commands; draw more or take smaller batches"
            )
        rng = np.random.default_rng(self.seed)
        robots = training_layouts(rng, self.layouts, varied_limits=self.varied_limits)
        # Columns of a sample: commands of all fins, then the wrench.
        n = robots.mask.shape[1]
        self._samples = torch.empty(self.size, 3 * n + 6, device=self.device)
        together = max(1, CHUNK // self.commands)
        for first in range(0, self.layouts, together):
            some = LayoutArrays._make(part[first : first + together] for part in robots)
            rows = slice(first * self.commands, (first + len(some.mask)) * self.commands)
            command, wrench = random_commands(rng, self.law, some, self.commands)
            self._samples[rows, :-6] = to_tensor(command.reshape(-1, 3 * n)).to(self.device)
            self._samples[rows, -6:] = to_tensor(wrench.reshape(-1, 6)).to(self.device)
        self._robots = [to_tensor(part).to(self.device) for part in robots]
        self._epoch, self._order = -1, torch.empty(0)

    def batch(self, step: int) -> Batch:
        """Batch number `step`; what does not fill a batch is left out of an epoch."""
        epoch, place = divmod(step, self.size // self.batch_size)
        if epoch != self._epoch:
            generator = seeded_generator(self.seed, epoch, self.device)
            self._order = torch.randperm(self.size, generator=generator, device=self.device)
            self._epoch = epoch
        chosen = self._order[place * self.batch_size : (place + 1) * self.batch_size]
        which = chosen // self.commands
        sample = self._samples[chosen]
        robots = [part[which] for part in self._robots]
        return Batch._make([*robots, sample[:, :-6].unflatten(-1, (-1, 3)), sample[:, -6:]])


def recorded_samples(
    law: FinLaw, training: SampledTraining, seed: int, device: torch.device
) -> RecordedSamples:
    """The data set of a training."""
    size = training.layouts, training.commands
    return RecordedSamples(seed, law, *size, training.varied_limits, training.batch_size, device)
