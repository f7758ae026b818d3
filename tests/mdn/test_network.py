"""The network of method `mdn`: numpy and torch agree, its mixture is a density, fins come in any order."""

import numpy as np
import pytest
import torch
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal

from finlab.assets import checkpoint_path
from finlab.mdn.network import NODE_SIZE, PAIR_SIZE, ForceMixture, ForceNetworkConfig
from finlab.networks.checkpoint import read_checkpoint

WEIGHTS = read_checkpoint(checkpoint_path())
CONFIG = WEIGHTS.network_of(ForceNetworkConfig)


def inputs(n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(n)
    sizes = (6, n, NODE_SIZE), (6, n, n, PAIR_SIZE)
    nodes, pairs = (rng.normal(size=size).astype(np.float32) for size in sizes)
    return nodes, pairs


@pytest.mark.parametrize("n", [1, 5, 12])
def test_numpy_and_torch_agree(n: int) -> None:
    nodes, pairs = inputs(n)
    tensors = {name: torch.tensor(value) for name, value in WEIGHTS.network.items()}
    expected = CONFIG(tensors, torch.tensor(nodes), torch.tensor(pairs))
    for got, other in zip(CONFIG(WEIGHTS.network, nodes, pairs), expected, strict=True):
        assert got.dtype == np.float32
        np.testing.assert_allclose(got, other.numpy(), atol=1e-3, rtol=1e-3)


def test_fins_may_come_in_any_order() -> None:
    nodes, pairs = inputs(5)
    order = np.array([3, 0, 4, 1, 2])
    straight = CONFIG(WEIGHTS.network, nodes, pairs)
    turned = CONFIG(WEIGHTS.network, nodes[:, order], pairs[:, order][:, :, order])
    np.testing.assert_allclose(turned.logits, straight.logits, atol=1e-3)
    np.testing.assert_allclose(turned.mean, straight.mean[:, order], atol=1e-3)
    np.testing.assert_allclose(turned.log_std, straight.log_std[:, order], atol=1e-3)


def test_huge_inputs_are_no_warning(recwarn: pytest.WarningsRecorder) -> None:
    nodes = np.full((2, 3, NODE_SIZE), 1e4, np.float32)
    pairs = np.full((2, 3, 3, PAIR_SIZE), -1e4, np.float32)
    assert all(np.isfinite(part).all() for part in CONFIG(WEIGHTS.network, nodes, pairs))
    assert not recwarn.list


def test_likelihood_is_that_of_one_mixture_over_all_fins() -> None:
    draw = torch.Generator().manual_seed(0)
    sizes = (5, 4), (5, 3, 4, 2), (5, 3, 4)
    given = ForceMixture(*(torch.randn(size, generator=draw, dtype=torch.float64) for size in sizes))
    way = torch.randn(5, 7, 3, 2, generator=draw, dtype=torch.float64)
    mean = given.mean.transpose(1, 2).flatten(2)
    std = given.log_std.exp()[..., None].expand(-1, -1, -1, 2).transpose(1, 2).flatten(2)
    reference = MixtureSameFamily(Categorical(logits=given.logits), Independent(Normal(mean, std), 1))
    expected = reference.log_prob(way.flatten(2).transpose(0, 1)).T
    torch.testing.assert_close(given.log_prob(way), expected)
    # Warm, all components learn from every way; cold, the one that stands for it.
    assert (given.log_prob(way, 50.0) > given.log_prob(way)).all()
