"""Mesh files that browsers sent, kept in the user's cache so that a saved layout can name them."""

import hashlib
import os
from pathlib import Path

from finlab.errors import FinlabError
from finlab.layout.body import Hull
from webapp.scene.meshes.mesh_hull import UNITS, read_mesh


def cache_folder() -> Path:
    """Where the app keeps files of its own: `$XDG_CACHE_HOME/finlab`, or `~/.cache/finlab`."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "finlab"


def stored_hull(name: str, content: bytes, unit: str) -> Hull:
    """The hull in an uploaded mesh file, which is checked and kept under a name made from its content.

    Raises:
        FinlabError: it is no mesh, too large, or cannot be kept.
    """
    if unit not in UNITS:
        raise FinlabError(f"unit: expected one of {', '.join(UNITS)}, got {unit!r:.40}")
    short = Path(str(name)).name[-80:] or "upload"
    read_mesh(short, content, UNITS[unit])
    path = (
        cache_folder() / "hulls" / f"{hashlib.sha256(content).hexdigest()[:16]}{Path(short).suffix.lower()}"
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            path.write_bytes(content)
    except OSError as error:
        raise FinlabError(f"{short}: cannot be kept in {path.parent}: {error.strerror}") from None
    return Hull(mesh=str(path), scale=UNITS[unit])
