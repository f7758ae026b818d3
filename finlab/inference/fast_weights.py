"""The distilled network's weights on disk, in the folder `fast` of a checkpoint. No torch.

As with checkpoints: safetensors and JSON, loaded strictly.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.errors import CheckpointError

FOLDER = "fast"
"""Its folder inside that of the checkpoint."""
FORMAT, VERSION = "finlab-fast", 1
WEIGHTS_FILE, CONFIG_FILE = "model.safetensors", "config.json"
MAX_BYTES = 20_000_000
"""Largest file that is read."""


class FastWeights(NamedTuple):
    """The distilled network."""

    state: Mapping[str, NDArray[np.float32]]
    """Its state by PyTorch's names."""
    rounds: int
    """Rounds of hearing from all fins."""


def save_fast(folder: Path, weights: FastWeights, about: Mapping[str, Any]) -> None:
    """Write a folder; `about` says of what checkpoint it is, how it was trained and what was measured."""
    from safetensors.numpy import save_file

    folder.mkdir(parents=True, exist_ok=True)
    save_file({k: np.ascontiguousarray(v) for k, v in weights.state.items()}, folder / WEIGHTS_FILE)
    (folder / WEIGHTS_FILE).chmod(0o644)
    digest = hashlib.sha256((folder / WEIGHTS_FILE).read_bytes()).hexdigest()
    config = {"format": FORMAT, "version": VERSION, "sha256": digest, "rounds": weights.rounds, **about}
    (folder / CONFIG_FILE).write_text(json.dumps(config, indent=2) + "\n")


def load_fast(folder: Path) -> FastWeights | None:
    """The distilled network in a folder; None where there is no such folder.

    Raises:
        CheckpointError: corrupt, changed, or of another format.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    path = folder / CONFIG_FILE
    if not path.is_file():
        return None
    try:
        if max(path.stat().st_size, (folder / WEIGHTS_FILE).stat().st_size) > MAX_BYTES:
            raise CheckpointError(f"{folder}: larger than {MAX_BYTES} bytes; this is no distilled network")
        config = json.loads(path.read_text())
        content = (folder / WEIGHTS_FILE).read_bytes()
        if (config["format"], config["version"]) != (FORMAT, VERSION):
            raise CheckpointError(f"{path}: expected format {FORMAT}, version {VERSION}; train it again")
        if hashlib.sha256(content).hexdigest() != config["sha256"]:
            raise CheckpointError(f"{folder}: the SHA-256 of {WEIGHTS_FILE} is not the one in {CONFIG_FILE}")
        return FastWeights(load(content), int(config["rounds"]))
    except (OSError, KeyError, TypeError, ValueError, SafetensorError) as error:
        raise CheckpointError(f"{folder}: not a distilled network ({error})") from None
