"""A way to swim from a file that a browser sent."""

import tempfile
from pathlib import Path

from finlab.errors import DataError
from finlab.sim import Trajectory
from finlab.sim.task import read_trajectory

MAX_BYTES = 2_000_000
"""Largest file that is taken."""


def read_path(name: str, content: bytes) -> Trajectory:
    """The way in a CSV file with the columns t, x, y, z.

    Raises:
        DataError: it is too large or no such table; the message names the file.
    """
    short = Path(str(name)).name[-60:] or "upload.csv"
    if len(content) > MAX_BYTES:
        raise DataError(f"{short}: is {len(content):,} bytes long, expected at most {MAX_BYTES:,}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "way.csv"
        path.write_bytes(content)
        try:
            return read_trajectory(path)
        except DataError as error:
            raise DataError(str(error).replace(str(path), short)) from None
