"""Batches of a data set, for training."""

from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from finlab.errors import DataError
from finlab.networks.normalization import Normalization
from finlab.paper.training.samples import (
    DATA_FILE,
    FIELDS,
    ROBOT,
    DataSettings,
    about,
    part_file,
    read_part,
    samples_of,
)
from finlab.training.loop import seeded_generator


class Batch(NamedTuple):
    """B samples, each a robot padded to n fins, a command and its wrench, float32; padding is all zeros."""

    position: Tensor
    """(B, n, 3), body frame [m]."""
    mounting_angle: Tensor
    """(B, n) [rad]."""
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


class DataSet:
    """A data set in the memory of a device, and its batches."""

    def __init__(self, folder: Path, device: torch.device) -> None:
        """Read a data set; a `DataError` where it is missing, unfinished or damaged."""
        said = about(folder)
        try:
            self.settings: dict[str, Any] = said["settings"]
            """As in `data.json`."""
            self.layouts, self.commands = (int(self.settings[name]) for name in ("layouts", "commands"))
            self.normalization = Normalization.parse(said["normalization"])
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f"{folder}: an unfinished data set; run `finlab data generate` again") from error
        count = -(-self.layouts // DataSettings(commands=self.commands).together)
        parts = [read_part(part_file(folder, k)) for k in range(count)]
        whole = {name: np.concatenate([part[name] for part in parts]) for name in FIELDS}
        if whole["wrench"].shape != (self.layouts, self.commands, 6):
            raise DataError(f"{folder}: its parts are not those of its {DATA_FILE}")
        self._parts = [torch.from_numpy(whole[name]).to(device) for name in FIELDS]
        self._device, self._epoch = device, -1
        self._order = torch.empty(0)

    def batch(self, step: int, size: int, seed: int, one_layout: bool, rows: slice) -> Batch:
        """The rows of batch number `step`, a function of step and seed.

        Args:
            step: number of the batch.
            size: samples of the whole batch.
            seed: of the order.
            one_layout: whether they are random commands of a single layout (paper, surrogate pretraining), a
                new one in each step, or of all, in a new order in each epoch.
            rows: those of the batch that are answered.
        """
        count = self.layouts if one_layout else self.layouts * self.commands
        if not one_layout and size > count:
            raise DataError(f"batches of {size} samples need at least as many, the data set has {count}")
        epoch, place = divmod(step, count if one_layout else count // size)
        if epoch != self._epoch:
            draw = seeded_generator(seed, epoch, self._device)
            self._epoch, self._order = epoch, torch.randperm(count, generator=draw, device=self._device)
        if one_layout:
            draw = seeded_generator(seed, 1_000_000 + step, self._device)
            command = torch.randint(self.commands, (size,), generator=draw, device=self._device)[rows]
            layout = self._order[place].expand(len(command))
        else:
            chosen = self._order[place * size : (place + 1) * size][rows]
            layout, command = chosen // self.commands, chosen % self.commands
        *robots, commands, wrench = self._parts
        mixed = commands[layout, command], wrench[layout, command]
        return Batch._make([*(part[layout] for part in robots), *mixed])


@lru_cache(maxsize=1)
def fresh_batch(settings: DataSettings) -> Batch:
    """All samples of a data set, in memory alone."""
    robots = [samples_of(settings, k) for k in range(settings.layouts)]
    times = [len(robot["wrench"]) for robot in robots]
    whole = {name: np.stack([robot[name] for robot in robots]) for name in FIELDS}
    once = {name: np.repeat(whole[name], times, axis=0) for name in ROBOT}
    flat = {name: np.concatenate(whole[name]) for name in FIELDS[5:]}
    return Batch(*(torch.from_numpy(part) for part in (once | flat).values()))
