"""Where and from what a report was made."""

from __future__ import annotations

import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import finlab
from finlab.evaluation.experiments.latency import machine


@dataclass(frozen=True)
class Provenance:
    """What a reader needs to make the report again."""

    commit: str
    """Of the source tree, `+` for changes that are not in it; the version where there is no tree."""
    made: str
    """Time of day, UTC."""
    machine: dict[str, str]
    """Processor, cores and versions."""
    checkpoints: dict[str, str]
    """Name of each checkpoint -> SHA-256 of its weights."""
    seed: int
    """Of all draws."""
    command: str
    """That makes it again."""


def source_commit() -> str:
    """Commit of the source tree this runs from; the package's version where there is none."""
    root = Path(finlab.__file__).resolve().parent.parent
    try:
        commit = _git(root, "rev-parse", "--short=10", "HEAD")
        changed = _git(root, "status", "--porcelain", "--untracked-files=no", "--", "finlab", "checkpoints")
    except (OSError, subprocess.SubprocessError):
        return f"version {finlab.__version__}"
    return f"{commit}+" if changed else commit


def make_provenance(checkpoints: dict[str, str], seed: int, command: str) -> Provenance:
    """What is known now."""
    made = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())
    return Provenance(source_commit(), made, machine(), checkpoints, seed, command)


def _git(root: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", *arguments], cwd=root, capture_output=True, text=True, check=True, timeout=10
    )
    return done.stdout.strip()
