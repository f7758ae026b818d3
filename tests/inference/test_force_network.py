"""The network of method `mdn` in numpy against the trained one, random and shipped."""

import numpy as np
import pytest
import torch

from finlab.assets import checkpoint_path
from finlab.inference.checkpoint import read_checkpoint
from finlab.inference.force_network import NODE_SIZE, PAIR_SIZE, NumpyForceNetwork
from finlab.inference.weights import ForceNetworkConfig
from finlab.training.networks.force_network import ForceLayer, ForceNetwork

RANDOM = ForceNetworkConfig(width=32, heads=4, layers=2, feedforward=40, n_components=6)


@pytest.fixture(scope="module", params=["random", "default"])
def network(request: pytest.FixtureRequest) -> ForceNetwork:
    if request.param == "default":
        weights = read_checkpoint(checkpoint_path())
        network = ForceNetwork(weights.check_network(ForceNetworkConfig)).eval().requires_grad_(False)
        network.load_state_dict({key: torch.tensor(value) for key, value in weights.network.items()})
        return network
    with torch.random.fork_rng():
        torch.manual_seed(2)
        network = ForceNetwork(RANDOM).eval().requires_grad_(False)
        # Fresh biases and normalizations are zeros and ones, which would hide one that is misplaced.
        for parameter in network.parameters():
            torch.nn.init.normal_(parameter, std=0.3)
    return network


def copy_of(network: ForceNetwork) -> NumpyForceNetwork:
    state = {key: value.numpy() for key, value in network.state_dict().items()}
    return NumpyForceNetwork(state, network.config.heads)


def inputs(n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(n)
    sizes = (6, n, NODE_SIZE), (6, n, n, PAIR_SIZE)
    nodes, pairs = (rng.normal(size=size).astype(np.float32) for size in sizes)
    return nodes, pairs


@pytest.mark.parametrize("n", [1, 2, 5, 12])
def test_mixture_is_that_of_the_trained_one(n: int, network: ForceNetwork) -> None:
    nodes, pairs = inputs(n)
    got, expected = copy_of(network)(nodes, pairs), network(torch.tensor(nodes), torch.tensor(pairs))
    np.testing.assert_allclose(got.weight, expected.logits.softmax(-1).numpy(), atol=1e-4)
    np.testing.assert_allclose(got.std, expected.log_std.exp().numpy().swapaxes(1, 2), rtol=1e-3)
    mean = torch.view_as_complex(expected.mean.contiguous()).numpy().swapaxes(1, 2)
    np.testing.assert_allclose(got.mean, mean, atol=2e-4)


def test_attention_is_that_of_the_trained_one(network: ForceNetwork) -> None:
    nodes, pairs = inputs(5)
    attention = copy_of(network).attention(nodes, pairs)
    first = network.layers[0]
    assert isinstance(first, ForceLayer)
    seen = first.norm1(network.enter(torch.tensor(nodes)))
    expected = first.look(seen, torch.tensor(pairs))[1].mean(-1).numpy()
    np.testing.assert_allclose(attention, expected, atol=1e-5)
    np.testing.assert_allclose(attention.sum(-1), 1.0, atol=1e-5)


def test_fins_may_come_in_any_order(network: ForceNetwork) -> None:
    nodes, pairs = inputs(5)
    order = np.array([3, 0, 4, 1, 2])
    straight, turned = (
        copy_of(network)(nodes, pairs),
        copy_of(network)(
            np.ascontiguousarray(nodes[:, order]), np.ascontiguousarray(pairs[:, order][:, :, order])
        ),
    )
    np.testing.assert_allclose(turned.weight, straight.weight, atol=1e-5)
    np.testing.assert_allclose(turned.mean, straight.mean[:, :, order], atol=1e-4)
    np.testing.assert_allclose(turned.std, straight.std[:, :, order], rtol=1e-3)


def test_huge_inputs_are_no_warning(network: ForceNetwork, recwarn: pytest.WarningsRecorder) -> None:
    nodes, pairs = (
        np.full((2, 3, NODE_SIZE), 1e4, np.float32),
        np.full((2, 3, 3, PAIR_SIZE), -1e4, np.float32),
    )
    assert all(np.isfinite(part).all() for part in copy_of(network)(nodes, pairs))
    assert not recwarn.list
