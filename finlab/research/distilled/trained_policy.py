"""The file of a network: weights in `NETWORK.safetensors`, sizes and history in `NETWORK.json`."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

from finlab.errors import CheckpointError, DataError
from finlab.research.distilled.network import ForceConfig, HeadConfig
from finlab.research.networks.trained import ArraysByName, check_arrays, check_state
from finlab.whole_file import make_folder, write_whole

NetworkName = Literal["head", "forces"]
"""Which network: the one that makes a head for a robot, or the one that gives forces for each
wrench."""
CONFIGS: dict[NetworkName, type[HeadConfig] | type[ForceConfig]] = {
    "head": HeadConfig,
    "forces": ForceConfig,
}
MAX_BYTES = 10_000_000
"""Largest size of a file [bytes]."""
FORMAT = "finlab-policy"
VERSION = 1


class TrainedPolicy(NamedTuple):
    """A network with its weights."""

    config: HeadConfig | ForceConfig
    """Its sizes."""
    weights: ArraysByName
    """In single precision."""
    training: Mapping[str, Any]
    """How it was made."""


def write_policy(
    folder: Path,
    network: NetworkName,
    sizes: Mapping[str, int],
    weights: ArraysByName,
    training: Mapping[str, Any],
) -> None:
    """Writes a network into a folder, which is made if need be. Raises DataError: it cannot be
    written."""
    from safetensors.numpy import save

    content = save(dict(weights))
    card = {
        "format": FORMAT,
        "version": VERSION,
        "sizes": dict(sizes),
        "sha256": hashlib.sha256(content).hexdigest(),
        "training": dict(training),
    }
    make_folder(folder)
    write_whole(folder / f"{network}.safetensors", content, DataError)
    write_whole(folder / f"{network}.json", json.dumps(card, indent=2) + "\n", DataError)


def read_policy(folder: Path, network: NetworkName) -> TrainedPolicy:
    """Reads a network. Raises CheckpointError: it is missing, damaged, or of another version."""
    from safetensors import SafetensorError
    from safetensors.numpy import load

    path = folder / f"{network}.safetensors"
    try:
        card = json.loads((folder / f"{network}.json").read_text("utf-8"))
        content = path.read_bytes()
        if len(content) > MAX_BYTES:
            raise ValueError(f"larger than {MAX_BYTES} bytes")
        if (card["format"], card["version"]) != (FORMAT, VERSION):
            raise ValueError(f"expected {FORMAT} {VERSION}")
        if hashlib.sha256(content).hexdigest() != card["sha256"]:
            raise ValueError("its SHA-256 is not that of its card")
        config = CONFIGS[network](**card["sizes"])
        weights = load(content)
        check_arrays(weights)
        check_state(weights, config.shapes())
    except (OSError, ValueError, LookupError, TypeError, SafetensorError) as error:
        raise CheckpointError(
            f"{path}: no network of a policy that can be read ({error}); make one by `finlab train "
            "policy`"
        ) from error
    return TrainedPolicy(config, weights, card["training"])
