"""Origin of figures: the commit of the tree, the machine, and versions of packages."""

import os
import platform
import subprocess
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import finlab

PROCESSOR_FILE = Path("/proc/cpuinfo")
"""Where Linux says which processor there is."""


def commit_words() -> str:
    """Returns the commit of the source tree, and whether what is not documentation was changed
    since; of an installation the version."""
    version_words = f"version {finlab.__version__}"
    tree = Path(finlab.__file__).parents[1]
    if not (tree / ".git").exists():
        return version_words
    git = ["git", "-C", str(tree)]
    described = subprocess.run(
        [*git, "describe", "--always", "--abbrev=12", "--exclude=*"], capture_output=True, text=True
    )
    if described.returncode:
        return version_words
    # The record itself, which is written piece by piece, is no change of what is measured.
    is_changed = subprocess.run([*git, "diff", "--quiet", "HEAD", "--", ".", ":!docs"]).returncode
    return f"commit {described.stdout.strip()}{' and changes' if is_changed else ''}"


def machine_words() -> str:
    """Returns the processor, how many cores of it there are, and the system."""
    cores = os.cpu_count() or 1
    noun = "core" if cores == 1 else "cores"
    return f"{processor_name()}, {cores} {noun}, {platform.system()} on {platform.machine()}"


def processor_name() -> str:
    """Returns the processor's name, as the system says it."""
    if PROCESSOR_FILE.exists():
        for line in PROCESSOR_FILE.read_text(encoding="utf-8").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                return value.strip()
    return platform.processor() or "a processor without a name"


def version_words(packages: Iterable[str]) -> str:
    """Returns the version of Python and of packages; those that are not installed are left out.

    Args:
        packages: names of distributions.
    """
    words = [f"Python {platform.python_version()}"]
    for name in packages:
        try:
            words.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(words)
