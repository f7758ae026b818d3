"""What tests share: settings, an untrained checkpoint, and a robot and a method that are quick to
make."""

import gc
from pathlib import Path

import pytest
from hypothesis import settings

from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout
from tests.allocator_cache import AllocatorCache

# Machines that run tests also run browsers and trainings: an example that takes long is no failure.
settings.register_profile("finlab", deadline=None)
settings.load_profile("finlab")


def pytest_collection_finish() -> None:
    """Keep what was collected out of the garbage collector's way: it would walk through thousands of
    tests and the modules of torch again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def untrained_checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a checkpoint of the paper's kind, preset `smoke`, with random weights, for all that
    is the same whatever the network has learned."""
    # Here, so that tests of layouts do not wait for torch.
    import numpy as np

    from finlab.files.checkpoint_config import WrenchNormalization
    from finlab.research.networks.checkpoint import write_checkpoint
    from finlab.research.networks.trained import TrainedWeights, sizes_for_file
    from finlab.research.paper.network import NetworkConfig
    from finlab.research.paper.surrogate import SurrogateConfig
    from finlab.research.training.loop import first_weights
    from tests.torch_weights import arrays_of

    surrogate = SurrogateConfig(hidden=(16, 16))
    network = NetworkConfig(
        width=32, heads=2, graph_layers=1, transformer_layers=1, feedforward=32, n_components=4
    )
    folder = tmp_path_factory.mktemp("checkpoints") / "untrained"
    checkpoint = TrainedWeights(
        name=folder.name,
        surrogate_sizes={"kind": "mlp", "hidden": [16, 16]},
        surrogate=arrays_of(first_weights(surrogate.shapes(), 0)),
        normalization=WrenchNormalization(np.zeros(6), np.array([1.0, 1.0, 1.0, 0.1, 0.2, 0.3])),
        fin_model={"type": "drag"},
        network_sizes=sizes_for_file(network),
        network=arrays_of(first_weights(network.shapes(), 0)),
        preset="smoke",
    )
    write_checkpoint(folder, checkpoint)
    return folder


@pytest.fixture(scope="session")
def untrained_mdn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a checkpoint for method `mdn`, preset `smoke`, with random weights."""
    from finlab.files.checkpoint_config import read_normalization
    from finlab.research.mdn.training.train_mdn import RECIPES
    from finlab.research.networks.checkpoint import resolve_checkpoint, write_checkpoint
    from finlab.research.networks.trained import TrainedWeights, sizes_for_file
    from finlab.research.training.loop import first_weights
    from tests.torch_weights import arrays_of

    network = RECIPES["smoke"].network
    folder = tmp_path_factory.mktemp("checkpoints") / "untrained-mdn"
    state = arrays_of(first_weights(network.shapes(), 0))
    normalization = read_normalization(resolve_checkpoint("paper"))
    sizes = sizes_for_file(network)
    write_checkpoint(
        folder, TrainedWeights(folder.name, normalization, sizes, state, preset="smoke")
    )
    return folder


@pytest.fixture(scope="session")
def layout_a() -> Layout:
    """Robot A of the paper, four fins."""
    return load_layout(shipped_layouts()["A"])


@pytest.fixture(scope="session")
def analytic() -> AllocatorCache:
    """The quickest method; it takes only the normalization from a checkpoint."""

    return AllocatorCache("analytic")
