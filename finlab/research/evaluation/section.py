"""A section of a report: an experiment run piece by piece, each kept on disk with where it comes
from.

A piece is one method, split or loss of an experiment. A piece that is there, of the same options
and of sources that have not changed, is not run again, so that a report that was stopped goes on.
Where sources have changed, a *probe*, the piece at a size of seconds, is run first: if it gives the
figures of the probe that was stored, the piece stands, and says at which commit that was checked.
"""

import json
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from finlab.errors import DataError
from finlab.files import parse_json
from finlab.files.guarded import decoded, read_file
from finlab.research.evaluation.document import Row
from finlab.research.evaluation.experiment import Experiment, load_experiment
from finlab.research.evaluation.origin import commit_words, machine_words
from finlab.research.evaluation.source_hash import package_hashes
from finlab.whole_file import make_folder, write_whole

FOLDER = "sections"
"""Folder of the sections' files in that of a report."""
MAX_BYTES = 50_000_000
"""Largest size of a section's file [bytes]."""
SAME = 1e-6
"""Relative difference up to which figures of two probes are the same."""
TIMES = ("_ms", "_s")
"""Ends of the keys of times, which depend on the machine and count in no comparison."""
METHOD_PACKAGES: dict[str, tuple[str, ...]] = {
    "dual": ("finlab/allocation/dual", "finlab/core/src"),
    "mdn": ("finlab/research/mdn", "finlab/research/networks", "checkpoints/default"),
    "paper": ("finlab/research/paper", "finlab/research/networks", "checkpoints/paper"),
    "qp": ("finlab/allocation/baselines/linear.py",),
    "paper_sqp": ("finlab/allocation/baselines/linear.py",),
    "sqp": ("finlab/allocation/baselines/sqp.py",),
    "ipopt": ("finlab/allocation/baselines/ipopt.py",),
    "analytic": ("finlab/allocation/baselines/pseudo_inverse.py",),
    "fixed_frequency": ("finlab/allocation/baselines/pseudo_inverse.py",),
}
"""Method -> what of the source tree decides its answers."""


@dataclass(frozen=True)
class Piece:
    """Rows of a part of an experiment, and where they come from."""

    options: Mapping[str, Any]
    """All options of the run, plain values."""
    rows: Sequence[Row]
    """What it gave."""
    probe: Sequence[Row]
    """What it gave at the size of seconds; empty where there is no such size."""
    measured: Mapping[str, str]
    """Hash of each package that decides the rows."""
    commit: str
    """Of the tree that ran it."""
    machine: str
    """Processor and system."""
    processor_s: float
    """Processor time of the run [s]."""
    checked: str = ""
    """Commit at which the probe last gave the same figures; empty where `commit` is that."""


def packages_of(experiment: Experiment, options: Mapping[str, Any]) -> list[str]:
    """Returns what of the source tree decides the rows of a piece.

    Args:
        experiment: the experiment.
        options: of the piece.
    """
    packages = [*experiment.measures]
    for method in options.get("methods") or ():
        packages += METHOD_PACKAGES.get(method, ())
    return packages


def stale_packages(experiment: Experiment, piece: Piece) -> list[str]:
    """Returns the packages that have changed since a piece was made, or last checked."""
    now = package_hashes(packages_of(experiment, piece.options))
    return [name for name, value in now.items() if piece.measured.get(name) != value]


