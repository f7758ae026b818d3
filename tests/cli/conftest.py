"""A small untrained checkpoint: the command line is the same whatever the network has learned."""

from pathlib import Path

import numpy as np
import pytest
import torch

from finlab.data.features import SIZES
from finlab.data.normalization import Normalization
from finlab.model.allocator_network import AllocatorNetwork
from finlab.model.checkpoint import Checkpoint, save_checkpoint
from finlab.model.surrogate import make_surrogate
from finlab.training.presets import get_preset


@pytest.fixture(scope="session")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Folder of the checkpoint."""
    preset = get_preset("smoke")
    torch.manual_seed(0)
    folder = tmp_path_factory.mktemp("checkpoints") / "untrained"
    std = np.array([1.0, 1.0, 1.0, 0.1, 0.2, 0.3])
    network = AllocatorNetwork(preset.network, SIZES[preset.network.features])
    save_checkpoint(
        folder,
        Checkpoint(
            name=folder.name,
            surrogate=make_surrogate(preset.surrogate),
            normalization=Normalization(np.zeros(6), std),
            fin_model={"type": "drag"},
            network=network,
            preset=preset.name,
        ),
    )
    return str(folder)
