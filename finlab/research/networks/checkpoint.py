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
    State,
    TrainedWeights,
    WrenchNormalization,
    check_arrays,
)
from finlab.whole_file import make_folder, write_whole

FORMAT = "finlab-checkpoint"
VERSION = 1
WEIGHTS_FILE = "model.safetensors"
"""Weights, with the prefixes `surrogate.` and `network.`."""
CONFIG_FILE = "config.json"
LARGEST = {CONFIG_FILE: 1_000_000, WEIGHTS_FILE: 50_000_000}
"""Largest size of each file [bytes]."""


_UNFIT = (ArithmeticError, AttributeError, LayoutError, LookupError, TypeError, ValueError)
"""What reading a configuration ends with that does not fit."""


def read_checkpoint(folder: Path) -> TrainedWeights:
    """The contents of a checkpoint folder; errors as of `parse_checkpoint`."""
    return parse_checkpoint(_files(folder), str(folder), folder.name)


def parse_checkpoint(files: Mapping[str, bytes], source: str, name: str) -> TrainedWeights:
    """The contents of a checkpoint by those of its files; errors call it `source`. Raises
    CheckpointError: missing, corrupt, of an unknown version, or made by something else."""
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
        if known := {key.split(".")[0] for key in tensors} - {"surrogate", "network"}:
            raise ValueError(f"{min(known)!r:.80} is not expected")
        return TrainedWeights(
            name=name,
            normalization=WrenchNormalization.parse(config["normalization"]),
            network_sizes=config["network"] and dict(config["network"]),
            network=_part("network", tensors),
            surrogate_sizes=config["surrogate"] and dict(config["surrogate"]),
            surrogate=_part("surrogate", tensors),
            fin_model=dict(config["fin_model"]),
            preset=str(config["preset"]),
            training=dict(config["training"]),
            metrics=dict(config["metrics"]),
            sha256=sha256,
        )
    except (*_UNFIT, SafetensorError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise CheckpointError(
            f"{source}: {CONFIG_FILE} and {WEIGHTS_FILE} do not fit together ({reason})"
        ) from error


def checkpoint_files(weights: TrainedWeights) -> dict[str, bytes]:
    """The files of a checkpoint, by name; the same weights give the same bytes."""
    from safetensors.numpy import save

    tensors = {f"surrogate.{key}": value for key, value in weights.surrogate.items()}
    tensors |= {f"network.{key}": value for key, value in weights.network.items()}
    content = save({key: np.ascontiguousarray(value) for key, value in tensors.items()})
    config = {
        "format": FORMAT,
        "version": VERSION,
        "preset": weights.preset,
        "sha256": hashlib.sha256(content).hexdigest(),
        "fin_model": dict(weights.fin_model),
        "normalization": {k: v.tolist() for k, v in weights.normalization._asdict().items()},
        "surrogate": weights.surrogate_sizes,
        "network": weights.network_sizes,
        "training": dict(weights.training),
        "metrics": dict(weights.metrics),
    }
    return {CONFIG_FILE: (json.dumps(config, indent=2) + "\n").encode(), WEIGHTS_FILE: content}


def write_checkpoint(folder: Path, weights: TrainedWeights) -> TrainedWeights:
    """Write a checkpoint folder, and return what is in it. Raises DataError: it cannot be
    written."""
    make_folder(folder)
    for name, content in checkpoint_files(weights).items():
        write_whole(folder / name, content, DataError)
    return read_checkpoint(folder)


def read_normalization(folder: Path) -> WrenchNormalization:
    """Only the wrench statistics of a checkpoint, for methods that need no network. Raises
    CheckpointError: as `parse_checkpoint`."""
    config = _config(_files(folder, (CONFIG_FILE,)), str(folder), (CONFIG_FILE,))
    try:
        return WrenchNormalization.parse(config.get("normalization"))
    except ValueError as error:
        raise CheckpointError(
            f"{folder}/{CONFIG_FILE}: normalization is missing or malformed"
        ) from error


def network_features(folder: Path) -> str | None:
    """What the network of a checkpoint is fed, such as "raw" of the paper's; None where it holds
    none. Raises CheckpointError: as `parse_checkpoint`."""
    network = _config(_files(folder, (CONFIG_FILE,)), str(folder), (CONFIG_FILE,)).get("network")
    return str(network.get("features")) if isinstance(network, dict) else None


def resolve_checkpoint(checkpoint: str | os.PathLike[str]) -> Path:
    """The folder of a checkpoint: a shipped one by its bare name, any other by its path.

    A bare name is never looked up in the current folder, so that a folder called `default` there
    does not take the shipped one's place; write `./default` for it. Raises CheckpointError: there
    is neither.
    """
    path = Path(checkpoint)
    if path.name == str(checkpoint) and (
        str(checkpoint) in shipped_checkpoints() or not path.is_dir()
    ):
        return checkpoint_path(str(checkpoint))
    if not path.is_dir():
        raise CheckpointError(f"{path}: no such checkpoint folder")
    return path


def _files(folder: Path, names: tuple[str, ...] = tuple(LARGEST)) -> dict[str, bytes]:
    """Those of a checkpoint's files that are there."""
    there = [name for name in names if os.path.lexists(folder / name)]
    return {
        n: read_file(folder / n, LARGEST[n], "a checkpoint's file", CheckpointError) for n in there
    }


def _config(files: Mapping[str, bytes], source: str, needed: tuple[str, ...]) -> dict[str, Any]:
    place = f"{source}/{CONFIG_FILE}"
    if missing := [name for name in needed if name not in files]:
        both = f"a checkpoint folder holds {CONFIG_FILE} and {WEIGHTS_FILE}"
        raise CheckpointError(f"{source}/{missing[0]}: no such file; {both}")
    text = decoded(files[CONFIG_FILE], place, "JSON", CheckpointError)
    config = parse_json(text, place, CheckpointError)
    if not isinstance(config, dict) or config.get("format") != FORMAT:
        raise CheckpointError(f"{place}: not a finlab checkpoint (expected format {FORMAT!r})")
    if type(config.get("version")) is not int or config["version"] != VERSION:
        raise CheckpointError(
            f"{place}: checkpoint version {config.get('version')!r}, this finlab reads version "
            f"{VERSION}; use the finlab that made it, or train again"
        )
    return config


def _part(prefix: str, tensors: State) -> dict[str, Any]:
    """The arrays of one network, by their names inside it."""
    return {
        k.removeprefix(prefix + "."): v for k, v in tensors.items() if k.startswith(prefix + ".")
    }
