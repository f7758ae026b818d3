"""Reads checkpoints: a folder with `model.safetensors` and `config.json`. No torch, no pickle;
strict.

`config.json` holds everything needed to rebuild the networks and to trust them: format and version,
sizes, normalization, fin model, training settings, metrics and the SHA-256 of the weights.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from finlab.assets import checkpoint_path, shipped_checkpoints
from finlab.errors import CheckpointError, DataError, LayoutError
from finlab.files import parse_json
from finlab.files.guarded import decoded, read_file
from finlab.layout import FinModelSpec
from finlab.research.networks.trained import (
    ArraysByName,
    TrainedWeights,
    WrenchNormalization,
    check_arrays,
)
from finlab.whole_file import make_folder, write_whole

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
PREFIXES = ("surrogate", "network")
"""What the names of weights begin with in the file, before a dot: the network that has them."""

_MALFORMED = (ArithmeticError, AttributeError, LayoutError, LookupError, TypeError, ValueError)
"""Errors with which reading a configuration ends that has missing or wrong values."""


def read_checkpoint(folder: Path) -> TrainedWeights:
    """Returns the contents of a checkpoint folder.

    Raises:
        CheckpointError: as for `parse_checkpoint`.
    """
    return parse_checkpoint(_files(folder), str(folder), folder.name)


def parse_checkpoint(files: Mapping[str, bytes], source: str, name: str) -> TrainedWeights:
    """Returns the contents of a checkpoint.

    Args:
        files: contents of its files, by name.
        source: what errors call it, such as its path.
        name: name of the checkpoint.

    Raises:
        CheckpointError: it is missing, corrupt, of an unknown version, or made by something else.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    config = _config(files, source, (CONFIG_FILE, WEIGHTS_FILE))
    sha256 = hashlib.sha256(files[WEIGHTS_FILE]).hexdigest()
    if sha256 != config.get("sha256"):
        raise CheckpointError(
            f"{source}/{WEIGHTS_FILE}: its SHA-256 is not the one in {CONFIG_FILE}; the file was "
            "changed or cut off"
        )
    try:
        tensors = load(files[WEIGHTS_FILE])
        if config["surrogate"] is not None:
            FinModelSpec.from_values(config["fin_model"])
        check_arrays(tensors)
        unknown = {key.split(".")[0] for key in tensors} - set(PREFIXES)
        if unknown:
            raise ValueError(f"{min(unknown)!r:.80} is not expected")
        return TrainedWeights(
            name=name,
            normalization=WrenchNormalization.parse(config["normalization"]),
            network_sizes=config["network"] and dict(config["network"]),
            network=_weights_of("network", tensors),
            surrogate_sizes=config["surrogate"] and dict(config["surrogate"]),
            surrogate=_weights_of("surrogate", tensors),
            fin_model=dict(config["fin_model"]),
            preset=str(config["preset"]),
            training=dict(config["training"]),
            metrics=dict(config["metrics"]),
            sha256=sha256,
        )
    except (*_MALFORMED, SafetensorError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise CheckpointError(
            f"{source}: {CONFIG_FILE} and {WEIGHTS_FILE} do not fit together ({reason})"
        ) from error


def checkpoint_files(weights: TrainedWeights) -> dict[str, bytes]:
    """Returns the contents of a checkpoint's files, by name; the same weights give the same
    bytes."""
    from safetensors.numpy import save

    tensors = {f"surrogate.{key}": value for key, value in weights.surrogate.items()}
    tensors |= {f"network.{key}": value for key, value in weights.network.items()}
    content = save({key: np.ascontiguousarray(value) for key, value in tensors.items()})
    normalization = weights.normalization._asdict()
    config = {
        "format": FORMAT,
        "version": VERSION,
        "preset": weights.preset,
        "sha256": hashlib.sha256(content).hexdigest(),
        "fin_model": dict(weights.fin_model),
        "normalization": {name: values.tolist() for name, values in normalization.items()},
        "surrogate": weights.surrogate_sizes,
        "network": weights.network_sizes,
        "training": dict(weights.training),
        "metrics": dict(weights.metrics),
    }
    return {CONFIG_FILE: (json.dumps(config, indent=2) + "\n").encode(), WEIGHTS_FILE: content}


def write_checkpoint(folder: Path, weights: TrainedWeights) -> TrainedWeights:
    """Writes a checkpoint folder, and returns what a reader finds in it.

    Args:
        folder: the folder, which is made if need be.
        weights: the contents.

    Raises:
        DataError: it cannot be written.
    """
    make_folder(folder)
    for name, content in checkpoint_files(weights).items():
        write_whole(folder / name, content, DataError)
    return read_checkpoint(folder)


def read_normalization(folder: Path) -> WrenchNormalization:
    """Returns the wrench statistics of a checkpoint alone, for those that need no network.

    Raises:
        CheckpointError: as for `parse_checkpoint`.
    """
    config = _config(_files(folder, (CONFIG_FILE,)), str(folder), (CONFIG_FILE,))
    try:
        return WrenchNormalization.parse(config.get("normalization"))
    except ValueError as error:
        raise CheckpointError(
            f"{folder}/{CONFIG_FILE}: normalization is missing or malformed"
        ) from error


def network_features(folder: Path) -> str | None:
    """Returns what the network of a checkpoint is fed, such as "raw" of the paper's; None where it
    holds none.

    Raises:
        CheckpointError: as for `parse_checkpoint`.
    """
    network = _config(_files(folder, (CONFIG_FILE,)), str(folder), (CONFIG_FILE,)).get("network")
    return str(network.get("features")) if isinstance(network, dict) else None


def resolve_checkpoint(checkpoint: str | os.PathLike[str]) -> Path:
    """Returns the folder of a checkpoint: a shipped one by its bare name, any other by its path.

    The name of a shipped checkpoint is never looked up in the current folder, so that a folder
    called `default` there does not replace it; write `./default` for that folder.

    Raises:
        CheckpointError: there is neither.
    """
    path = Path(checkpoint)
    name = str(checkpoint)
    is_bare_name = path.name == name
    if is_bare_name and (name in shipped_checkpoints() or not path.is_dir()):
        return checkpoint_path(name)
    if not path.is_dir():
        raise CheckpointError(f"{path}: no such checkpoint folder")
    return path


def _files(folder: Path, names: tuple[str, ...] = tuple(MAX_FILE_BYTES)) -> dict[str, bytes]:
    """Contents of those of a checkpoint's files that are there, by name."""
    contents = {}
    for name in names:
        file = folder / name
        if os.path.lexists(file):
            contents[name] = read_file(
                file, MAX_FILE_BYTES[name], "a checkpoint's file", CheckpointError
            )
    return contents


def _config(files: Mapping[str, bytes], source: str, needed: tuple[str, ...]) -> dict[str, Any]:
    """Plain values of `config.json`, with the format and version that this module reads. Raises
    CheckpointError: they are others, or one of the files `needed` is missing."""
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


def _weights_of(prefix: str, tensors: ArraysByName) -> dict[str, Any]:
    """The weights of one network, by their names inside it, from those of all networks."""
    weights = {}
    for name, array in tensors.items():
        if name.startswith(f"{prefix}."):
            weights[name.removeprefix(f"{prefix}.")] = array
    return weights
