"""The distilled network's weights as files, in the folder `fast` of a checkpoint. No torch.

As with checkpoints: safetensors and JSON, loaded strictly.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.errors import CheckpointError
from finlab.inference.activations import sigmoid
from finlab.inference.features import FIN_FRAME_SIZE

FORMAT, VERSION = "finlab-fast", 1
WEIGHTS_FILE, CONFIG_FILE = "model.safetensors", "config.json"
MAX_ROUNDS = 100
"""Most rounds that a distilled network may have."""
LARGEST_WEIGHT = 1e6
"""Largest magnitude of a weight; training stays below 100, and far beyond this answers would be NaN."""


class FastWeights(NamedTuple):
    """The distilled network."""

    state: Mapping[str, NDArray[np.float32]]
    """Its state by PyTorch's names."""
    rounds: int
    """Rounds in which every fin receives the mean of all."""


def fast_files(weights: FastWeights, about: Mapping[str, Any]) -> dict[str, bytes]:
    """The two files by name; `about` says of what checkpoint it is and how it was made."""
    from safetensors.numpy import save

    content = save({k: np.ascontiguousarray(v) for k, v in weights.state.items()})
    digest = hashlib.sha256(content).hexdigest()
    config = {"format": FORMAT, "version": VERSION, "sha256": digest, "rounds": weights.rounds, **about}
    return {CONFIG_FILE: (json.dumps(config, indent=2) + "\n").encode(), WEIGHTS_FILE: content}


def save_fast(folder: Path, weights: FastWeights, about: Mapping[str, Any]) -> None:
    """Write a folder; arguments as in `fast_files`."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in fast_files(weights, about).items():
        (folder / name).write_bytes(content)


def parse_fast(config_file: bytes, weights_file: bytes, source: str) -> FastWeights:
    """The distilled network in the contents of its two files.

    Raises:
        CheckpointError: corrupt, changed, or of another format.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    try:
        config = json.loads(config_file)
        if (config["format"], config["version"]) != (FORMAT, VERSION):
            raise CheckpointError(f"{source}: expected format {FORMAT}, version {VERSION}; train it again")
        if hashlib.sha256(weights_file).hexdigest() != config["sha256"]:
            raise CheckpointError(f"{source}: the SHA-256 of {WEIGHTS_FILE} is not the one in {CONFIG_FILE}")
        state, rounds = load(weights_file), config["rounds"]
        if isinstance(rounds, bool) or not isinstance(rounds, int) or not 0 <= rounds <= MAX_ROUNDS:
            raise ValueError(f"expected 0 to {MAX_ROUNDS} rounds, got {rounds!r:.40}")
        check_state(state, _shapes(len(state["first.bias"]), rounds))
        return FastWeights(state, rounds)
    except (KeyError, TypeError, ValueError, RecursionError, SafetensorError) as error:
        raise CheckpointError(f"{source}: not a distilled network ({error})") from None


def check_state(state: Mapping[str, NDArray[Any]], shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Raise a `ValueError` unless a network has exactly these arrays, in float32 and of sane size."""
    if wrong := sorted(set(shapes) ^ set(state)):
        raise ValueError(f"{wrong[0]!r:.80} is missing or not expected")
    for name, shape in shapes.items():
        array = state[name]
        if array.shape != shape or array.dtype != np.float32:
            raise ValueError(f"{name}: expected float32 of shape {shape}, got {array.dtype} {array.shape}")
        if not (np.abs(array) <= LARGEST_WEIGHT).all():  # false for NaN as well
            raise ValueError(f"{name}: holds NaN or a number beyond {LARGEST_WEIGHT:g}")


def _shapes(width: int, rounds: int) -> dict[str, tuple[int, ...]]:
    shapes = {"first.weight": (width, FIN_FRAME_SIZE), "first.bias": (width,)}
    for i in range(rounds):
        shapes |= {f"own.{i}.weight": (width, width), f"own.{i}.bias": (width,)}
        shapes |= {f"all.{i}.weight": (width, width)}
    return shapes | {"last.weight": (1, width), "last.bias": (1,)}


Array = NDArray[Any]


class NumpyFastNetwork:
    """Node features in, shares of thrust out."""

    def __init__(self, weights: FastWeights) -> None:
        """Take over a trained network."""
        state = {key: np.ascontiguousarray(value, dtype=np.float32) for key, value in weights.state.items()}

        def matrix(name: str) -> Array:
            return state[f"{name}.weight"].T.copy()

        self._first = (matrix("first"), state["first.bias"])
        self._rounds = [
            (matrix(f"own.{i}"), state[f"own.{i}.bias"], matrix(f"all.{i}")) for i in range(weights.rounds)
        ]
        self._last = (matrix("last")[:, 0].copy(), state["last.bias"])

    def __call__(self, x: Array) -> Array:
        """Fourth root (N, n) of thrust over largest thrust, for features (N, n, F) in single precision."""
        rows, n, _ = x.shape
        hidden = x.reshape(rows * n, -1) @ self._first[0]
        hidden += self._first[1]
        np.maximum(hidden, 0, out=hidden)
        each = np.full((1, n), 1.0 / n, dtype=np.float32)
        for own, bias, everyone in self._rounds:
            mean = (each @ hidden.reshape(rows, n, -1)) @ everyone
            mean += bias
            message = (hidden @ own).reshape(rows, n, -1)
            message += mean
            np.maximum(message, 0, out=message)
            hidden = hidden + message.reshape(rows * n, -1)
        return sigmoid((hidden @ self._last[0] + self._last[1]).reshape(rows, n))
