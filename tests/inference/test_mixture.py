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


@pytest.mark.parametrize("temperature", [1.0, 0.3, 0.02, 0.0])
def test_the_same_draws_give_the_same_commands(temperature: float) -> None:
    arrays, trained = make_pair()
    expected = trained.sample(K, temperature, torch.Generator().manual_seed(3))
    generator = torch.Generator().manual_seed(3)
    uniform = torch.rand((N, FINS, K), generator=generator).numpy()
    normal = torch.randn((N, FINS, K, 3), generator=generator).numpy()
    got = arrays.tempered(temperature, uniform, normal)
    assert got.shape == (N, K, FINS, 3) and got.dtype == np.float32
    np.testing.assert_allclose(got, expected.numpy(), atol=2e-6)


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
