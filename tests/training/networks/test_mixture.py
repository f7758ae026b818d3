"""Mixture densities against `torch.distributions`, and their samples."""

import pytest
import torch
from torch import Tensor
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal

from finlab.training.networks.allocator_network import Mixture

B, N, M = 4, 3, 5


def make_mixture(joint: bool, wraps: bool = False, log_std: float = -1.0) -> Mixture:
    """A random mixture for B robots of N fins."""
    draw = torch.Generator().manual_seed(11)
    return Mixture(
        torch.randn((B, M) if joint else (B, N, M), generator=draw, dtype=torch.float64),
        torch.rand(B, N, M, 3, generator=draw, dtype=torch.float64) * 1.8 - 0.9,
        log_std + 0.3 * torch.randn(B, N, M, 3, generator=draw, dtype=torch.float64),
        torch.full((B, N), wraps),
    )


def commands() -> Tensor:
    return torch.rand(B, N, 3, generator=torch.Generator().manual_seed(2), dtype=torch.float64) * 2 - 1


def test_joint_likelihood_is_that_of_one_mixture_over_all_fins() -> None:
    mixture, x = make_mixture(joint=True), commands()
    flat = [value.transpose(1, 2).reshape(B, M, N * 3) for value in (mixture.mean, mixture.log_std.exp())]
    reference = MixtureSameFamily(Categorical(logits=mixture.logits), Independent(Normal(*flat), 1))
    got = mixture.log_prob(x, torch.ones(B, N, dtype=torch.bool))
    torch.testing.assert_close(got, reference.log_prob(x.reshape(B, N * 3)))


def test_likelihood_per_fin_is_the_product_of_the_fins_mixtures() -> None:
    mixture, x = make_mixture(joint=False), commands()
    normal = Independent(Normal(mixture.mean, mixture.log_std.exp()), 1)
    reference = MixtureSameFamily(Categorical(logits=mixture.logits), normal).log_prob(x)
    got = mixture.log_prob(x, torch.ones(B, N, dtype=torch.bool))
    torch.testing.assert_close(got, reference.sum(1))


@pytest.mark.parametrize("joint", [True, False])
def test_padded_fins_count_nothing(joint: bool) -> None:
    mixture, x = make_mixture(joint), commands()
    mask = torch.tensor([True, True, False]).expand(B, -1)
    got = mixture.log_prob(x, mask)
    logits = mixture.logits if joint else mixture.logits[:, :2]
    without = Mixture(logits, mixture.mean[:, :2], mixture.log_std[:, :2], mixture.wraps[:, :2])
    torch.testing.assert_close(got, without.log_prob(x[:, :2], mask[:, :2]))


@pytest.mark.parametrize("joint", [True, False])
def test_a_full_circle_of_directions_has_no_seam(joint: bool) -> None:
    mixture, x = make_mixture(joint, wraps=True), commands()
    mask = torch.ones(B, N, dtype=torch.bool)
    turned = x + torch.tensor([0.0, 0.0, 2.0])  # one turn, in normalized coordinates
    torch.testing.assert_close(mixture.log_prob(turned, mask), mixture.log_prob(x, mask))
    # On either side of the seam a direction is as near to a mean at it.
    seam = mixture._replace(mean=torch.ones_like(mixture.mean))
    just = torch.tensor([1.0, 1.0, 0.99]).expand(B, N, 3).double()
    torch.testing.assert_close(
        seam.log_prob(just, mask), seam.log_prob(just * torch.tensor([1.0, 1.0, -1.0]), mask)
    )


def test_an_arc_of_directions_does_not_wrap() -> None:
    mixture, x = make_mixture(True, wraps=False), commands()
    mask = torch.ones(B, N, dtype=torch.bool)
    turned = mixture.log_prob(x + torch.tensor([0.0, 0.0, 2.0]), mask)
    assert (turned < mixture.log_prob(x, mask) - 1.0).all()


def test_amplitude_and_frequency_never_wrap() -> None:
    x = commands() + torch.tensor([2.0, 2.0, 0.0])
    mixture = make_mixture(True, wraps=True)
    torch.testing.assert_close(mixture.deviation(x)[..., :2], x[:, :, None, :2] - mixture.mean[..., :2])


@pytest.mark.parametrize("joint", [True, False])
def test_samples_have_the_moments_of_the_mixture(joint: bool) -> None:
    mixture = make_mixture(joint)
    x = mixture.sample(20_000, 1.0, torch.Generator().manual_seed(0))
    assert x.shape == (B, 20_000, N, 3)
    weight = mixture.logits.softmax(-1)
    weight = weight[:, None, :, None] if joint else weight[..., None]
    mean = (weight * mixture.mean).sum(2)
    second = (weight * (mixture.mean.square() + mixture.log_std.exp().square())).sum(2)
    std = (second - mean.square()).sqrt()
    torch.testing.assert_close(x.mean(1), mean, atol=0.025, rtol=0.0)
    torch.testing.assert_close(x.std(1), std, atol=0.0, rtol=0.04)


def test_a_joint_sample_takes_the_same_component_for_all_fins() -> None:
    mixture = make_mixture(joint=True, log_std=-20.0)
    mixture = mixture._replace(logits=torch.zeros(B, M).double())
    x = mixture.sample(200, 1.0, torch.Generator().manual_seed(0))
    distance = (x[:, :, :, None] - mixture.mean[:, None]).norm(dim=-1)  # (B, K, N, M)
    component = distance.argmin(-1)
    assert (component == component[:, :, :1]).all()
    assert all(set(row[:, 0].tolist()) == set(range(M)) for row in component)


def test_samples_per_fin_mix_the_components() -> None:
    mixture = make_mixture(joint=False, log_std=-20.0)
    mixture = mixture._replace(logits=torch.zeros(B, N, M).double())
    x = mixture.sample(200, 1.0, torch.Generator().manual_seed(0))
    component = (x[:, :, :, None] - mixture.mean[:, None]).norm(dim=-1).argmin(-1)
    assert (component != component[:, :, :1]).any()


@pytest.mark.parametrize("joint", [True, False])
def test_temperature_near_zero_gives_the_likeliest_mean(joint: bool) -> None:
    mixture = make_mixture(joint)
    x = mixture.sample(7, 1e-12, torch.Generator().manual_seed(0))
    best = mixture.logits.argmax(-1)
    best = best[:, None].expand(B, N) if joint else best
    expected = mixture.mean.gather(2, best[..., None, None].expand(-1, -1, 1, 3))[:, :, 0]
    torch.testing.assert_close(x, expected[:, None].expand_as(x), atol=1e-5, rtol=0.0)


def test_temperature_scales_the_variance() -> None:
    mixture = make_mixture(joint=True)
    mixture = mixture._replace(logits=torch.tensor([50.0, 0, 0, 0, 0]).double().expand(B, M))
    std = mixture.sample(20_000, 0.25, torch.Generator().manual_seed(0)).std(1)
    torch.testing.assert_close(std, 0.5 * mixture.log_std[:, :, 0].exp(), atol=0.0, rtol=0.04)


def test_the_same_generator_gives_the_same_samples() -> None:
    mixture = make_mixture(joint=True)
    first, second, other = (mixture.sample(5, 1.0, torch.Generator().manual_seed(seed)) for seed in (4, 4, 5))
    assert torch.equal(first, second)
    assert not torch.equal(first, other)
