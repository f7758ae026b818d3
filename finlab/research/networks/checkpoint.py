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
from finlab.files.checkpoint_config import (
    CONFIG_FILE,
    FORMAT,
    VERSION,
    WEIGHTS_FILE,
    WrenchNormalization,
    config_of,
    files_in,
)
from finlab.layout import FinModelSpec
from finlab.research.networks.trained import ArraysByName, TrainedWeights, check_arrays
from finlab.whole_file import make_folder, write_whole

PREFIXES = ("surrogate", "network")
"""What the names of weights begin with in the file, before a dot: the network that has them."""

_MALFORMED = (ArithmeticError, AttributeError, LayoutError, LookupError, TypeError, ValueError)
"""Errors with which reading a configuration ends that has missing or wrong values."""


def read_checkpoint(folder: Path) -> TrainedWeights:
    """Returns the contents of a checkpoint folder.

    Raises:
        CheckpointError: as for `parse_checkpoint`.
    """
    return parse_checkpoint(files_in(folder), str(folder), folder.name)


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

    config = config_of(files, source, (CONFIG_FILE, WEIGHTS_FILE))
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


def network_features(folder: Path) -> str | None:
    """Returns what the network of a checkpoint is fed, such as "raw" of the paper's; None where it
    holds none.

    Raises:
        CheckpointError: as for `parse_checkpoint`.
    """
    network = config_of(files_in(folder, (CONFIG_FILE,)), str(folder), (CONFIG_FILE,)).get(
        "network"
    )
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


def _weights_of(prefix: str, tensors: ArraysByName) -> dict[str, Any]:
    """The weights of one network, by their names inside it, from those of all networks."""
    weights = {}
    for name, array in tensors.items():
        if name.startswith(f"{prefix}."):
            weights[name.removeprefix(f"{prefix}.")] = array
    return weights
