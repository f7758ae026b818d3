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
    """Folder of a checkpoint of the paper's kind, preset `smoke`, with random weights, for all that is the
    same whatever the network has learned."""
    # Here, so that tests of layouts do not wait for torch.
    import numpy as np
    import torch

    from finlab.inference.normalization import Normalization
    from finlab.inference.weights import TrainedWeights
    from finlab.training.networks.allocator_network import AllocatorNetwork
    from finlab.training.networks.surrogate import Surrogate
    from finlab.training.presets import PAPER_RECIPES
    from finlab.training.saving import save_checkpoint, state_of

    recipe = PAPER_RECIPES["smoke"]
    folder = tmp_path_factory.mktemp("checkpoints") / "untrained"
    with torch.random.fork_rng():
        torch.manual_seed(0)
        checkpoint = TrainedWeights(
            name=folder.name,
            surrogate_config=recipe.surrogate,
            surrogate=state_of(Surrogate(recipe.surrogate).state_dict()),
            normalization=Normalization(np.zeros(6), np.array([1.0, 1.0, 1.0, 0.1, 0.2, 0.3])),
            fin_model={"type": "drag"},
            network_config=recipe.network,
            network=state_of(AllocatorNetwork(recipe.network).state_dict()),
            preset="smoke",
        )
    save_checkpoint(folder, checkpoint)
    return folder


@pytest.fixture(scope="session")
def untrained_mdn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a checkpoint for method `mdn`, preset `smoke`, with random weights."""
    import torch

    from finlab.inference.checkpoint import read_normalization, resolve_checkpoint
    from finlab.inference.weights import TrainedWeights
    from finlab.training.networks.force_network import ForceNetwork
    from finlab.training.presets import MDN_RECIPES
    from finlab.training.saving import save_checkpoint, state_of

    sizes = MDN_RECIPES["smoke"].network
    folder = tmp_path_factory.mktemp("checkpoints") / "untrained-mdn"
    with torch.random.fork_rng():
        torch.manual_seed(0)
        state = state_of(ForceNetwork(sizes).state_dict())
    normalization = read_normalization(resolve_checkpoint("paper"))
    save_checkpoint(folder, TrainedWeights(folder.name, normalization, sizes, state, preset="smoke"))
    return folder


@pytest.fixture(scope="session")
def layout_a() -> Layout:
    return load_layout(shipped_layouts()["A"])


@pytest.fixture(scope="session")
def analytic() -> Allocator:
    """The quickest method; it takes only the normalization from a checkpoint."""
    from finlab.allocation import load_allocator

    return load_allocator("analytic")
