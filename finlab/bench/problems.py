"""The problems of the benchmark: robots, wrenches asked of them, and the best that is known, in one NPZ file.

Arrays hold what is numeric, the member `index` holds the rest as JSON (UTF-8 bytes), so that the file can be
read without finlab; `problems.schema.json` says what the index holds. A checksum guards all of it.
"""

import hashlib
import io
import json
import os
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.layout.file import parse_layout
from finlab.physics import TableLaw, write_table
from finlab.whole_file import write_whole

FORMAT = "finlab-bench-problems"
VERSION = 1
FILE = Path(__file__).with_name("problems.npz")
"""The problems that are shipped."""
KINDS = ("inside", "boundary", "beyond-1.2", "beyond-2", "beyond-3")
"""Where a target lies: a wrench of random commands, on the boundary of what the robot can give, or so many
times as far out."""
MAX_BYTES = 64_000_000
"""Largest file that is read."""
QUICK_SEQUENCES = 2
"""Sequences of a quick run."""


class Targets(NamedTuple):
    """N wrenches that are asked for one by one; NaN is what is not known."""

    robot: NDArray[np.int64]
    """Place (N,) of each one's robot."""
    kind: NDArray[np.int64]
    """Place (N,) in `KINDS`."""
    wrench: Array
    """What is asked for (N, 6) [N, N m]."""
    best_error: Array
    """The least normalized error (N,) of any command known; 0 inside."""
    error_bound: Array
    """Normalized error (N,) that no command undercuts, by a convex problem."""
    power_best: Array
    """The least mean mechanical power (N,) [W] of any exact command known."""
    power_bound: Array
    """Power (N,) [W] that no exact command undercuts, by the convex dual, to about a thousandth."""
    effort_best: Array
    """The least effort (N,) of any exact command known."""


class Sequences(NamedTuple):
    """S paths of T wrenches, asked for tick by tick with the method's previous command."""

    robot: NDArray[np.int64]
    """Place (S,) of each one's robot."""
    noisy: NDArray[np.bool_]
    """Whether noise (S,) was added to the path."""
    wrench: Array
    """What is asked for (S, T, 6) [N, N m]."""
    best_error: Array
    """The least normalized error (S, T) of any command known."""


@dataclass(frozen=True)
class Robot:
    """One robot of the benchmark, as the index describes it."""

    set: str
    """The set it belongs to."""
    description: dict[str, Any]
    """Its layout file as plain values; force tables are named by files that `Problems` writes."""
    sigma: tuple[float, ...]
    """What errors are divided by, axis by axis [N, N m]."""
    tables: dict[str, dict[str, Any]]
    """Files of force tables: axes, and the name of the array (A, f, phi, 3) that holds the forces [N]."""


@dataclass(frozen=True)
class Problems:
    """All robots and what is asked of them."""

    about: dict[str, Any]
    """Where the problems come from: seed, command, and how each yardstick was found."""
    robots: tuple[Robot, ...]
    """The robots, set by set."""
    targets: Targets
    """Single wrenches."""
    sequences: Sequences
    """Paths."""
    forces: dict[str, AnyArray]
    """Force tables by name."""
    checksum: str = ""
    """SHA-256 of the file that they came from."""

    @cached_property
    def _folder(self) -> "TemporaryDirectory[str]":
        return TemporaryDirectory(prefix="finlab-bench-")

    def layout(self, place: int) -> Layout:
        """The layout of the robot at a place; its force tables lie in a folder that is gone with this."""
        robot, folder = self.robots[place], Path(self._folder.name)
        for name, table in robot.tables.items():
            if not (folder / name).exists():
                axes = [np.asarray(table[key], np.float64) for key in ("amplitude", "frequency", "direction")]
                law = TableLaw(axes, self.forces[table["force"]].astype(np.float64), periodic=True)
                write_table(folder / name, law, *axes)
        return parse_layout(robot.description, f"robot {place}", folder)

    def sigma(self, place: int) -> Array:
        """The yardstick of errors (6,) of the robot at a place."""
        return np.array(self.robots[place].sigma)

    def quick(self) -> "Self":
        """The first robot of each set with all of its targets, and the first sequences."""
        first = {robot.set: place for place, robot in reversed(list(enumerate(self.robots)))}
        few = self._among(list(first.values()))
        paths = Sequences._make(values[:QUICK_SEQUENCES] for values in self.sequences)
        return replace(few, sequences=paths)

    def of_sets(self, names: Sequence[str]) -> "Self":
        """What is asked of some sets of robots.

        Raises:
            DataError: there is no such set.
        """
        known = list(dict.fromkeys(robot.set for robot in self.robots))
        if unknown := [name for name in names if name not in known]:
            raise DataError(f"sets: expected some of {', '.join(known)}, got {unknown[0]!r}")
        return self._among([place for place, robot in enumerate(self.robots) if robot.set in names])

    def _among(self, places: list[int]) -> "Self":
        """What is asked of robots at some places."""
        asked, paths = np.isin(self.targets.robot, places), np.isin(self.sequences.robot, places)
        targets = Targets._make(values[asked] for values in self.targets)
        return replace(
            self, targets=targets, sequences=Sequences._make(values[paths] for values in self.sequences)
        )


