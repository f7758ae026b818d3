"""The allocator's own best answers on disk: the data of the fast path.

Shard k depends on seed, k and checkpoint only, so a run that was stopped goes on where it was.
"""

import json
import os
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.errors import DataError
from finlab.layout import layout_from_arrays, random_layouts
from finlab.physics.energy import command_energy

Array = NDArray[Any]
Values = TypeVar("Values")
"""Arrays, or the tensors of a batch."""

SEED = 70_000
"""Added to the user's seed, so that no layout here is one of training or evaluation."""
MANIFEST = "answers.json"
"""What the shards in a folder are made of."""


@dataclass(frozen=True)
class AnswerSettings:
    """What answers to write down."""

    n_shards: int = 80
    """Files."""
    layouts_per_shard: int = 100
    """Random layouts in each, half of them with varied limits."""
    targets_per_layout: int = 64
    """Reachable targets for each layout."""
    fins: tuple[int, int] = (4, 6)
    """Fewest and most fins; up to three fins leave no choice, so there is nothing to learn."""
    seed: int = 0
    """Seed of layouts and targets."""


class Answers(NamedTuple, Generic[Values]):
    """Answers on B layouts of n fins (padded), M targets each; in training, batches without axis M."""

    position: Values
    """(B, n, 3) [m]."""
    mounting_angle: Values
    """(B, n) [rad]."""
    lower: Values
    """(B, n, 3)."""
    upper: Values
    """(B, n, 3)."""
    mask: Values
    """True (B, n) where there is a fin."""
    columns: Values
    """Normalized wrench per newton (B, n, 2, 6) of each fin's horizontal and vertical force."""
    maximum: Values
    """Largest thrust (B, n) [N]; 1 for padding."""
    free: Values
    """True (B,) where every fin may point anywhere."""
    target: Values
    """Normalized targets (B, M, 6)."""
    share: Values
    """Fourth root (B, M, n) of each fin's thrust in the answer over its largest."""
    energy: Values
    """Energy proxy (B, M) of the answer."""


def write_answers(allocator: LearnedAllocator, folder: Path, settings: AnswerSettings) -> None:
    """Write the shards that are missing.

    Raises:
        DataError: the folder holds answers of other settings or of another checkpoint.
    """
    folder.mkdir(parents=True, exist_ok=True)
    # By way of JSON, which knows lists only.
    manifest = json.loads(json.dumps(asdict(settings) | {"checkpoint": allocator.checkpoint}))
    path = folder / MANIFEST
    if path.exists():
        saved = json.loads(path.read_text())
        # More shards of the same kind may join.
        if {**saved, "n_shards": 0} != {**manifest, "n_shards": 0}:
            raise DataError(f"{folder}: holds answers of other settings; use an empty folder")
    path.write_text(json.dumps(manifest, indent=1) + "\n")
    missing = [k for k in range(settings.n_shards) if not _shard(folder, k).exists()]
    for k in tqdm(missing, disable=not sys.stderr.isatty(), unit="shard"):
        answers = make_answers(allocator, settings, k)
        part = folder / f".{k}.npz"
        np.savez(part, **answers._asdict())
        os.replace(part, _shard(folder, k))


def read_answers(folder: Path) -> Answers[Array]:
    """All answers in a folder.

    Raises:
        DataError: there are none.
    """
    paths = sorted(folder.glob("answers-*.npz"))
    if not paths:
        raise DataError(f"{folder}: holds no answers; write them with `finlab train fast`")
    shards = []
    for path in paths:
        with np.load(path, allow_pickle=False) as file:
            shards.append([file[name] for name in Answers._fields])
    return Answers(*(np.concatenate(parts) for parts in zip(*shards, strict=True)))


def make_answers(allocator: LearnedAllocator, settings: AnswerSettings, k: int) -> Answers[Array]:
    """Shard k."""
    rng = np.random.default_rng([SEED + settings.seed, k])
    n_layouts, n_targets = settings.layouts_per_shard, settings.targets_per_layout
    arrays = random_layouts(rng, n_layouts, settings.fins, limits="mixed")
    width = arrays.mask.shape[1]
    columns, maximum = np.zeros((n_layouts, width, 2, 6)), np.ones((n_layouts, width))
    free = np.zeros(n_layouts, dtype=bool)
    target = np.zeros((n_layouts, n_targets, 6))
    share = np.zeros((n_layouts, n_targets, width))
    energy = np.zeros((n_layouts, n_targets))
    for row in range(n_layouts):
        layout = layout_from_arrays(arrays, row)
        prepared = allocator.pipeline.prepare(layout)
        n, std = layout.n_fins, allocator.normalization.std
        draws = prepared.lower + rng.random((n_targets, n, 3)) * (prepared.upper - prepared.lower)
        wrench = prepared.commands.wrench(draws) * std
        command = allocator.allocate_batch(layout, wrench).command
        force = prepared.commands.fin.force(command)
        thrust = np.sqrt(force[..., 1] ** 2 + force[..., 2] ** 2)
        top = prepared.planar.curves.maximum
        columns[row, :n], maximum[row, :n] = prepared.planar.columns, top
        free[row] = prepared.planar.turns_fully
        target[row], energy[row] = wrench / std, command_energy(command, prepared.upper)
        share[row, :, :n] = np.minimum(thrust / top, 1.0) ** 0.25
    values = [*arrays, columns, maximum, free, target, share, energy]
    return Answers(*(a.astype(np.float32) if a.dtype == np.float64 else a for a in values))


def _shard(folder: Path, k: int) -> Path:
    return folder / f"answers-{k:04d}.npz"
