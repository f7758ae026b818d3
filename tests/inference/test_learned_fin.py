"""The learned fin in numpy against the trained surrogate, and its Jacobian against differences."""

import math

import numpy as np
import pytest
import torch

from finlab.inference.checkpoint import read_checkpoint, resolve_checkpoint
from finlab.inference.learned_fin import LearnedFin
from finlab.inference.weights import SurrogateConfig, TrainedWeights
from finlab.layout import FinModelSpec
from finlab.physics import make_law
from finlab.training.networks.surrogate import CoefficientSurrogate
from finlab.training.saving import surrogate_of


@pytest.fixture(scope="module")
def shipped() -> TrainedWeights:
    """The shipped checkpoint `default`."""
    return read_checkpoint(resolve_checkpoint("default"))


def fin_of(surrogate: CoefficientSurrogate) -> LearnedFin:
    """A surrogate in numpy."""
    return LearnedFin({key: value.numpy() for key, value in surrogate.state_dict().items()})


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
def test_fin_equals_the_surrogate(hidden: tuple[int, ...]) -> None:
    surrogate, command = random_surrogate(*hidden), commands(7, 4)
    expected = surrogate.double().fin_force(torch.from_numpy(command)).numpy()
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(fin_of(surrogate).force(command), expected, atol=1e-6)


def test_shipped_fin_equals_the_shipped_surrogate(
    shipped: TrainedWeights,
) -> None:
    command = commands(500)
    surrogate = surrogate_of(shipped)
    assert isinstance(surrogate, CoefficientSurrogate)
    expected = surrogate.fin_force(torch.from_numpy(command).float()).numpy()
    np.testing.assert_allclose(LearnedFin(shipped.surrogate).force(command), expected, atol=1e-5)


def test_shipped_fin_knows_the_physics_to_a_thousandth(shipped: TrainedWeights) -> None:
    command = commands(20_000)
    truth = make_law(FinModelSpec()).force(torch.from_numpy(command)).numpy()
    error = LearnedFin(shipped.surrogate).force(command) - truth
    assert np.sqrt((error**2).mean() / (truth**2).mean()) < 1e-3


def test_jacobian_agrees_with_differences() -> None:
    fin, command = fin_of(random_surrogate(16, 12)), commands(9, 2)
    force, slopes = fin.force_and_slopes(command)
    np.testing.assert_allclose(force, fin.force(command), atol=1e-12)
    step = 1e-6
    for i in range(3):
        moved = step * np.eye(3)[i]
        difference = (fin.force(command + moved) - fin.force(command - moved)) / (2 * step)
        np.testing.assert_allclose(slopes[..., i, :], difference, atol=1e-6)


def test_single_precision_stays_single_and_near(shipped: TrainedWeights) -> None:
    command = commands(100)
    rough = LearnedFin(shipped.surrogate).force(command.astype(np.float32))
    assert rough.dtype == np.float32
    np.testing.assert_allclose(rough, LearnedFin(shipped.surrogate).force(command), atol=1e-4)
