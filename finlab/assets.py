"""Files installed with finlab: shipped layouts, checkpoints and the web app; and the extras that
bring optional packages.

The shipped folders stand at the top of a source tree, and inside the package in a wheel.
"""

import os
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from finlab.errors import CheckpointError

DISTRIBUTION = "finlab-marine"
"""Name of the distribution; the package that is imported is called `finlab`."""
OTHER_DISTRIBUTION = "finlab"
"""Name of a distribution of others, for the analysis of stocks, whose package and script are called
`finlab`, too."""
EXTRA_OF_PACKAGE = {
    "torch": "train",
    "matplotlib": "plot",
    "viser": "app",
    "trimesh": "app",
    "casadi": "ipopt",
    "distributed": "cluster",
    "mujoco": "mujoco",
}
"""Optional package -> the extra of the distribution that brings it."""
PAPER_LAYOUTS = ("A", "B", "C", "D")
"""The shipped layouts that are the paper's."""

_PACKAGE = Path(__file__).resolve().parent


def install_command(extra: str) -> str:
    """Returns the command that installs an extra, for error messages."""
    return f"pip install '{DISTRIBUTION}[{extra}]'"


def other_distribution(folders: Iterable[str] | None = None) -> str | None:
    """Returns the folder of metadata of the other distribution that owns the name `finlab`.

    A look into the folders of packages takes a millisecond; `importlib.metadata`, which reads the
    metadata of all packages, many.

    Args:
        folders: where packages are; those of `sys.path` when None.

    Returns:
        Its path; None where it is not installed.
    """
    for folder in sys.path if folders is None else folders:
        with suppress(OSError):  # not every entry is a folder
            for name in os.listdir(folder or "."):
                is_metadata = name.endswith((".dist-info", ".egg-info"))
                if is_metadata and name.startswith(f"{OTHER_DISTRIBUTION}-"):
                    return os.path.join(folder, name)
    return None


def warning_of_other_distribution() -> str | None:
    """Returns a sentence where the other distribution is installed beside this one, at the first
    start alone; None otherwise. A file in the user's cache says that it was said."""
    other_path = other_distribution()
    if other_path is None:
        return None
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    mark = Path(cache) / DISTRIBUTION / f"told-of-{os.path.basename(other_path)}"
    if mark.exists():
        return None
    with suppress(OSError):  # then it is said again
        mark.parent.mkdir(parents=True, exist_ok=True)
        mark.touch()
    return (
        f"{other_path}: another distribution, {OTHER_DISTRIBUTION!r}, is installed beside "
        f"{DISTRIBUTION!r}; both bring a package and a script of the name finlab, and the later "
        "one has overwritten files of the other. Give each an environment of its own; the script "
        f"{DISTRIBUTION} is this one's."
    )


def shipped_folder(name: str) -> Path:
    """Returns the path of a shipped folder: `layouts`, `checkpoints` or `webapp`.

    It is the folder of the source tree, or its copy in an installed wheel.
    """
    in_wheel = _PACKAGE / "shipped" / name
    return in_wheel if in_wheel.is_dir() else _PACKAGE.parent / name


def shipped_layouts() -> dict[str, Path]:
    """Returns the shipped layouts: file name without its ending, to path; sorted by name."""
    return {path.stem: path for path in sorted(shipped_folder("layouts").glob("*.yaml"))}


def shipped_checkpoints() -> dict[str, Path]:
    """Returns the shipped checkpoints: name to folder; sorted by name."""
    configs = sorted(shipped_folder("checkpoints").glob("*/config.json"))
    return {config.parent.name: config.parent for config in configs}


def checkpoint_path(name: str = "default") -> Path:
    """Returns the folder of a shipped checkpoint.

    Raises:
        CheckpointError: none of that name is shipped.
    """
    known = shipped_checkpoints()
    if name not in known:
        raise CheckpointError(
            f"checkpoint {name!r} is not among the shipped ones ({', '.join(known) or 'none'}) in "
            f"{shipped_folder('checkpoints')}; name one of them, or pass the folder of your own"
        )
    return known[name]
