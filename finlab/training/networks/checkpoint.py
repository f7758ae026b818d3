"""Checkpoints: a folder with `model.safetensors` and `config.json`. No pickle; loaded strictly.

`config.json` holds everything needed to rebuild the networks and to trust them: format and version,
sizes, normalization, fin model, training settings, metrics and the SHA-256 of the weights.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor

from finlab.assets import checkpoint_path, shipped_checkpoints
from finlab.errors import CheckpointError
from finlab.inference.fast_weights import FOLDER as FAST_FOLDER
from finlab.inference.fast_weights import FastWeights, load_fast
from finlab.inference.features import SIZES
from finlab.inference.normalization import Normalization
from finlab.training.networks.allocator_network import AllocatorNetwork, NetworkConfig
from finlab.training.networks.surrogate import Surrogate, SurrogateConfig, make_surrogate

FORMAT = "finlab-checkpoint"
"""Value of the key `format`."""
VERSION = 1
"""Value of the key `version`."""
WEIGHTS_FILE = "model.safetensors"
"""Weights, with the prefixes `surrogate.` and `network.`."""
CONFIG_FILE = "config.json"
"""Everything else."""
MAX_CONFIG_BYTES = 1_000_000
"""Largest `config.json` that is read."""


@dataclass
class Checkpoint:
    """Trained networks and what they were trained for."""

    name: str
    """Name shown to users; the folder's."""
    surrogate: Surrogate
    """Learned fin physics."""
    normalization: Normalization
    """Per-axis statistics of the wrench."""
    fin_model: dict[str, Any]
    """Fin model that the surrogate learned, as in a layout file: {type, parameters}."""
    network: AllocatorNetwork | None = None
    """The allocator network; None where only the surrogate was trained."""
    preset: str = "default"
    """Name of the training recipe."""
    training: dict[str, Any] = field(default_factory=dict)
    """Settings of the runs that made it."""
    metrics: dict[str, Any] = field(default_factory=dict)
    """Measured figures, each with what scored it."""
    sha256: str = ""
    """SHA-256 of the weights file, filled on loading and saving."""
    fast: FastWeights | None = None
    """The distilled network in the folder `fast` beside them, if there is one; filled on loading."""


