"""Installed things: shipped layouts, checkpoints and the web app, and the extras that bring more.

Shipped folders lie at the top of a source tree, in a wheel inside the package.
"""

from pathlib import Path

from finlab.errors import CheckpointError

NAME = "finlab-marine"
"""Name of the distribution; the package that is imported is called `finlab`."""
EXTRAS = {
    "torch": "train",
    "matplotlib": "plot",
    "viser": "app",
    "trimesh": "app",
    "casadi": "ipopt",
    "distributed": "cluster",
}
"""Packages that some parts need beside the base install, and the extra that brings each."""


def install(extra: str) -> str:
    """The command that installs an extra."""
    return f"pip install '{NAME}[{extra}]'"


_PACKAGE = Path(__file__).resolve().parent


def shipped(folder: str) -> Path:
    """A folder of the source tree (`layouts`, `checkpoints`, `webapp`), or its copy in an installed
    wheel."""
    in_wheel = _PACKAGE / "shipped" / folder
    return in_wheel if in_wheel.is_dir() else _PACKAGE.parent / folder


PAPER_LAYOUTS = ("A", "B", "C", "D")
"""The shipped layouts that are the paper's."""


def shipped_layouts() -> dict[str, Path]:
    """Shipped layouts: file name without its ending, to path; sorted by name."""
    return {path.stem: path for path in sorted(shipped("layouts").glob("*.yaml"))}


def shipped_checkpoints() -> dict[str, Path]:
    """Shipped checkpoints: name to folder; sorted by name."""
    return {
        path.parent.name: path.parent
        for path in sorted(shipped("checkpoints").glob("*/config.json"))
    }


def checkpoint_path(name: str = "default") -> Path:
    """The folder of a shipped checkpoint; a `CheckpointError` where none of that name is
    shipped."""
    known = shipped_checkpoints()
    if name not in known:
        raise CheckpointError(
            f"checkpoint {name!r} is not among the shipped ones ({', '.join(known) or 'none'}) in "
            f"{shipped('checkpoints')}; name one of them, or pass the folder of your own"
        )
    return known[name]
