"""The paper's network: padding never leaks, and fins may come in any order."""

import torch
from torch import Tensor

from finlab.inference.mixture import LOG_STD_BOUND
from finlab.training.networks.allocator_network import AllocatorNetwork, Mixture


def predict(network: AllocatorNetwork, robots, mask: Tensor | None) -> Mixture:
    """The mixture for robots of the conftest."""
    return network(robots.features(), robots.target, mask)


def test_padding_does_not_leak(network, robots) -> None:
    padded = predict(network, robots, robots.mask)
    for row, n in enumerate(robots.mask.sum(1).tolist()):
        one = predict(network, robots.take(slice(row, row + 1), slice(n)), None)
        for got, expected in ((padded.mean, one.mean), (padded.log_std, one.log_std)):
            torch.testing.assert_close(got[row, :n], expected[0], atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(padded.logits[row, :n], one.logits[0], atol=1e-5, rtol=1e-5)


def test_what_stands_in_padded_rows_does_not_matter(network, robots) -> None:
    x = robots.features()
    clean = network(x, robots.target, robots.mask)
    garbage = torch.where(robots.mask[..., None], x, 1e3 * torch.randn(x.shape))
    dirty = network(garbage, robots.target, robots.mask)
    for got, expected in zip(dirty, clean, strict=True):
        torch.testing.assert_close(got[robots.mask], expected[robots.mask])


def test_fins_may_come_in_any_order(network, robots) -> None:
    order = torch.tensor([3, 0, 4, 1, 2])
    straight = predict(network, robots, robots.mask)
    shuffled = robots.take(slice(None), order)
    turned = predict(network, shuffled, shuffled.mask)
    seen = shuffled.mask
    for got, expected in zip(turned, straight, strict=True):
        torch.testing.assert_close(got[seen], expected[:, order][seen], atol=1e-5, rtol=1e-5)


def test_the_answer_depends_on_target_and_layout(network, robots) -> None:
    base = predict(network, robots, robots.mask).mean
    other_target = predict(network, robots._replace(target=robots.target.flip(1)), robots.mask).mean
    other_layout = predict(network, robots._replace(position=-robots.position), robots.mask).mean
    assert (base - other_target)[robots.mask].abs().mean() > 1e-3
    assert (base - other_layout)[robots.mask].abs().mean() > 1e-3


def test_shapes_and_spread_are_what_the_configuration_says(network, robots) -> None:
    mixture = predict(network, robots, robots.mask)
    assert mixture.logits.shape == (12, 5, 5)
    assert mixture.mean.shape == mixture.log_std.shape == (12, 5, 5, 3)
    assert mixture.log_std.abs().max() <= LOG_STD_BOUND
