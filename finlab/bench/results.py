"""Results of a run as a JSON file, and those of finlab's own methods that are shipped."""

import json
import os
import time
from pathlib import Path
from typing import Any

from finlab.bench.problems import Problems
from finlab.errors import DataError
from finlab.evaluation.experiments.latency import machine
from finlab.evaluation.report.provenance import source_commit
from finlab.whole_file import write_whole

FORMAT = "finlab-bench-results"
VERSION = 1
MAX_BYTES = 5_000_000
"""Largest file that is read."""


def results(
    methods: list[dict[str, Any]],
    problems: Problems,
    *,
    quick: bool,
    together: bool,
    limit_s: float,
    command: str,
) -> dict[str, Any]:
    """Figures of methods, with what is needed to make them again."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "problems": problems.checksum,
        "seed": problems.about.get("seed"),
        "quick": quick,
        "together": together,
        "limit_s": limit_s,
        "command": command,
        "commit": source_commit(),
        "made": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "machine": {**machine(), "load": f"{os.getloadavg()[0]:.1f}"},
        "methods": methods,
    }


def save_results(found: dict[str, Any], path: str | os.PathLike[str]) -> None:
    """Write them whole."""
    write_whole(path, json.dumps(found, indent=1, allow_nan=False) + "\n", DataError)


def read_results(path: Path) -> dict[str, Any]:
    """Results from a file.

    Raises:
        DataError: it cannot be read, or is of another format or version.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise DataError(f"{path}: is larger than {MAX_BYTES:,} bytes, too large for results")
        found = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise DataError(f"{path}: is no JSON") from None
    about = (found.get("format"), found.get("version")) if isinstance(found, dict) else (None, None)
    if about != (FORMAT, VERSION):
        raise DataError(
            f"{path}: expected {FORMAT} of version {VERSION}, got {about[0]!r:.60} {about[1]!r:.20}"
        )
    return dict(found)


def stored_results(quick: bool) -> Path:
    """File of the shipped results of a whole run, or of a quick one."""
    return Path(__file__).with_name("results-quick.json" if quick else "results.json")


def comparable(problems: Problems, *, quick: bool, together: bool) -> dict[str, Any] | None:
    """The shipped results, where they are answers to the same questions."""
    path = stored_results(quick)
    found = read_results(path) if path.exists() else None
    same = found is not None and (found["problems"], found["together"]) == (problems.checksum, together)
    return found if same else None
