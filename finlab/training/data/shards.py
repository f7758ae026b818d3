"""Forward samples on disk: the paper's 1000 layouts times 5000 commands, or any other number.

A data set is a folder of plain `.npy` files that are mapped into memory, never loaded whole:

    manifest.json            recipe, progress, SHA-256 of every file
    position.npy             the layouts, (layouts, fins, 3) float32, and likewise
                             mounting_angle.npy, lower.npy, upper.npy, mask.npy
    command-00000.npy        (layouts of the shard, commands per layout, fins, 3) float32 [rad, Hz, rad]
    wrench-00000.npy         (layouts of the shard, commands per layout, 6) float32 [N, N m]

Shard k depends on the recipe alone, so a generation that was killed goes on where it stopped and ends in
the same bytes.
"""

import contextlib
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.lib.format import open_memmap
from numpy.typing import NDArray
from tqdm import tqdm

from finlab.errors import DataError
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
from finlab.physics.fin_model import make_fin_model
from finlab.physics.wrench import assemble_wrench
from finlab.training.data.manifest import (
    FILE_NAME,
    Recipe,
    read_manifest,
    require_complete,
    sha256_of,
    write_manifest,
)
from finlab.training.data.sampling import LayoutBatch, sample_commands, sample_layouts, seeded_generator

LAYOUTS_PER_SHARD = 20
"""100,000 samples of the paper's size in one shard, 8 MB: small enough to lose, large enough to map."""
_COMMANDS_AT_ONCE = 2500
"""Commands worked on at once; more would fall out of the processor's cache."""


@dataclass(frozen=True)
class GenerationReport:
    """What one call of `generate` did."""

    folder: Path
    """Where the data set lies."""

    samples: int
    """How many samples this call made; those already on disk do not count."""

    seconds: float
    """How long it took [s]."""

    @property
    def samples_per_second(self) -> float:
        """Throughput with writing and checksums included [1/s]."""
        return self.samples / max(self.seconds, 1e-9)


def generate(
    out_dir: str | os.PathLike[str],
    n_layouts: int = 1000,
    commands_per_layout: int = 5000,
    seed: int = 0,
    varied_limits: float = 0.5,
    fin_model: FinModelSpec | None = None,
    workers: int = 2,
) -> GenerationReport:
    """Makes a data set, or finishes one that was begun with the same arguments.

    Args:
        out_dir: folder; made if missing.
        n_layouts: how many random layouts, 2 to 5 fins each; none is a shipped one.
        commands_per_layout: how many random commands on each.
        seed: same arguments and seed, same bytes.
        varied_limits: share of layouts with limits of their own.
        fin_model: law of all fins; `drag` when None.
        workers: threads that make shards.

    Raises:
        DataError: a number is out of range, the folder holds another data set, or the disk cannot be written.
    """
    for name, value in (("layouts", n_layouts), ("commands per layout", commands_per_layout)):
        if not 1 <= value <= 10_000_000:
            raise DataError(f"expected 1 to 10,000,000 {name}, got {value}")
    if seed < 0:
        raise DataError(f"expected a seed of at least 0, got {seed}")
    folder = Path(out_dir)
    spec = FinModelSpec() if fin_model is None else fin_model
    recipe = _recipe(n_layouts, commands_per_layout, seed, varied_limits, spec)
    try:
        return _generate(folder, recipe, spec, workers)
    except OSError as error:
        raise DataError(f"{folder}: cannot be written: {error.strerror or error}") from None


def verify(folder: str | os.PathLike[str]) -> int:
    """Checks every file of a data set against its checksum and returns how many samples it has.

    Raises:
        DataError: the set is unfinished, or a file is missing or differs.
    """
    root = Path(folder)
    recipe, checksums = read_manifest(root)
    require_complete(root, recipe, checksums)
    for name, digest in checksums.items():
        if not (root / name).is_file():
            raise DataError(f"{root / name}: is missing; generate the data set again to restore it")
        if sha256_of(root / name) != digest:
            raise DataError(f"{root / name}: does not match its checksum; delete it and generate again")
    return recipe.n_samples


