"""What is installed with finlab: shipped layouts, checkpoints and the web app, and the extras that
bring optional packages.

The shipped folders stand at the top of a source tree, and inside the package in a wheel.
"""

from pathlib import Path

from finlab.errors import CheckpointError

DISTRIBUTION = "finlab-marine"
"""Name of the distribution; the package that is imported is called `finlab`."""
EXTRA_OF_PACKAGE = {
    "torch": "train",
    "matplotlib": "plot",
    "viser": "app",
    "trimesh": "app",
    "casadi": "ipopt",
    "distributed": "cluster",
}
"""Optional package -> the extra of the distribution that brings it."""
PAPER_LAYOUTS = ("A", "B", "C", "D")
"""The shipped layouts that are the paper's."""

_PACKAGE = Path(__file__).resolve().parent


def install_command(extra: str) -> str:
    """Returns the command that installs an extra, for error messages."""
    return f"pip install '{DISTRIBUTION}[{extra}]'"


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