def save_problems(problems: Problems, path: str | os.PathLike[str]) -> str:
    """Write the file whole; returns its checksum."""
    index: dict[str, Any] = {"format": FORMAT, "version": VERSION, **problems.about, "kinds": list(KINDS)}
    index["robots"] = [
        {"set": r.set, "layout": r.description, "sigma": list(r.sigma), "tables": r.tables}
        for r in problems.robots
    ]
    arrays: dict[str, AnyArray] = dict(problems.forces)
    arrays |= {f"target_{name}": values for name, values in problems.targets._asdict().items()}
    arrays |= {f"sequence_{name}": values for name, values in problems.sequences._asdict().items()}
    index["checksum"] = checksum_of(index, arrays)
    buffer = io.BytesIO()
    text = np.frombuffer(json.dumps(index, separators=(",", ":")).encode(), np.uint8)
    np.savez_compressed(buffer, allow_pickle=False, index=text, **arrays)
    write_whole(path, buffer.getvalue(), DataError)
    return str(index["checksum"])


def open_problems(path: str | os.PathLike[str] = FILE) -> Problems:
    """Read a file of problems, by default the shipped one.

    Raises:
        DataError: it cannot be read, is of another format or version, or was changed.
    """
    index, arrays = _read(Path(path))
    if index.get("format") != FORMAT:
        raise DataError(f"{path}: expected format {FORMAT}, got {index.get('format')!r:.60}")
    if index.get("version") != VERSION or index["version"] is True:
        raise DataError(f"{path}: this finlab reads version {VERSION}, got {index.get('version')!r:.60}")
    if index.get("checksum") != checksum_of(index, arrays):
        raise DataError(f"{path}: the checksum does not fit the contents; the file was changed, get it again")
    try:
        robots = [Robot(r["set"], r["layout"], tuple(r["sigma"]), r["tables"]) for r in index["robots"]]
        targets = Targets(*(arrays[f"target_{name}"] for name in Targets._fields))
        paths = Sequences(*(arrays[f"sequence_{name}"] for name in Sequences._fields))
        files = [name for robot in robots for name in robot.tables]
    except (KeyError, TypeError) as error:
        raise DataError(f"{path}: is incomplete or of another form: {error}") from None
    if foreign := [name for name in files if Path(name).name != name]:
        raise DataError(f"{path}: a force table would be written outside of its folder: {foreign[0]!r:.80}")
    named = ("format", "version", "checksum", "kinds", "robots")
    about = {key: value for key, value in index.items() if key not in named}
    forces = {name: values for name, values in arrays.items() if name.startswith("table_")}
    return Problems(about, tuple(robots), targets, paths, forces, index["checksum"])


def _read(path: Path) -> tuple[dict[str, Any], dict[str, AnyArray]]:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise DataError(f"{path}: is larger than {MAX_BYTES:,} bytes, too large for a file of problems")
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        index = json.loads(arrays.pop("index").tobytes().decode())
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, EOFError, AttributeError, zipfile.BadZipFile):
        raise DataError(f"{path}: is no file of problems; expected an NPZ with a member `index`") from None
    if not isinstance(index, dict):
        raise DataError(f"{path}: index: expected an object, got {type(index).__name__}")
    return index, arrays


def checksum_of(index: dict[str, Any], arrays: dict[str, AnyArray]) -> str:
    """SHA-256 of everything but the checksum, independent of how the file is packed."""
    rest = {key: value for key, value in index.items() if key != "checksum"}
    digest = hashlib.sha256(json.dumps(rest, sort_keys=True, separators=(",", ":")).encode())
    for name, values in sorted(arrays.items()):
        digest.update(f"{name} {values.dtype.str} {values.shape} ".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return f"sha256:{digest.hexdigest()}"