def _recipe(n_layouts: int, commands: int, seed: int, varied_limits: float, spec: FinModelSpec) -> Recipe:
    nominal = Limits()
    return Recipe(
        seed=seed,
        n_layouts=n_layouts,
        commands_per_layout=commands,
        layouts_per_shard=LAYOUTS_PER_SHARD,
        n_fins=TRAINING_FINS,
        box_m=TRAINING_BOX,
        varied_limits=varied_limits,
        fin_model={"type": spec.type, **spec.values()},
        limits={
            "amplitude_rad": list(nominal.amplitude),
            "frequency_hz": list(nominal.frequency),
            "zero_direction_rad": list(nominal.zero_direction),
            "varied_amplitude_max_rad": list(AMPLITUDE_MAX_RANGE),
            "varied_frequency_max_hz": list(FREQUENCY_MAX_RANGE),
            "varied_arc_share": ARC_SHARE,
            "varied_arc_rad": list(ARC_RANGE),
        },
    )


def _generate(folder: Path, recipe: Recipe, spec: FinModelSpec, workers: int) -> GenerationReport:
    start = time.perf_counter()
    folder.mkdir(parents=True, exist_ok=True)
    checksums: dict[str, str] = {}
    if (folder / FILE_NAME).exists():
        found, checksums = read_manifest(folder)
        if found != recipe:
            raise DataError(f"{folder}: holds a data set of other settings; name another folder or delete it")
    layouts = sample_layouts(
        seeded_generator(recipe.seed, 0), recipe.n_layouts, recipe.n_fins, recipe.varied_limits, recipe.box_m
    )
    for name, tensor in layouts._asdict().items():
        _write(folder / f"{name}.npy", tensor.numpy())
        checksums[f"{name}.npy"] = sha256_of(folder / f"{name}.npy")
    todo = [k for k in range(recipe.n_shards) if not _finished(folder, k, checksums)]
    per_shard = recipe.commands_per_layout
    made = sum(len(recipe.shard_layouts(k)) for k in todo) * per_shard
    write_manifest(folder, recipe, checksums)
    bar = tqdm(total=made, unit=" samples", unit_scale=True, desc="data", disable=not sys.stderr.isatty())
    # The workers are the parallelism; torch's own threads on top would only get in each other's way.
    with bar, _torch_threads(1), ThreadPoolExecutor(workers) as pool:
        futures = {pool.submit(_make_shard, folder, recipe, spec, layouts, k): k for k in todo}
        try:
            for future in as_completed(futures):
                checksums.update(future.result())
                write_manifest(folder, recipe, checksums)
                bar.update(len(recipe.shard_layouts(futures[future])) * per_shard)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return GenerationReport(folder, made, time.perf_counter() - start)


@torch.no_grad()
def _make_shard(
    folder: Path, recipe: Recipe, spec: FinModelSpec, layouts: LayoutBatch, shard: int
) -> dict[str, str]:
    """Writes the two files of one shard and returns their checksums."""
    numbers = recipe.shard_layouts(shard)
    generator = seeded_generator(recipe.seed, 1 + shard)
    model = make_fin_model(spec)
    width, count = recipe.n_fins[1], recipe.commands_per_layout
    names = (f"command-{shard:05d}.npy", f"wrench-{shard:05d}.npy")
    shapes = ((len(numbers), count, width, 3), (len(numbers), count, 6))
    parts = [folder / f"{name}.part" for name in names]
    command_map, wrench_map = (
        open_memmap(part, mode="w+", dtype=np.float32, shape=shape)
        for part, shape in zip(parts, shapes, strict=True)
    )
    for row, number in enumerate(numbers):
        # Only the fins that are there, which come first; a new map is zero, and so padding stays.
        fins = int(layouts.mask[number].sum())
        position, angle, lower, upper = (tensor[number, :fins] for tensor in layouts[:4])
        for first in range(0, count, _COMMANDS_AT_ONCE):
            stop = min(first + _COMMANDS_AT_ONCE, count)
            many = (stop - first, fins, 3)
            command = sample_commands(generator, lower.expand(many), upper.expand(many))
            command_map[row, first:stop, :fins] = command.numpy()
            wrench_map[row, first:stop] = assemble_wrench(model, command, position, angle).numpy()
    command_map.flush()
    wrench_map.flush()
    del command_map, wrench_map
    for part, name in zip(parts, names, strict=True):
        os.replace(part, folder / name)
    return {name: sha256_of(folder / name) for name in names}


def _finished(folder: Path, shard: int, checksums: dict[str, str]) -> bool:
    names = (f"command-{shard:05d}.npy", f"wrench-{shard:05d}.npy")
    return all(name in checksums and (folder / name).is_file() for name in names)


def _write(path: Path, values: NDArray[np.generic]) -> None:
    part = path.with_name(path.name + ".part")
    with part.open("wb") as file:
        np.save(file, values)
    os.replace(part, path)


@contextlib.contextmanager
def _torch_threads(count: int) -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)
