"""The numpy copies of surrogate and network answer as the trained ones do, and the Jacobian is exact."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import torch

from finlab.inference.features import SIZES
from finlab.inference.learned_fin import LearnedFin
from finlab.inference.network import NumpyNetwork
from finlab.inference.weights import NetworkConfig, SurrogateConfig
from finlab.layout import FinModelSpec, random_layouts
from finlab.physics import make_law
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.networks.checkpoint import Checkpoint
from finlab.training.networks.surrogate import CoefficientSurrogate

DRAG = make_law(FinModelSpec())

MakeFin = Callable[[CoefficientSurrogate], LearnedFin]


def commands(*shape: int) -> np.ndarray:
    rng = np.random.default_rng(0)
    return rng.uniform([0.05, 0.1, -math.pi], [0.8, 3.0, math.pi], (*shape, 3))


def random_surrogate(*hidden: int) -> CoefficientSurrogate:
    torch.manual_seed(1)
    surrogate = CoefficientSurrogate(SurrogateConfig(hidden=hidden)).requires_grad_(False)
    for parameter in surrogate.parameters():
        torch.nn.init.normal_(parameter, std=0.7)
    return surrogate


@pytest.mark.parametrize("hidden", [(8,), (16, 12), (8, 8, 8)])
def test_fin_equals_the_surrogate(hidden: tuple[int, ...], fin_of: MakeFin) -> None:
    surrogate, command = random_surrogate(*hidden), commands(7, 4)
    expected = surrogate.double().fin_force(torch.from_numpy(command)).numpy()
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(fin_of(surrogate).force(command), expected, atol=1e-6)


def test_shipped_fin_equals_the_shipped_surrogate(
    learned_fin: LearnedFin, default_checkpoint: Checkpoint
) -> None:
    command = commands(500)
    surrogate = default_checkpoint.surrogate
    assert isinstance(surrogate, CoefficientSurrogate)
    expected = surrogate.fin_force(torch.from_numpy(command).float()).numpy()
    np.testing.assert_allclose(learned_fin.force(command), expected, atol=1e-5)


def test_shipped_fin_knows_the_physics_to_a_thousandth(learned_fin: LearnedFin) -> None:
    command = commands(20_000)
    truth = DRAG.force(torch.from_numpy(command)).numpy()
    error = learned_fin.force(command) - truth
    assert np.sqrt((error**2).mean() / (truth**2).mean()) < 1e-3


def test_jacobian_agrees_with_differences(fin_of: MakeFin) -> None:
    fin, command = fin_of(random_surrogate(16, 12)), commands(9, 2)
    force, jacobian = fin.force_and_jacobian(command)
    np.testing.assert_allclose(force, fin.force(command), atol=1e-12)
    step = 1e-6
    for i in range(3):
        moved = step * np.eye(3)[i]
        difference = (fin.force(command + moved) - fin.force(command - moved)) / (2 * step)
        np.testing.assert_allclose(jacobian[..., i], difference, atol=1e-6)


def test_single_precision_stays_single_and_near(learned_fin: LearnedFin) -> None:
    command = commands(100)
    rough = learned_fin.force(command.astype(np.float32))
    assert rough.dtype == np.float32
    np.testing.assert_allclose(rough, learned_fin.force(command), atol=1e-4)


def random_network() -> AllocatorNetwork:
    torch.manual_seed(2)
    config = NetworkConfig(
        width=32, heads=4, graph_layers=2, transformer_layers=2, feedforward=40, n_components=6
    )
    network = AllocatorNetwork(config, SIZES["fin_frame"]).eval().requires_grad_(False)
    for parameter in network.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    return network


@pytest.mark.parametrize("shipped", [False, True])
@pytest.mark.parametrize("n", [1, 2, 5, 8])
def test_network_equals_the_trained_one(shipped: bool, n: int, default_checkpoint: Checkpoint) -> None:
    network = default_checkpoint.network if shipped else random_network()
    assert network is not None
    state = {key: value.numpy() for key, value in network.state_dict().items()}
    copy = NumpyNetwork(state, network.config.heads, network.config.n_components)
    rng = np.random.default_rng(n)
    layouts = random_layouts(rng, 1, n_fins=n, limits="varied")
    x = rng.normal(size=(6, n, SIZES["fin_frame"])).astype(np.float32)
    target = rng.normal(size=(6, 6)).astype(np.float32)
    got = copy(x, target, layouts.lower[0], layouts.upper[0])
    limits = [torch.from_numpy(v).float().expand(6, -1, -1) for v in (layouts.lower, layouts.upper)]
    expected = network(torch.from_numpy(x), torch.from_numpy(target), *limits)
    np.testing.assert_allclose(got.weight, expected.logits.softmax(-1).numpy(), atol=1e-4)
    np.testing.assert_allclose(got.std, expected.log_std.exp().numpy(), rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(got.mean[..., :2], expected.mean[..., :2].numpy(), atol=1e-4)
    # Directions on either side of the seam are the same direction.
    turn = np.remainder(got.mean[..., 2] - expected.mean[..., 2].numpy() + 1.0, 2.0) - 1.0
    wraps = expected.wraps.numpy()[..., None]
    error = np.where(wraps, turn, got.mean[..., 2] - expected.mean[..., 2].numpy())
    np.testing.assert_allclose(error, 0.0, atol=1e-3 if shipped else 1e-4)
