"""The part of a checkpoint that needs no network: its files, the plain values of `config.json`, and
the statistics of the wrenches that its networks were trained on.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.errors import CheckpointError
from finlab.files import parse_json
from finlab.files.guarded import decoded, read_file

FORMAT = "finlab-checkpoint"
"""Value of the key `format` in `config.json`."""
VERSION = 1
"""Version of checkpoints; a reader knows exactly one."""
WEIGHTS_FILE = "model.safetensors"
"""Weights, with the prefixes `surrogate.` and `network.`."""
CONFIG_FILE = "config.json"
"""Everything else: sizes, normalization, fin model, settings, metrics, checksum."""
MAX_FILE_BYTES = {CONFIG_FILE: 1_000_000, WEIGHTS_FILE: 50_000_000}
"""Largest size of each file [bytes]."""


class WrenchNormalization(NamedTuple):
    """Mean and standard deviation of the wrench over a data set, each of shape (6,) [N, N m]."""

    mean: Array
    """Mean (6,) of each axis [N, N m]."""
    std: Array
    """Standard deviation (6,) of each axis [N, N m]; `sigma` in the error measure."""

    @classmethod
    def parse(cls, values: Any) -> WrenchNormalization:
        """Returns the statistics in plain values of a file.

        Args:
            values: six numbers under each of the keys `mean` and `std`.

        Raises:
            ValueError: there are no such numbers.
        """
        message = "normalization must be six means and six standard deviations above 0"
        try:
            mean = np.asarray(values["mean"], dtype=np.float64)
            std = np.asarray(values["std"], dtype=np.float64)
        except (KeyError, TypeError, ValueError):
            raise ValueError(message) from None
        if mean.shape != (6,) or std.shape != (6,):
            raise ValueError(message)
        if not (np.isfinite(mean).all() and (std > 0.0).all()):
            raise ValueError(message)
        return cls(mean, std)


def read_normalization(folder: Path) -> WrenchNormalization:
    """Returns the wrench statistics of a checkpoint alone, for those that need no network.

    Raises:
        CheckpointError: `config.json` is missing, corrupt, of an unknown version, or has none.
    """
    config = config_of(files_in(folder, (CONFIG_FILE,)), str(folder), (CONFIG_FILE,))
    try:
        return WrenchNormalization.parse(config.get("normalization"))
    except ValueError as error:
        raise CheckpointError(
            f"{folder}/{CONFIG_FILE}: normalization is missing or malformed"
        ) from error


def files_in(folder: Path, names: tuple[str, ...] = tuple(MAX_FILE_BYTES)) -> dict[str, bytes]:
    """Returns the contents of those of a checkpoint's files that are there, by name.

    Args:
        folder: of the checkpoint.
        names: of the files that are read.

    Raises:
        CheckpointError: a file cannot be read, or is too large.
    """
    contents = {}
    for name in names:
        file = folder / name
        if os.path.lexists(file):
            contents[name] = read_file(
                file, MAX_FILE_BYTES[name], "a checkpoint's file", CheckpointError
            )
    return contents


def config_of(files: Mapping[str, bytes], source: str, needed: tuple[str, ...]) -> dict[str, Any]:
    """Returns the plain values of `config.json`, of the format and version that this module reads.

    Args:
        files: contents of the checkpoint's files, by name.
        source: what errors call the checkpoint, such as its path.
        needed: names of files that must be there.

    Raises:
        CheckpointError: format or version are others, or a file is missing.
    """
    config_source = f"{source}/{CONFIG_FILE}"
    for name in needed:
        if name not in files:
            raise CheckpointError(
                f"{source}/{name}: no such file; a checkpoint folder holds {CONFIG_FILE} and "
                f"{WEIGHTS_FILE}"
            )
    text = decoded(files[CONFIG_FILE], config_source, "JSON", CheckpointError)
    config = parse_json(text, config_source, CheckpointError)
    if not isinstance(config, dict) or config.get("format") != FORMAT:
        raise CheckpointError(
            f"{config_source}: not a finlab checkpoint (expected format {FORMAT!r})"
        )
    if type(config.get("version")) is not int or config["version"] != VERSION:
        raise CheckpointError(
            f"{config_source}: checkpoint version {config.get('version')!r}, this finlab reads "
            f"version {VERSION}; use the finlab that made it, or train again"
        )
    return config
