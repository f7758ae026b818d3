"""Where and from what a report was made: enough to make it again."""

import hashlib
import os
import platform
import re
import subprocess
from contextlib import suppress
from pathlib import Path

import numpy as np
import scipy

import finlab
from finlab.networks.checkpoint import resolve_checkpoint

CHECKPOINTS = ("default", "paper")


def source_commit() -> str:
    """Commit of the source tree this runs from, `+` for changes that are not in it; the package's version
    where there is no tree."""

    def git(*arguments: str) -> str:
        root = Path(finlab.__file__).resolve().parent.parent
        command = ["git", "-C", str(root), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()

    try:
        commit = git("rev-parse", "--short=10", "HEAD")
        changed = git("status", "--porcelain", "--untracked-files=no", "--", "finlab", "checkpoints")
    except (OSError, subprocess.SubprocessError):
        return f"version {finlab.__version__}"
    return f"{commit}+" if changed else commit


def source_digest() -> str:
    """Digest of all modules of the library and of the shipped networks."""
    total = hashlib.sha256()
    root = Path(finlab.__file__).resolve().parent
    folders = [resolve_checkpoint(name) for name in CHECKPOINTS]
    files = [
        *root.rglob("*.py"),
        *(path for folder in folders for path in folder.iterdir() if path.is_file()),
    ]
    for path in sorted(files):
        total.update(path.name.encode() + path.read_bytes())
    return total.hexdigest()


def machine() -> dict[str, str]:
    """What this runs on: processor, cores, and versions of what answers rest on."""
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
    }


def _processor() -> str:
    """The processor's name as Linux tells it, or what Python knows."""
    with suppress(OSError):
        named = re.search(r"^model name\s*: *(.+)$", Path("/proc/cpuinfo").read_text("utf-8"), re.MULTILINE)
        if named:
            return named[1].strip()
    return platform.processor() or platform.machine()
