"""The problems of the benchmark: robots, wrenches asked of them, and the best that is known, in one NPZ file.

Arrays hold what is numeric, the member `index` holds the rest as JSON (UTF-8 bytes), so that the file can be
read without finlab; `problems.schema.json` describes the index.
"""

import hashlib
import os
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
from finlab.files.archive import json_of, read_arrays
from finlab.files.guarded import read_file
from finlab.layout import Layout
from finlab.layout.file import parse_layout
from finlab.physics import TableLaw, write_table

FORMAT, VERSION = "finlab-bench-problems", 2
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
    """Index (N,) of each one's robot."""
    kind: NDArray[np.int64]
    """Index (N,) in `KINDS`."""
    wrench: AnyArray
    """What is asked for (N, 6) [N, N m]."""
    best_error: Array
    """The least normalized error (N,) of any command known; 0 inside."""
    power_best: Array
    """The least mean mechanical power (N,) [W] of any exact command known."""
    effort_best: Array
    """The least effort (N,) of any exact command known."""


class Sequences(NamedTuple):
    """S paths of T wrenches, asked for tick by tick with the method's previous command."""

    robot: NDArray[np.int64]
    """Index (S,) of each one's robot."""
    noisy: NDArray[np.bool_]
    """Whether noise was added to the path (S,)."""
    wrench: AnyArray
    """What is asked for (S, T, 6) [N, N m]."""
    best_error: Array
    """The least normalized error (S, T) of any command known."""


@dataclass(frozen=True)
class BenchRobot:
    """One robot of the benchmark, as the index describes it."""

    set: str
    """The set it belongs to."""
    layout: dict[str, Any]
    """Its layout file as plain values; force tables are named by files that `Problems` writes."""
    sigma: tuple[float, ...]
    """What errors are divided by, axis by axis [N, N m]."""
    tables: dict[str, dict[str, Any]]
    """Files of force tables: axes, and the name of the array (A, f, phi, 3) that holds the forces [N]."""


@dataclass(frozen=True)
class Problems:
    """All robots and what is asked of them."""

    about: dict[str, Any]
    """Where the problems come from: seed, command, starts of the solver."""
    robots: tuple[BenchRobot, ...]
    """The robots, set by set."""
    targets: Targets
    """Single wrenches."""
    sequences: Sequences
    """Paths."""
    forces: dict[str, AnyArray]
    """Force tables by name."""
    checksum: str = ""
    """SHA-256 of the file that they came from, which says whether results are comparable."""

    @cached_property
    def _folder(self) -> "TemporaryDirectory[str]":
        return TemporaryDirectory(prefix="finlab-bench-")

    def layout(self, index: int) -> Layout:
        """The layout of a robot; its force tables lie in a folder that is deleted with this object."""
        robot, folder = self.robots[index], Path(self._folder.name)
        for name, table in robot.tables.items():
            if not (folder / name).exists():
                axes = [np.asarray(table[key], np.float64) for key in ("amplitude", "frequency", "direction")]
                law = TableLaw(axes, self.forces[table["force"]].astype(np.float64), periodic=True)
                write_table(folder / name, law, *axes)
        return parse_layout(robot.layout, f"robot {index}", folder)

    def sigma(self, index: int) -> Array:
        """What errors of a robot are divided by (6,)."""
        return np.array(self.robots[index].sigma)

    def quick(self) -> "Self":
        """The first robot of each set with all of its targets, and the first sequences."""
        first = {robot.set: index for index, robot in reversed(list(enumerate(self.robots)))}
        few = self._among(list(first.values()))
        return replace(few, sequences=Sequences._make(each[:QUICK_SEQUENCES] for each in self.sequences))

    def of_sets(self, names: Sequence[str]) -> "Self":
        """What is asked of some sets of robots.

        Raises:
            DataError: there is no such set.
        """
        known = list(dict.fromkeys(robot.set for robot in self.robots))
        if unknown := [name for name in names if name not in known]:
            raise DataError(f"sets: expected some of {', '.join(known)}, got {unknown[0]!r}")
        return self._among([index for index, robot in enumerate(self.robots) if robot.set in names])

    def _among(self, robots: list[int]) -> "Self":
        targets = Targets._make(each[np.isin(self.targets.robot, robots)] for each in self.targets)
        paths = Sequences._make(each[np.isin(self.sequences.robot, robots)] for each in self.sequences)
        return replace(self, targets=targets, sequences=paths)


def open_problems(path: str | os.PathLike[str] = FILE) -> Problems:
    """Read a file of problems, by default the shipped one.

    Raises:
        DataError: it cannot be read, or is of another format or version.
    """
    index, arrays = _read(Path(path))
    about = [index.get(key) for key in ("format", "version")]
    if about != [FORMAT, VERSION]:
        got = " ".join(f"{value!r:.60}" for value in about)
        raise DataError(f"{path}: expected {FORMAT} of version {VERSION}, got {got}")
    try:
        robots = tuple(BenchRobot(**{**robot, "sigma": tuple(robot["sigma"])}) for robot in index["robots"])
        targets = Targets(*(arrays[f"target_{name}"] for name in Targets._fields))
        paths = Sequences(*(arrays[f"sequence_{name}"] for name in Sequences._fields))
        files = [name for robot in robots for name in robot.tables]
    except (KeyError, TypeError) as error:
        raise DataError(f"{path}: is incomplete or of another form: {error}") from None
    if foreign := [name for name in files if Path(name).name != name]:
        raise DataError(f"{path}: a force table would be written outside of its folder: {foreign[0]!r:.80}")
    forces = {name: values for name, values in arrays.items() if name.startswith("table_")}
    rest = {key: index[key] for key in index.keys() - {"format", "version", "kinds", "robots"}}
    digest = hashlib.sha256(read_file(path, MAX_BYTES, "a file of problems")).hexdigest()
    return Problems(rest, robots, targets, paths, forces, f"sha256:{digest}")


def _read(path: Path) -> tuple[dict[str, Any], dict[str, AnyArray]]:
    arrays = read_arrays(path, None, MAX_BYTES, "a file of problems")
    if "index" not in arrays:
        raise DataError(f"{path}: is no file of problems; expected an NPZ with a member `index`")
    index = json_of(arrays.pop("index"), f"{path}: index")
    if not isinstance(index, dict):
        raise DataError(f"{path}: index: expected an object, got {type(index).__name__}")
    return index, arrays