def piece_options(experiment: Experiment, options: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Returns the options of each piece of a run: one value of each option that it is split by.

    Args:
        experiment: the experiment.
        options: of the whole run.
    """
    all_options = experiment.check(options)
    names = [name for name in experiment.pieces if all_options[name] is not None]
    pieces = []
    for values in product(*(all_options[name] for name in names)):
        chosen = {name: (value,) for name, value in zip(names, values, strict=True)}
        pieces.append({**all_options, **chosen})
    return pieces


def made_section(experiment: Experiment, options: Mapping[str, Any], out: Path) -> list[Piece]:
    """Runs the pieces of a section that are missing or out of date, and returns all of them.

    Args:
        experiment: the experiment.
        options: of the run.
        out: folder of the report.

    Raises:
        DataError: a file cannot be read or written, or the options are wrong.
    """
    make_folder(out / FOLDER)
    path = section_path(out, experiment.name)
    stored = read_section(path) if path.exists() else []
    pieces: list[Piece] = []
    for wanted in piece_options(experiment, options):
        earlier = [piece for piece in stored if piece.options == _plain(wanted)]
        pieces.append(_current(experiment, wanted, earlier[0] if earlier else None))
        # What is stored of pieces yet to come stays until their turn.
        to_come = [piece for piece in stored if piece.options not in [p.options for p in pieces]]
        _write(path, [*pieces, *to_come])
    _write(path, pieces)
    return pieces


def section_path(out: Path, name: str) -> Path:
    """Returns the file of an experiment's section.

    Args:
        out: folder of the report.
        name: of the experiment.
    """
    return out / FOLDER / f"{name}.json"


def is_kept(name: str, out: Path) -> bool:
    """Returns whether a folder has a section of one run, not one that was stopped while it took the
    place of another.

    Args:
        name: of the experiment.
        out: folder of the report.

    Raises:
        DataError: the section cannot be read.
    """
    path = section_path(out, name)
    if not path.exists():
        return False
    experiment = load_experiment(name)
    runs = []
    for piece in read_section(path):
        of_all = {key: piece.options[key] for key in piece.options if key not in experiment.pieces}
        if of_all not in runs:
            runs.append(of_all)
    return len(runs) == 1 and set(runs[0]) <= set(experiment.options())


def kept_options(experiment: Experiment, pieces: Sequence[Piece]) -> dict[str, Any]:
    """Returns the options of the run whose pieces are kept: each option that it is split by with
    the values of all pieces.

    Args:
        experiment: the experiment.
        pieces: of its section.
    """
    options: dict[str, Any] = {}
    for name, value in pieces[0].options.items():
        options[name] = value
        if isinstance(value, list):
            options[name] = tuple(value)
        if name in experiment.pieces and value is not None:
            every = [each for piece in pieces for each in piece.options[name]]
            options[name] = tuple(dict.fromkeys(every))
    return options


def read_section(path: Path) -> list[Piece]:
    """Returns the pieces of a section's file. Raises DataError: it cannot be read."""
    content = read_file(path, MAX_BYTES, "a section of a report", DataError)
    values = parse_json(decoded(content, str(path), "JSON", DataError), str(path), DataError)
    try:
        return [Piece(**piece) for piece in values["pieces"]]
    except (KeyError, TypeError) as error:
        raise DataError(f"{path}: expected pieces of a section ({error}); remove it") from None


def rows_of(experiment: Experiment, pieces: Sequence[Piece]) -> list[Row]:
    """Returns the rows of all pieces, those that several of them have once, in the order of the
    experiment."""
    rows: list[Row] = []
    for piece in pieces:
        rows += [row for row in piece.rows if row not in rows]
    return rows if experiment.order is None else sorted(rows, key=experiment.order)


def _current(experiment: Experiment, wanted: Mapping[str, Any], stored: Piece | None) -> Piece:
    """The piece of some options: the stored one if it is of today's sources or its probe is, else
    one that is run now."""
    measured = package_hashes(packages_of(experiment, wanted))
    if stored is not None and stored.measured == measured:
        return stored
    probe = _probe(experiment, wanted)
    if stored is not None and probe and same_figures(probe, stored.probe):
        return replace(stored, measured=measured, checked=commit_words())
    started = time.process_time()
    rows = experiment.rows(**wanted)
    spent = time.process_time() - started
    return Piece(
        options=_plain(wanted),
        rows=_plain(rows),
        probe=probe,
        measured=measured,
        commit=commit_words(),
        machine=machine_words(),
        processor_s=round(spent, 1),
    )


def _probe(experiment: Experiment, wanted: Mapping[str, Any]) -> list[Row]:
    """Rows of the piece at the size of seconds; none where the experiment has no such size."""
    if not experiment.probe:
        return []
    rows: list[Row] = _plain(experiment.rows(**{**wanted, **experiment.probe}))
    return rows


def same_figures(first: Any, second: Any) -> bool:
    """Returns whether two lists of rows have the same figures, but for times.

    Args:
        first: rows, or a value of one.
        second: the other rows.
    """
    if isinstance(first, dict) and isinstance(second, dict):
        keys = [key for key in first if not _is_time(key)]
        others = [key for key in second if not _is_time(key)]
        return keys == others and all(same_figures(first[key], second[key]) for key in keys)
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        same_length = len(first) == len(second)
        return same_length and all(map(same_figures, first, second))
    if isinstance(first, float) and isinstance(second, int | float):
        return math.isclose(first, second, rel_tol=SAME, abs_tol=SAME)
    return bool(first == second)


def _is_time(key: str) -> bool:
    """Whether a key of a row stands for a time, or for its spread or interval."""
    plain = key.removesuffix("_interval").removesuffix("_std")
    return plain.endswith(TIMES) or "_ms_" in plain


def _write(path: Path, pieces: Sequence[Piece]) -> None:
    """Writes the file of a section."""
    values = {"pieces": [asdict(piece) for piece in pieces]}
    write_whole(path, json.dumps(values, indent=1) + "\n", DataError)


def _plain(value: Any) -> Any:
    """A value as it comes back from JSON: tuples are lists."""
    return json.loads(json.dumps(value))


def origin_words(pieces: Sequence[Piece]) -> Iterator[str]:
    """Yields sentences about where a section comes from: commit, machine, processor time."""
    minutes = sum(piece.processor_s for piece in pieces) / 60.0
    commits = ", ".join(dict.fromkeys(piece.commit for piece in pieces))
    machines = ", ".join(dict.fromkeys(piece.machine for piece in pieces))
    yield f"Made at {commits} on {machines}, {minutes:.1f} minutes of one core."
    checked = ", ".join(dict.fromkeys(piece.checked for piece in pieces if piece.checked))
    if checked:
        yield f"A part of it gave the same figures at {checked}."
