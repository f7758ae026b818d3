"""The allocator network: padding never leaks, fins may come in any order, means stay inside the limits."""

import math

import pytest
import torch
from torch import Tensor

from finlab.inference.mixture import LOG_STD_BOUND
from finlab.training.networks.allocator_network import AllocatorNetwork, Mixture


def predict(network: AllocatorNetwork, robots, mask: Tensor | None) -> Mixture:
    """The mixture for robots of the conftest."""
    x = robots.features(network.config.features)
    return network(x, robots.target, robots.lower, robots.upper, mask)


def test_padding_does_not_leak(network, robots) -> None:
    padded = predict(network, robots, robots.mask)
    for row, n in enumerate(robots.mask.sum(1).tolist()):
        one = predict(network, robots.take(slice(row, row + 1), slice(n)), None)
        for got, expected in ((padded.mean, one.mean), (padded.log_std, one.log_std)):
            torch.testing.assert_close(got[row, :n], expected[0], atol=1e-5, rtol=1e-5)
        got = padded.logits[row] if padded.joint else padded.logits[row, :n]
        torch.testing.assert_close(got, one.logits[0], atol=1e-5, rtol=1e-5)


def test_what_stands_in_padded_rows_does_not_matter(network, robots) -> None:
    x = robots.features(network.config.features)
    limits = (robots.lower, robots.upper, robots.mask)
    clean = network(x, robots.target, *limits)
    garbage = torch.where(robots.mask[..., None], x, 1e3 * torch.randn(x.shape))
    dirty = network(garbage, robots.target, *limits)
    for got, expected in zip(dirty[:3], clean[:3], strict=True):
        per_fin = got.shape[:2] == robots.mask.shape
        torch.testing.assert_close(
            got[robots.mask] if per_fin else got, expected[robots.mask] if per_fin else expected
        )


def test_fins_may_come_in_any_order(network, robots) -> None:
    order = torch.tensor([3, 0, 4, 1, 2])
    straight = predict(network, robots, robots.mask)
    shuffled = robots.take(slice(None), order)
    turned = predict(network, shuffled, shuffled.mask)
    expected_logits = straight.logits if straight.joint else straight.logits[:, order]
    seen = shuffled.mask
    for got, expected in ((turned.mean, straight.mean), (turned.log_std, straight.log_std)):
        torch.testing.assert_close(got[seen], expected[:, order][seen], atol=1e-5, rtol=1e-5)
    if straight.joint:
        torch.testing.assert_close(turned.logits, expected_logits, atol=1e-5, rtol=1e-5)
    else:
        torch.testing.assert_close(turned.logits[seen], expected_logits[seen], atol=1e-5, rtol=1e-5)


def test_the_answer_depends_on_target_and_layout(network, robots) -> None:
    base = predict(network, robots, robots.mask).mean
    other_target = predict(network, robots._replace(target=robots.target.flip(1)), robots.mask).mean
    other_layout = predict(network, robots._replace(position=-robots.position), robots.mask).mean
    assert (base - other_target)[robots.mask].abs().mean() > 1e-3
    assert (base - other_layout)[robots.mask].abs().mean() > 1e-3


def test_shapes_and_spread_are_what_the_configuration_says(network, robots) -> None:
    mixture = predict(network, robots, robots.mask)
    assert mixture.joint == network.config.joint
    assert mixture.logits.shape == ((12, 5) if mixture.joint else (12, 5, 5))
    assert mixture.mean.shape == mixture.log_std.shape == (12, 5, 5, 3)
    assert mixture.log_std.abs().max() <= LOG_STD_BOUND


@pytest.mark.parametrize("network", ["joint"], indirect=True)
def test_joint_means_keep_every_limit(network, robots) -> None:
    mixture = predict(network, robots, robots.mask)
    assert mixture.mean[robots.mask].abs().max() <= 1.0 + 1e-6
    arcs = robots.upper[..., 2] - robots.lower[..., 2] < 2 * math.pi - 1e-3
    assert torch.equal(mixture.wraps, ~arcs)


def test_zero_direction_of_an_arc_is_the_nearest_in_it_and_passes_the_gradient() -> None:
    # An arc of 90 degrees about straight up; the vectors point 30 degrees off it, and straight down.
    lower, upper = torch.tensor([[[0.0, 0.0, math.pi / 4]]]), torch.tensor([[[1.0, 1.0, 3 * math.pi / 4]]])
    angle = torch.tensor([math.pi / 2 + 0.2, math.pi / 4 - math.pi / 6, -math.pi / 2 + 0.1])
    vector = torch.stack([angle.cos(), angle.sin()], dim=-1)[None, None].requires_grad_(True)
    direction = AllocatorNetwork._direction(vector, lower, upper)[..., 0]
    torch.testing.assert_close(direction.detach()[0, 0], torch.tensor([0.2 / (math.pi / 4), -1.0, -1.0]))
    (gradient,) = torch.autograd.grad(direction.sum(), vector)
    assert (gradient[0, 0].norm(dim=-1) > 0.1).all()


def test_attention_of_the_first_layer_is_a_distribution_over_real_fins(network, robots) -> None:
    weight = network.attention(robots.features(network.config.features), robots.mask)
    assert weight.shape == (12, 5, 5)
    torch.testing.assert_close(weight.sum(-1), torch.ones(12, 5))
    assert (weight.transpose(1, 2)[~robots.mask] == 0).all()
