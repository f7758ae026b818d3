"""The networks that method `paper` may answer with: the shipped one, and those that were trained here."""

from pathlib import Path

from finlab.errors import FinlabError
from finlab.networks.checkpoint import network_features, resolve_checkpoint
from finlab.paper.network import NetworkConfig

SHIPPED = NetworkConfig.shipped
RUNS = "runs"
"""Folder in the one where the app was started, whose folders are looked at."""


def paper_networks(checkpoint: str | Path | None = None) -> dict[str, Path]:
    """Folders of checkpoints by name, the shipped one first; `checkpoint` is one more, which may be of
    another method."""
    folders = [resolve_checkpoint(SHIPPED), *sorted(path.parent for path in Path(RUNS).glob("*/config.json"))]
    if checkpoint is not None:
        folders.append(resolve_checkpoint(checkpoint))
    return {
        SHIPPED if place == 0 else str(folder): folder
        for place, folder in enumerate(folders)
        if is_papers(folder)
    }


def is_papers(folder: Path) -> bool:
    """Whether a folder holds a network of the paper's kind."""
    try:
        return network_features(folder) == NetworkConfig.features
    except FinlabError:  # a folder of something else is no choice
        return False