def save_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint folder."""
    folder.mkdir(parents=True, exist_ok=True)
    tensors = _with_prefix("surrogate", checkpoint.surrogate.state_dict())
    if checkpoint.network is not None:
        tensors |= _with_prefix("network", checkpoint.network.state_dict())
    save_file({k: v.detach().cpu().contiguous() for k, v in tensors.items()}, folder / WEIGHTS_FILE)
    (folder / WEIGHTS_FILE).chmod(0o644)
    checkpoint.sha256 = file_sha256(folder / WEIGHTS_FILE)
    config = {
        "format": FORMAT,
        "version": VERSION,
        "preset": checkpoint.preset,
        "sha256": checkpoint.sha256,
        "fin_model": checkpoint.fin_model,
        "normalization": {k: v.tolist() for k, v in checkpoint.normalization._asdict().items()},
        "surrogate": asdict(checkpoint.surrogate.config),
        "network": None if checkpoint.network is None else asdict(checkpoint.network.config),
        "training": checkpoint.training,
        "metrics": checkpoint.metrics,
    }
    (folder / CONFIG_FILE).write_text(json.dumps(config, indent=2) + "\n")


def load_checkpoint(folder: Path) -> Checkpoint:
    """Read a checkpoint folder.

    Raises:
        CheckpointError: missing, corrupt, of an unknown version, or made by something else.
    """
    config = _read_config(folder)
    weights = folder / WEIGHTS_FILE
    if not weights.is_file():
        raise CheckpointError(
            f"{weights}: no such file; a checkpoint folder holds {CONFIG_FILE} and {WEIGHTS_FILE}"
        )
    if file_sha256(weights) != config.get("sha256"):
        raise CheckpointError(
            f"{weights}: its SHA-256 is not the one in {CONFIG_FILE}; the file was changed or cut off"
        )
    try:
        tensors = load_file(weights)
        surrogate = make_surrogate(_surrogate_config(config["surrogate"]))
        surrogate.load_state_dict(_without_prefix("surrogate", tensors), strict=True)
        network = None
        if config["network"] is not None:
            sizes = NetworkConfig(**config["network"])
            network = AllocatorNetwork(sizes, SIZES[sizes.features])
            network.load_state_dict(_without_prefix("network", tensors), strict=True)
            network.eval().requires_grad_(False)
        surrogate.eval().requires_grad_(False)
        return Checkpoint(
            name=folder.name,
            surrogate=surrogate,
            normalization=_normalization(config),
            fin_model=dict(config["fin_model"]),
            network=network,
            preset=str(config["preset"]),
            training=dict(config["training"]),
            metrics=dict(config["metrics"]),
            sha256=config["sha256"],
            fast=load_fast(folder / FAST_FOLDER),
        )
    except (KeyError, TypeError, ValueError, RuntimeError, SafetensorError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise CheckpointError(
            f"{folder}: {CONFIG_FILE} and {WEIGHTS_FILE} do not fit together ({reason})"
        ) from error


def load_allocator_checkpoint(folder: Path) -> Checkpoint:
    """Like `load_checkpoint`, but the allocator network must be there."""
    checkpoint = load_checkpoint(folder)
    if checkpoint.network is None:
        raise CheckpointError(
            f"{folder}: holds a surrogate only; train the allocator with `finlab train allocator`"
        )
    return checkpoint


def load_normalization(folder: Path) -> Normalization:
    """Only the wrench statistics of a checkpoint, for methods that need no network."""
    try:
        return _normalization(_read_config(folder))
    except (KeyError, TypeError, ValueError) as error:
        raise CheckpointError(f"{folder / CONFIG_FILE}: normalization is missing or malformed") from error


def resolve_checkpoint(checkpoint: str | Path) -> Path:
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


def file_sha256(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _read_config(folder: Path) -> dict[str, Any]:
    path = folder / CONFIG_FILE
    if not path.is_file():
        raise CheckpointError(
            f"{path}: no such file; a checkpoint folder holds {CONFIG_FILE} and {WEIGHTS_FILE}"
        )
    if path.stat().st_size > MAX_CONFIG_BYTES:
        raise CheckpointError(
            f"{path}: larger than {MAX_CONFIG_BYTES} bytes; this is not a checkpoint's configuration"
        )
    try:
        config = json.loads(path.read_text())
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise CheckpointError(f"{path}: not readable as JSON ({error})") from error
    if not isinstance(config, dict) or config.get("format") != FORMAT:
        raise CheckpointError(f"{path}: not a finlab checkpoint (expected format {FORMAT!r})")
    if config.get("version") != VERSION:
        raise CheckpointError(
            f"{path}: checkpoint version {config.get('version')!r}, this finlab reads version {VERSION}; "
            "use the finlab that made it, or train again"
        )
    return config


def _surrogate_config(saved: dict[str, Any]) -> SurrogateConfig:
    return SurrogateConfig(kind=saved["kind"], hidden=tuple(int(width) for width in saved["hidden"]))


def _normalization(config: dict[str, Any]) -> Normalization:
    mean, std = (np.asarray(config["normalization"][key], dtype=np.float64) for key in ("mean", "std"))
    if mean.shape != (6,) or std.shape != (6,) or not (np.isfinite(mean).all() and (std > 0).all()):
        raise ValueError("normalization needs six finite means and six positive standard deviations")
    return Normalization(mean, std)


def _with_prefix(prefix: str, state: dict[str, Tensor]) -> dict[str, Tensor]:
    return {f"{prefix}.{key}": value for key, value in state.items()}


def _without_prefix(prefix: str, tensors: dict[str, Tensor]) -> dict[str, Tensor]:
    return {k.removeprefix(prefix + "."): v for k, v in tensors.items() if k.startswith(prefix + ".")}
