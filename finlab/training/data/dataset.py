"""A finished data set on disk as an array of samples and as a stream of training batches."""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from finlab.errors import DataError
from finlab.layout.arrays import LayoutArrays
from finlab.training.data.manifest import Recipe, read_manifest, require_complete
from finlab.training.data.sampling import Batch

_LAYOUT_FILES = ("position", "mounting_angle", "lower", "upper", "mask")


class ForwardDataset:
    """Samples of one data set, mapped into memory. Sample i is command i % C of layout i // C."""

    def __init__(self, folder: Path, recipe: Recipe) -> None:
        """Maps the files of `folder`; use `open_dataset` to have them checked first."""
        self.folder = folder
        self.recipe = recipe
        arrays = [np.load(folder / f"{name}.npy") for name in _LAYOUT_FILES]
        self.layouts = LayoutArrays(*arrays)
        """The layouts, padded; float32 on disk and here."""
        self._commands = self._map("command", (recipe.n_fins[1], 3))
        self._wrenches = self._map("wrench", (6,))

    def __len__(self) -> int:
        return self.recipe.n_samples

    def batch(self, samples: NDArray[np.integer]) -> Batch:
        """Returns the samples with these numbers (B,), any order, as one float32 batch on the CPU."""
        numbers = np.asarray(samples)
        if numbers.size and not 0 <= numbers.min() <= numbers.max() < len(self):
            raise DataError(f"{self.folder}: expected sample numbers from 0 to {len(self) - 1:,}")
        layout, place = np.divmod(numbers, self.recipe.commands_per_layout)
        shard, row = np.divmod(layout, self.recipe.layouts_per_shard)
        command = np.empty((len(numbers), self.recipe.n_fins[1], 3), dtype=np.float32)
        wrench = np.empty((len(numbers), 6), dtype=np.float32)
        for k in np.unique(shard):
            here = np.flatnonzero(shard == k)
            command[here] = self._commands[k][row[here], place[here]]
            wrench[here] = self._wrenches[k][row[here], place[here]]
        of_layout = {name: torch.from_numpy(array[layout]) for name, array in self.layouts._asdict().items()}
        return Batch(**of_layout, command=torch.from_numpy(command), wrench=torch.from_numpy(wrench))

    def batches(self, batch_size: int, seed: int = 0, epoch: int = 0) -> Iterator[Batch]:
        """Yields every sample once, shuffled over the whole set by (seed, epoch), the short rest left out."""
        order = np.random.default_rng([seed, epoch]).permutation(len(self))
        for first in range(0, len(self) - batch_size + 1, batch_size):
            # Sorted numbers read the disk in one direction; order within a batch means nothing.
            yield self.batch(np.sort(order[first : first + batch_size]))

    def _map(self, name: str, tail: tuple[int, ...]) -> list[NDArray[np.float32]]:
        """Returns the shards `name`, each mapped read-only, after a look at their shapes."""
        maps = []
        for shard in range(self.recipe.n_shards):
            path = self.folder / f"{name}-{shard:05d}.npy"
            shape = (len(self.recipe.shard_layouts(shard)), self.recipe.commands_per_layout, *tail)
            try:
                values = np.load(path, mmap_mode="r", allow_pickle=False)
            except (OSError, ValueError) as error:
                raise DataError(f"{path}: cannot be mapped ({error}); generate the data set again") from None
            if values.shape != shape or values.dtype != np.float32:
                raise DataError(f"{path}: expected float32 {shape}, got {values.dtype} {values.shape}")
            maps.append(values)
        return maps


def open_dataset(folder: str | os.PathLike[str]) -> ForwardDataset:
    """Opens a data set made by `finlab data generate`; checksums are left to `shards.verify`.

    Raises:
        DataError: there is none, it is unfinished, or a file is missing or has the wrong shape.
    """
    root = Path(folder)
    recipe, checksums = read_manifest(root)
    require_complete(root, recipe, checksums)
    return ForwardDataset(root, recipe)
