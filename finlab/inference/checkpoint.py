"""Reads checkpoints: a folder with `model.safetensors` and `config.json`. No torch, no pickle; strict.

`config.json` holds everything needed to rebuild the networks and to trust them: format and version,
sizes, normalization, fin model, training settings, metrics and the SHA-256 of the weights. A folder `fast`
inside may hold the distilled network. The weights of a deployment bundle are the same files.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from finlab.assets import checkpoint_path, shipped_checkpoints
from finlab.errors import CheckpointError
from finlab.inference.fast_network import check_state, fast_files, parse_fast
from finlab.inference.normalization import Normalization
from finlab.inference.weights import NetworkConfig, State, SurrogateConfig, TrainedWeights
from finlab.layout import FinModelSpec

FORMAT = "finlab-checkpoint"
"""Value of the key `format`."""
VERSION = 1
"""Value of the key `version`."""
WEIGHTS_FILE = "model.safetensors"
"""Weights, with the prefixes `surrogate.` and `network.`."""
CONFIG_FILE = "config.json"
"""Everything else."""
FAST_FOLDER = "fast"
"""Folder of the distilled network."""
FAST_CONFIG, FAST_FILE = f"{FAST_FOLDER}/{CONFIG_FILE}", f"{FAST_FOLDER}/{WEIGHTS_FILE}"
LARGEST = {
    CONFIG_FILE: 1_000_000,
    WEIGHTS_FILE: 50_000_000,
    FAST_CONFIG: 1_000_000,
    FAST_FILE: 20_000_000,
}
"""Largest size of each file [bytes]."""


def read_checkpoint(folder: Path) -> TrainedWeights:
    """The contents of a checkpoint folder.

    Raises:
        CheckpointError: missing, corrupt, of an unknown version, or made by something else.
    """
    return parse_checkpoint(_files(folder), str(folder), folder.name)


def parse_checkpoint(files: Mapping[str, bytes], source: str, name: str) -> TrainedWeights:
    """The contents of a checkpoint's files by name; errors as in `read_checkpoint`."""
    from safetensors import SafetensorError
    from safetensors.numpy import load

    config = _config(files, source)
    if WEIGHTS_FILE not in files:
        raise _missing(source, WEIGHTS_FILE)
    sha256 = hashlib.sha256(files[WEIGHTS_FILE]).hexdigest()
    if sha256 != config.get("sha256"):
        raise CheckpointError(
            f"{source}/{WEIGHTS_FILE}: its SHA-256 is not the one in {CONFIG_FILE}; the file was changed or "
            "cut off"
        )
    fast = None
    if FAST_CONFIG in files and FAST_FILE in files:
        fast = parse_fast(files[FAST_CONFIG], files[FAST_FILE], f"{source}/{FAST_FOLDER}")
    try:
        tensors = load(files[WEIGHTS_FILE])
        FinModelSpec.from_values(config["fin_model"])
        kind, hidden = config["surrogate"]["kind"], config["surrogate"]["hidden"]
        surrogate_config = SurrogateConfig(kind, tuple(hidden))
        sizes = None if config["network"] is None else NetworkConfig(**config["network"])
        shapes = {f"surrogate.{key}": shape for key, shape in surrogate_config.shapes().items()}
        if sizes is not None:
            shapes |= {f"network.{key}": shape for key, shape in sizes.shapes().items()}
        check_state(tensors, shapes)
        return TrainedWeights(
            name=name,
            normalization=_normalization(config),
            fin_model=dict(config["fin_model"]),
            surrogate_config=surrogate_config,
            surrogate=_part("surrogate", tensors),
            network_config=sizes,
            network=_part("network", tensors),
            fast=fast,
            preset=str(config["preset"]),
            training=dict(config["training"]),
            metrics=dict(config["metrics"]),
            sha256=sha256,
        )
    except (AttributeError, KeyError, TypeError, ValueError, SafetensorError) as error:
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
        "surrogate": asdict(weights.surrogate_config),
        "network": None if weights.network_config is None else asdict(weights.network_config),
        "training": dict(weights.training),
        "metrics": dict(weights.metrics),
    }
    files = {CONFIG_FILE: (json.dumps(config, indent=2) + "\n").encode(), WEIGHTS_FILE: content}
    if weights.fast is not None:
        fast = fast_files(weights.fast, {"checkpoint": weights.name})
        files |= {f"{FAST_FOLDER}/{name}": part for name, part in fast.items()}
    return files


