"""The paper's data set (data generation): random layouts, uniform commands, and the wrenches they
cause.

This is all the knowledge of physics that training needs: no inverse is ever solved for. A set is a
folder of parts and a `data.json` that says how it was drawn and holds the wrenches' mean and
standard deviation.
"""

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np
import torch
from torch import Tensor

from finlab.arrays import AnyArray
from finlab.errors import DataError
from finlab.files import parse_json
from finlab.files.checkpoint_config import WrenchNormalization
from finlab.files.guarded import decoded, read_file
from finlab.layout import FinModelSpec, Layout
from finlab.physics import Plant
from finlab.research.executor import cores, map_parts
from finlab.research.networks.trained import to_normalized
from finlab.research.paper.network import raw_features
from finlab.research.random_layouts import TRAINING_FINS, random_layout
from finlab.research.training.loop import seeded_generator
from finlab.whole_file import make_folder, remove_temporary_files, write_whole

DATA_SEED = 20_000
"""Leads the seed of every layout; no evaluation's seed begins like this."""
N_FINS = TRAINING_FINS[1]
"""Fins that every robot is padded to."""
PART = 250_000
"""Samples of a part."""
LEAST_STD = 1e-6
"""Least standard deviation of an axis (paper: std floor)."""
DATA_FILE = "data.json"
FORMAT = "finlab-data"
VERSION = 1
ROBOT = ("position", "mounting_angle", "lower", "upper", "mask")
"""Arrays of a part that each layout has once."""
FIELDS = (*ROBOT, "command", "wrench")
"""All arrays of a part, layouts first; see `SampleTable.of`."""


