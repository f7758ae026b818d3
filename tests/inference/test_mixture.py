"""The numpy mixture against the one that is trained: means, draws, likelihoods."""

import numpy as np
import pytest
import torch

from finlab.inference.mixture import MixtureArrays
from finlab.training.networks.allocator_network import Mixture

N, K, FINS, M = 4, 9, 3, 5


def make_pair() -> tuple[MixtureArrays, Mixture]:
    """One random mixture, as arrays and as tensors."""
    draw = torch.Generator().manual_seed(11)
    trained = Mixture(
        2 * torch.randn((N, FINS, M), generator=draw),
        torch.rand(N, FINS, M, 3, generator=draw) * 1.8 - 0.9,
        0.3 * torch.randn(N, FINS, M, 3, generator=draw) - 1.0,
    )
    arrays = (trained.logits.softmax(-1), trained.mean, trained.log_std.exp())
    return MixtureArrays(*(part.numpy() for part in arrays)), trained


def drawn(arrays: MixtureArrays, temperature: float, count: int) -> np.ndarray:
    """So many commands (N, count, FINS, 3) of each robot."""
    rng = np.random.default_rng(0)
    uniform = rng.random((N, FINS, count), dtype=np.float32)
    normal = rng.standard_normal((N, FINS, count, 3), dtype=np.float32)
    return arrays.tempered(temperature, uniform, normal)


def test_the_same_draws_give_the_commands_that_training_samples() -> None:
    arrays, trained = make_pair()
    repeated = Mixture(*(part.repeat_interleave(K, dim=0) for part in trained))
    generator = torch.Generator().manual_seed(3)
    uniform = torch.rand((N * K, FINS, 1), generator=generator)
    normal = torch.randn((N * K, FINS, 3), generator=generator)
    expected = repeated.sample(uniform, normal).unflatten(0, (N, K))
    got = arrays.tempered(
        1.0,
        uniform.view(N, K, FINS).swapaxes(1, 2).numpy(),
        normal.view(N, K, FINS, 3).swapaxes(1, 2).numpy(),
    )
    assert got.shape == (N, K, FINS, 3) and got.dtype == np.float32
    np.testing.assert_allclose(got, expected.numpy(), atol=2e-6)


@pytest.mark.parametrize("temperature", [1.0, 0.3, 0.02])
def test_a_temperature_sharpens_weights_alone(temperature: float) -> None:
    """As printed: softmax(log pi / T), and the Gaussians as they are."""
    arrays, trained = make_pair()
    sharp = (trained.logits / temperature).softmax(-1).numpy()
    cold = MixtureArrays(sharp, arrays.mean, arrays.std)
    np.testing.assert_allclose(drawn(arrays, temperature, K), drawn(cold, 1.0, K), atol=2e-6)


def test_no_temperature_takes_the_likeliest_component() -> None:
    arrays, _ = make_pair()
    arrays = arrays._replace(std=np.zeros_like(arrays.std))
    best = arrays.weight.argmax(-1)
    expected = np.take_along_axis(arrays.mean, best[..., None, None], axis=2)[:, :, 0]
    for temperature in (0.0, 1e-12):
        got = drawn(arrays, temperature, 7)
        np.testing.assert_allclose(got, np.repeat(expected[:, None], 7, axis=1), atol=1e-5)


def test_a_component_keeps_its_deviation_at_any_temperature() -> None:
    arrays, _ = make_pair()
    first = np.zeros_like(arrays.weight)
    first[..., 0] = 1.0
    spread = drawn(arrays._replace(weight=first), 0.25, 20_000).std(1)
    np.testing.assert_allclose(spread, arrays.std[:, :, 0], rtol=0.04)


def test_likelihoods_are_those_of_the_trained_mixture() -> None:
    arrays, trained = make_pair()
    x = np.random.default_rng(0).uniform(-1.2, 1.2, (N, K, FINS, 3)).astype(np.float32)
    mask = torch.ones(N, FINS, dtype=torch.bool)
    expected = torch.stack([trained.log_prob(torch.from_numpy(x[:, k]), mask) for k in range(K)], dim=1)
    np.testing.assert_allclose(arrays.log_likelihood(x), expected.numpy(), rtol=1e-5, atol=1e-4)


def test_the_expected_command_is_the_mean_of_many_draws() -> None:
    arrays, _ = make_pair()
    rng = np.random.default_rng(1)
    uniform = rng.random((N, FINS, 50_000), dtype=np.float32)
    normal = rng.standard_normal((N, FINS, 50_000, 3), dtype=np.float32)
    np.testing.assert_allclose(arrays.tempered(1.0, uniform, normal).mean(1), arrays.expected(), atol=0.015)


def test_components_that_never_come_up_are_no_warning(recwarn: pytest.WarningsRecorder) -> None:
    arrays, _ = make_pair()
    sure = arrays._replace(weight=np.repeat(np.eye(M, dtype=np.float32)[:N, None], FINS, axis=1))
    normal = np.zeros((N, FINS, K, 3), dtype=np.float32)
    drawn = sure.tempered(0.02, np.full((N, FINS, K), 0.999, dtype=np.float32), normal)
    for row in range(N):
        np.testing.assert_array_equal(drawn[row], np.tile(arrays.mean[row, :, row], (K, 1, 1)))
    assert np.isfinite(sure.log_likelihood(drawn)).all()
    assert not recwarn.list