def read_normalization(folder: Path) -> Normalization:
    """Only the wrench statistics of a checkpoint, for methods that need no network."""
    return parse_normalization(_files(folder, (CONFIG_FILE,)), str(folder))


def parse_normalization(files: Mapping[str, bytes], source: str) -> Normalization:
    """The wrench statistics in a checkpoint's files by name."""
    try:
        return _normalization(_config(files, source))
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError(f"{source}/{CONFIG_FILE}: normalization is missing or malformed") from error


def resolve_checkpoint(checkpoint: str | os.PathLike[str]) -> Path:
    """The folder of a checkpoint: a shipped one by its bare name, any other by its path.

    A bare name is never looked up in the current folder, so that a folder called `default` there does
    not take the shipped one's place; write `./default` for it.
    """
    path = Path(checkpoint)
    if path.name == str(checkpoint) and (str(checkpoint) in shipped_checkpoints() or not path.is_dir()):
        return checkpoint_path(str(checkpoint))
    if not path.is_dir():
        raise CheckpointError(f"{path}: no such checkpoint folder")
    return path


def _files(folder: Path, names: tuple[str, ...] = tuple(LARGEST)) -> dict[str, bytes]:
    """Those of a checkpoint's files that are there."""
    files = {}
    for name in names:
        path = folder / name
        if not path.is_file():
            continue
        if path.stat().st_size > LARGEST[name]:
            what = "configuration" if name.endswith(CONFIG_FILE) else "weights"
            raise CheckpointError(
                f"{path}: larger than {LARGEST[name]} bytes; this is not a checkpoint's {what}"
            )
        files[name] = path.read_bytes()
    return files


def _config(files: Mapping[str, bytes], source: str) -> dict[str, Any]:
    place = f"{source}/{CONFIG_FILE}"
    if CONFIG_FILE not in files:
        raise _missing(source, CONFIG_FILE)
    try:
        config = json.loads(files[CONFIG_FILE])
    except (ValueError, RecursionError) as error:
        raise CheckpointError(f"{place}: not readable as JSON ({error})") from error
    if not isinstance(config, dict) or config.get("format") != FORMAT:
        raise CheckpointError(f"{place}: not a finlab checkpoint (expected format {FORMAT!r})")
    if config.get("version") != VERSION:
        raise CheckpointError(
            f"{place}: checkpoint version {config.get('version')!r}, this finlab reads version {VERSION}; "
            "use the finlab that made it, or train again"
        )
    return config


def _normalization(config: Mapping[str, Any]) -> Normalization:
    mean, std = (np.asarray(config["normalization"][key], dtype=np.float64) for key in ("mean", "std"))
    if mean.shape != (6,) or std.shape != (6,) or not (np.isfinite(mean).all() and (std > 0).all()):
        raise ValueError("normalization needs six finite means and six positive standard deviations")
    return Normalization(mean, std)


def _part(prefix: str, tensors: State) -> dict[str, Any]:
    """The arrays of one network, by their names inside it."""
    return {k.removeprefix(prefix + "."): v for k, v in tensors.items() if k.startswith(prefix + ".")}


def _missing(source: str, name: str) -> CheckpointError:
    return CheckpointError(
        f"{source}/{name}: no such file; a checkpoint folder holds {CONFIG_FILE} and {WEIGHTS_FILE}"
    )
