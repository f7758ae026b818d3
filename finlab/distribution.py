"""The name under which finlab is installed, and the extras that bring what it does not need everywhere."""

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
