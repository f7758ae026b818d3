"""The allocator network in numpy against the trained one, with a joint mixture and with one per fin."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from finlab.inference.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.inference.features import SIZES
from finlab.inference.network import NumpyNetwork
from finlab.inference.weights import NetworkConfig
from finlab.layout import random_layouts
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.saving import network_of

RANDOM = NetworkConfig(width=32, heads=4, transformer_layers=2, feedforward=40, n_components=6)


def random_network(joint: bool) -> AllocatorNetwork:
    config = replace(RANDOM, joint=joint, features="fin_frame" if joint else "raw")
    with torch.random.fork_rng():
        torch.manual_seed(2)
        network = AllocatorNetwork(config, SIZES[config.features]).eval().requires_grad_(False)
        for parameter in network.parameters():
            torch.nn.init.normal_(parameter, std=0.3)
    return network


@pytest.fixture(scope="module", params=["random joint", "random per fin", "default", "paper"])
def network(request: pytest.FixtureRequest) -> AllocatorNetwork:
    if request.param.startswith("random"):
        return random_network(joint=request.param.endswith("joint"))
    return network_of(read_checkpoint(resolve_checkpoint(request.param)))


def copy_of(network: AllocatorNetwork) -> NumpyNetwork:
    state = {key: value.numpy() for key, value in network.state_dict().items()}
    return NumpyNetwork(state, network.config.heads, network.config.n_components)


@pytest.mark.parametrize("n", [1, 2, 5, 8])
def test_mixture_is_that_of_the_trained_one(n: int, network: AllocatorNetwork) -> None:
    rng = np.random.default_rng(n)
    layouts = random_layouts(rng, 1, n_fins=n, limits="varied")
    x = rng.normal(size=(6, n, SIZES[network.config.features])).astype(np.float32)
    target = rng.normal(size=(6, 6)).astype(np.float32)
    got = copy_of(network)(x, target, layouts.lower[0], layouts.upper[0])
    limits = [torch.from_numpy(v).float().expand(6, -1, -1) for v in (layouts.lower, layouts.upper)]
    expected = network(torch.from_numpy(x), torch.from_numpy(target), *limits)
    assert got.joint == expected.joint == network.config.joint
    np.testing.assert_allclose(got.weight, expected.logits.softmax(-1).numpy(), atol=1e-4)
    np.testing.assert_allclose(got.std, expected.log_std.exp().numpy(), rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(got.mean[..., :2], expected.mean[..., :2].numpy(), atol=1e-4)
    # Directions on either side of the seam are the same direction.
    difference = got.mean[..., 2] - expected.mean[..., 2].numpy()
    wraps = expected.wraps.numpy()[..., None]
    error = np.where(wraps, np.remainder(difference + 1.0, 2.0) - 1.0, difference)
    np.testing.assert_allclose(error, 0.0, atol=1e-4 if network.config.width == RANDOM.width else 1e-3)


def test_attention_is_that_of_the_trained_one(network: AllocatorNetwork) -> None:
    x = np.random.default_rng(0).normal(size=(3, 5, SIZES[network.config.features])).astype(np.float32)
    attention = copy_of(network).attention(x)
    np.testing.assert_allclose(attention, network.attention(torch.from_numpy(x)).numpy(), atol=1e-5)
    np.testing.assert_allclose(attention.sum(-1), 1.0, atol=1e-5)


def test_huge_inputs_are_no_warning(network: AllocatorNetwork, recwarn: pytest.WarningsRecorder) -> None:
    layouts = random_layouts(np.random.default_rng(0), 1, n_fins=3)
    x = np.full((2, 3, SIZES[network.config.features]), 1e4, dtype=np.float32)
    target = np.array([[1e6] * 6, [-1e6] * 6], dtype=np.float32)
    got = copy_of(network)(x, target, layouts.lower[0], layouts.upper[0])
    assert all(np.isfinite(part).all() for part in got)
    assert not recwarn.list
