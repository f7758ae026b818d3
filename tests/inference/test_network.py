"""The paper's network in numpy against the trained one."""

import numpy as np
import pytest
import torch

from finlab.inference.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.inference.features import RAW_SIZE
from finlab.inference.network import NumpyNetwork
from finlab.inference.weights import NetworkConfig
from finlab.training.networks.allocator_network import AllocatorNetwork
from tests.paper_network import network_of

RANDOM = NetworkConfig(width=32, heads=4, transformer_layers=2, feedforward=40, n_components=6)


@pytest.fixture(scope="module", params=["random", "paper"])
def network(request: pytest.FixtureRequest) -> AllocatorNetwork:
    if request.param == "paper":
        return network_of(read_checkpoint(resolve_checkpoint("paper")))
    with torch.random.fork_rng():
        torch.manual_seed(2)
        network = AllocatorNetwork(RANDOM).eval().requires_grad_(False)
        for parameter in network.parameters():
            torch.nn.init.normal_(parameter, std=0.3)
    return network


def copy_of(network: AllocatorNetwork) -> NumpyNetwork:
    state = {key: value.numpy() for key, value in network.state_dict().items()}
    return NumpyNetwork(state, network.config.heads, network.config.n_components)


@pytest.mark.parametrize("n", [1, 2, 5, 8])
def test_mixture_is_that_of_the_trained_one(n: int, network: AllocatorNetwork) -> None:
    rng = np.random.default_rng(n)
    x = rng.normal(size=(6, n, RAW_SIZE)).astype(np.float32)
    target = rng.normal(size=(6, 6)).astype(np.float32)
    got = copy_of(network)(x, target)
    expected = network(torch.from_numpy(x), torch.from_numpy(target))
    np.testing.assert_allclose(got.weight, expected.logits.softmax(-1).numpy(), atol=1e-4)
    np.testing.assert_allclose(got.std, expected.log_std.exp().numpy(), rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(got.mean, expected.mean.numpy(), atol=1e-3)


def test_huge_inputs_are_no_warning(network: AllocatorNetwork, recwarn: pytest.WarningsRecorder) -> None:
    x = np.full((2, 3, RAW_SIZE), 1e4, dtype=np.float32)
    target = np.array([[1e6] * 6, [-1e6] * 6], dtype=np.float32)
    got = copy_of(network)(x, target)
    assert all(np.isfinite(part).all() for part in got)
    assert not recwarn.list
