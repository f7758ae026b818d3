"""Random robots and a network of the paper's kind, small enough to run in milliseconds."""

import math
from typing import NamedTuple

import pytest
import torch
from torch import Tensor

from finlab.inference.features import raw_features
from finlab.inference.weights import NetworkConfig
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.sampling import ForwardSampler, seeded_generator


class Robots(NamedTuple):
    """B robots padded to n fins, with a normalized target each."""

    position: Tensor
    mounting_angle: Tensor
    lower: Tensor
    upper: Tensor
    mask: Tensor
    target: Tensor

    def take(self, batch: slice, fins: Tensor | slice) -> "Robots":
        """Some robots, with some fins in some order."""
        per_fin = [tensor[batch][:, fins] for tensor in self[:5]]
        return Robots(*per_fin, self.target[batch])

    def features(self) -> Tensor:
        """Node features (B, n, 10)."""
        features: Tensor = raw_features(self.position, self.mounting_angle, self.lower, self.upper)
        return features


@pytest.fixture
def robots() -> Robots:
    """12 robots of 2-5 fins, half of them with limits of their own; every count comes up."""
    layouts = ForwardSampler(5, 12, (2, 5)).batch(0)[:5]
    robots = Robots(*layouts, torch.randn(12, 6, generator=seeded_generator(5, 0)))
    assert set(robots.mask.sum(1).tolist()) == {2, 3, 4, 5}
    arcs = robots.upper[..., 2] - robots.lower[..., 2] < 2 * math.pi - 0.1
    assert arcs.any() and not arcs.all()
    return robots


@pytest.fixture
def network() -> AllocatorNetwork:
    """The paper's network, small."""
    config = NetworkConfig(width=32, heads=2, transformer_layers=2, feedforward=48, n_components=5)
    torch.manual_seed(1)
    network = AllocatorNetwork(config).eval()
    # Fresh biases and normalizations are zeros and ones, which would hide one that is misplaced.
    for parameter in network.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    return network.requires_grad_(False)