@dataclass(frozen=True)
class DataSettings:
    """How a data set is drawn."""

    layouts: int = 1000
    commands: int = 5000
    """Commands on each layout."""
    seed: int = 0
    varied_limits: float = 0.5
    """Share of the layouts whose fins have limits of their own; not printed."""
    fin_model: FinModelSpec = FinModelSpec()
    """Fin model that causes the wrenches."""

    @property
    def together(self) -> int:
        """Layouts of a part."""
        return max(1, PART // self.commands)

    def as_values(self) -> dict[str, Any]:
        """The settings as in `data.json`."""
        model = {"type": self.fin_model.type, **dict(self.fin_model.parameters)}
        return asdict(replace(self, fin_model=FinModelSpec())) | {"fin_model": model}


def generate(folder: Path, settings: DataSettings) -> None:
    """Write a data set, its parts drawn by `map_parts` on all cores; parts that are there stay.
    Raises DataError: the folder holds a set that was drawn otherwise, or a file cannot be
    written."""
    make_folder(folder)
    remove_temporary_files(folder)
    if (folder / DATA_FILE).exists() and about(folder)["settings"] != settings.as_values():
        raise DataError(
            f"{folder}: holds a data set that was drawn otherwise; take an empty folder"
        )
    _write_about(folder, settings, None)
    count = -(-settings.layouts // settings.together)
    missing = [number for number in range(count) if not part_file(folder, number).exists()]
    drawn = map_parts(partial(drawn_part, settings), missing, "data", jobs=cores())
    for number, content in zip(missing, drawn, strict=True):
        write_whole(part_file(folder, number), content, DataError)
    rows = (
        read_part(part_file(folder, k))["wrench"].reshape(-1, 6).astype(np.float64)
        for k in range(count)
    )
    sums = [(wrench.sum(0), (wrench**2).sum(0)) for wrench in rows]
    total = np.sum(sums, axis=0) / (settings.layouts * settings.commands)
    deviation = np.sqrt(np.maximum(total[1] - total[0] ** 2, 0.0))
    _write_about(folder, settings, WrenchNormalization(total[0], np.maximum(deviation, LEAST_STD)))


def drawn_part(settings: DataSettings, number: int) -> bytes:
    """The content of the file of part `number`: the arrays `FIELDS` as npz."""
    first = number * settings.together
    some = range(first, min(first + settings.together, settings.layouts))
    robots = [samples_of(settings, k) for k in some]
    content = io.BytesIO()
    arrays = {name: np.stack([robot[name] for robot in robots]) for name in FIELDS}
    np.savez(content, allow_pickle=False, **arrays)
    return content.getvalue()


def samples_of(settings: DataSettings, number: int) -> dict[str, AnyArray]:
    """One layout padded with zeros, and its commands; they depend on the seed and the number
    alone."""
    rng = np.random.default_rng([DATA_SEED, settings.seed, number])
    varied = rng.random() < settings.varied_limits
    layout = random_layout(rng, limits="varied" if varied else "nominal")
    if settings.fin_model != FinModelSpec():
        fins = tuple(replace(fin, model=settings.fin_model) for fin in layout.fins)
        layout = Layout(layout.name, fins)
    plant = Plant(layout)
    command = plant.sample(rng, (settings.commands,))
    n = layout.n

    def padded(values: AnyArray) -> AnyArray:
        result = np.zeros((N_FINS, *values.shape[1:]), np.float32)
        result[:n] = values
        return result

    padded_command = np.zeros((settings.commands, N_FINS, 3), np.float32)
    padded_command[:, :n] = command
    return {
        **{name: padded(getattr(layout, name)) for name in ROBOT[:-1]},
        "mask": np.arange(N_FINS) < n,
        "command": padded_command,
        "wrench": plant.wrench(command).astype(np.float32),
    }


def part_file(folder: Path, number: int) -> Path:
    """Where part `number` lies in the folder of a data set."""
    return folder / f"part-{number:05d}.npz"


def read_part(path: Path) -> dict[str, AnyArray]:
    """The arrays of a part by name, R layouts, then commands (R, C, n, 3) and wrenches (R, C, 6)
    [N, N m].

    Raises DataError: it is missing or damaged."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in FIELDS}
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
        raise DataError(
            f"{path}: no part of a data set ({error}); remove it and generate again"
        ) from error


def about(folder: Path) -> dict[str, Any]:
    """What `data.json` says: settings and normalization. Raises DataError: there is none."""
    path = folder / DATA_FILE
    text = decoded(
        read_file(path, 1_000_000, "a data set's file", DataError), str(path), "JSON", DataError
    )
    about = parse_json(text, str(path), DataError)
    if not isinstance(about, dict) or (about.get("format"), about.get("version")) != (
        FORMAT,
        VERSION,
    ):
        raise DataError(
            f"{path}: not a finlab data set (expected format {FORMAT!r}, version {VERSION})"
        )
    return about


def _write_about(
    folder: Path, settings: DataSettings, normalization: WrenchNormalization | None
) -> None:
    values = normalization and {
        name: part.tolist() for name, part in normalization._asdict().items()
    }
    about = {
        "format": FORMAT,
        "version": VERSION,
        "settings": settings.as_values(),
        "normalization": values,
    }
    write_whole(folder / DATA_FILE, json.dumps(about, indent=2) + "\n", DataError)


class SampleBatch(NamedTuple):
    """B samples as the networks take them, float32: each a robot padded to n fins, a command and
    its wrench."""

    features: Tensor
    """Node features x_i (B, n, 10), as `raw_features` scales them."""
    position: Tensor
    """(B, n, 3), body frame [m]."""
    mask: Tensor
    """(B, n) bool, True where there is a fin."""
    command: Tensor
    """(B, n, 3) in normalized coordinates: within the limits, which are -1 and 1."""
    wrench: Tensor
    """(B, 6) that the command causes [N, N m]."""


class SampleTable(NamedTuple):
    """C samples of each of R robots, in the units of `SampleBatch`. All that does not depend on
    weights is worked out here, once, and a batch is gathered."""

    features: Tensor
    """(R, n, 10)."""
    position: Tensor
    """(R, n, 3)."""
    mask: Tensor
    """(R, n)."""
    command: Tensor
    """(R C, n, 3), robot after robot."""
    wrench: Tensor
    """(R C, 6)."""

    @classmethod
    def of(cls, arrays: Mapping[str, Tensor]) -> "SampleTable":
        """Returns the table of samples as they are drawn.

        Args:
            arrays: `FIELDS` by name, R robots, their commands (R, C, n, 3) [rad, Hz, rad] and
                wrenches (R, C, 6) [N, N m].
        """
        position, angle, lower, upper, mask, command, wrench = (arrays[name] for name in FIELDS)
        features = raw_features(position, angle, lower, upper)
        normalized = to_normalized(command, lower[:, None], upper[:, None])
        return cls(features, position, mask, normalized.flatten(0, 1), wrench.flatten(0, 1))

    def batch(self, chosen: Tensor) -> SampleBatch:
        """Returns the samples with the numbers (B,), counted robot after robot."""
        commands = len(self.command) // len(self.mask)
        robot = chosen // commands
        return SampleBatch(
            features=self.features.index_select(0, robot),
            position=self.position.index_select(0, robot),
            mask=self.mask.index_select(0, robot),
            command=self.command.index_select(0, chosen),
            wrench=self.wrench.index_select(0, chosen),
        )


class SampleSet:
    """A data set in the memory of a device, and its batches."""

    def __init__(self, folder: Path, device: torch.device) -> None:
        """Read a data set. Raises DataError: it is missing, unfinished or damaged."""
        said = about(folder)
        try:
            self.settings: dict[str, Any] = said["settings"]
            """As in `data.json`."""
            self.layouts, self.commands = (
                int(self.settings[name]) for name in ("layouts", "commands")
            )
            self.normalization = WrenchNormalization.parse(said["normalization"])
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(
                f"{folder}: an unfinished data set; run `finlab data generate` again"
            ) from error
        self._table = _read_table(folder, self.layouts, self.commands, device)
        self.sha256 = data_hash(folder)
        """SHA-256 of its files."""
        self._device = device
        self._order = torch.empty(0)
        self._order_of: tuple[int, int, int] | None = None
        """Seed, epoch and length of the order at hand; None before the first batch."""

    def batch(self, step: int, size: int, seed: int, one_layout: bool, rows: slice) -> SampleBatch:
        """Some rows of batch number `step` of `size` samples, a function of step and seed: random
        commands of one layout (paper, surrogate pretraining), a new one in each step, or of all,
        reordered in each epoch. Raises DataError: there are fewer samples than a batch has."""
        count = self.layouts if one_layout else self.layouts * self.commands
        if not one_layout and size > count:
            raise DataError(
                f"batches of {size} samples need at least as many, the data set has {count}"
            )
        epoch, place = divmod(step, count if one_layout else count // size)
        if self._order_of != (seed, epoch, count):
            draw = seeded_generator(seed, epoch, self._device)
            self._order = torch.randperm(count, generator=draw, device=self._device)
            self._order_of = seed, epoch, count
        if one_layout:
            draw = seeded_generator(seed, 1_000_000 + step, self._device)
            command = torch.randint(self.commands, (size,), generator=draw, device=self._device)
            chosen = self._order[place] * self.commands + command[rows]
        else:
            chosen = self._order[place * size : (place + 1) * size][rows]
        return self._table.batch(chosen)


def data_hash(folder: Path) -> str:
    """Returns the SHA-256 of a data set's files, one after the other."""
    sha256 = hashlib.sha256((folder / DATA_FILE).read_bytes())
    for path in sorted(folder.glob("part-*.npz")):
        sha256.update(path.read_bytes())
    return sha256.hexdigest()


@lru_cache(maxsize=1)
def fresh_batch(settings: DataSettings) -> SampleBatch:
    """All samples of a data set, in memory alone."""
    robots = [samples_of(settings, k) for k in range(settings.layouts)]
    joined = {name: np.stack([robot[name] for robot in robots]) for name in FIELDS}
    everything = torch.arange(settings.layouts * settings.commands)
    return SampleTable.of(_tensors(joined)).batch(everything)


def _read_table(folder: Path, layouts: int, commands: int, device: torch.device) -> SampleTable:
    """The table of a folder's parts on a device. Raises DataError: a part is missing or damaged, or
    together they hold other samples."""
    count = -(-layouts // DataSettings(commands=commands).together)
    parts = []
    for number in range(count):
        path = part_file(folder, number)
        arrays = read_part(path)
        try:
            parts.append(SampleTable.of(_tensors(arrays)))
        except (RuntimeError, TypeError) as error:  # arrays of other shapes or types
            reason = str(error).splitlines()[0][:120]
            raise DataError(
                f"{path}: no part of a data set ({reason}); remove it and generate again"
            ) from error
    robots = sum(len(part.mask) for part in parts)
    samples = sum(len(part.wrench) for part in parts)
    if (robots, samples) != (layouts, layouts * commands):
        raise DataError(f"{folder}: its parts are not those of its {DATA_FILE}")
    joined = [torch.cat(fields).to(device) for fields in zip(*parts, strict=True)]
    return SampleTable._make(joined)


def _tensors(arrays: Mapping[str, AnyArray]) -> dict[str, Tensor]:
    return {name: torch.from_numpy(array) for name, array in arrays.items()}
