"""What tests share: settings, an untrained checkpoint, and a robot and a method that are quick to make."""

from pathlib import Path

import pytest
from hypothesis import settings

from finlab.allocation.allocator import Allocator
from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout

# Machines that run tests also run browsers and trainings: an example that takes long is no failure.
settings.register_profile("finlab", deadline=None)
settings.load_profile("finlab")


@pytest.fixture(scope="session")
def untrained_checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a checkpoint of the preset `smoke` with random weights, for all that is the same whatever
    the network has learned."""
    # Here, so that tests of layouts do not wait for torch.
    import numpy as np
    import torch

    from finlab.inference.features import SIZES
    from finlab.inference.normalization import Normalization
    from finlab.inference.weights import TrainedWeights
    from finlab.training.networks.allocator_network import AllocatorNetwork
    from finlab.training.networks.surrogate import make_surrogate
    from finlab.training.presets import get_preset
    from finlab.training.saving import save_checkpoint, state_of

    preset = get_preset("smoke")
    folder = tmp_path_factory.mktemp("checkpoints") / "untrained"
    with torch.random.fork_rng():
        torch.manual_seed(0)
        checkpoint = TrainedWeights(
            name=folder.name,
            surrogate_config=preset.surrogate,
            surrogate=state_of(make_surrogate(preset.surrogate).state_dict()),
            normalization=Normalization(np.zeros(6), np.array([1.0, 1.0, 1.0, 0.1, 0.2, 0.3])),
            fin_model={"type": "drag"},
            network_config=preset.network,
            network=state_of(AllocatorNetwork(preset.network, SIZES[preset.network.features]).state_dict()),
            preset=preset.name,
        )
    save_checkpoint(folder, checkpoint)
    return folder


@pytest.fixture(scope="session")
def layout_a() -> Layout:
    return load_layout(shipped_layouts()["A"])


@pytest.fixture(scope="session")
def analytic() -> Allocator:
    """The quickest method; it takes only the normalization from a checkpoint."""
    from finlab.allocation import load_allocator

    return load_allocator("analytic")
