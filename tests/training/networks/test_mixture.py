"""The paper's mixture densities against `torch.distributions`, and their samples."""

import torch
from torch import Tensor
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal

from finlab.training.networks.allocator_network import Mixture

B, N, M = 4, 3, 5


def make_mixture(log_std: float = -1.0) -> Mixture:
    """A random mixture for B robots of N fins."""
    draw = torch.Generator().manual_seed(11)
    return Mixture(
        torch.randn((B, N, M), generator=draw, dtype=torch.float64),
        torch.rand(B, N, M, 3, generator=draw, dtype=torch.float64) * 1.8 - 0.9,
        log_std + 0.3 * torch.randn(B, N, M, 3, generator=draw, dtype=torch.float64),
    )


def commands() -> Tensor:
    return torch.rand(B, N, 3, generator=torch.Generator().manual_seed(2), dtype=torch.float64) * 2 - 1


def test_likelihood_per_fin_is_the_product_of_the_fins_mixtures() -> None:
    mixture, x = make_mixture(), commands()
    normal = Independent(Normal(mixture.mean, mixture.log_std.exp()), 1)
    reference = MixtureSameFamily(Categorical(logits=mixture.logits), normal).log_prob(x)
    got = mixture.log_prob(x, torch.ones(B, N, dtype=torch.bool))
    torch.testing.assert_close(got, reference.sum(1))


def test_padded_fins_count_nothing() -> None:
    mixture, x = make_mixture(), commands()
    mask = torch.tensor([True, True, False]).expand(B, -1)
    got = mixture.log_prob(x, mask)
    without = Mixture(*(part[:, :2] for part in mixture))
    torch.testing.assert_close(got, without.log_prob(x[:, :2], mask[:, :2]))


def many_samples(mixture: Mixture, count: int) -> Tensor:
    """So many samples (B, count, N, 3) of each robot's mixture."""
    repeated = Mixture(*(part.repeat_interleave(count, dim=0) for part in mixture))
    draw = torch.Generator().manual_seed(0)
    uniform = torch.rand((B * count, N, 1), generator=draw, dtype=torch.float64)
    normal = torch.randn((B * count, N, 3), generator=draw, dtype=torch.float64)
    return repeated.sample(uniform, normal).unflatten(0, (B, count))


def test_samples_have_the_moments_of_the_mixture() -> None:
    mixture = make_mixture()
    x = many_samples(mixture, 20_000)
    assert x.shape == (B, 20_000, N, 3)
    weight = mixture.logits.softmax(-1)[..., None]
    mean = (weight * mixture.mean).sum(2)
    second = (weight * (mixture.mean.square() + mixture.log_std.exp().square())).sum(2)
    std = (second - mean.square()).sqrt()
    torch.testing.assert_close(x.mean(1), mean, atol=0.025, rtol=0.0)
    torch.testing.assert_close(x.std(1), std, atol=0.0, rtol=0.04)


def test_samples_per_fin_mix_the_components() -> None:
    mixture = make_mixture(log_std=-20.0)
    mixture = mixture._replace(logits=torch.zeros(B, N, M).double())
    x = many_samples(mixture, 200)
    component = (x[:, :, :, None] - mixture.mean[:, None]).norm(dim=-1).argmin(-1)
    assert (component != component[:, :, :1]).any()


def test_a_fin_whose_number_is_all_but_one_takes_the_last_component() -> None:
    mixture = make_mixture()
    last = mixture.sample(torch.ones(B, N, 1).double(), torch.zeros(B, N, 3).double())
    torch.testing.assert_close(last, mixture.mean[:, :, -1])
