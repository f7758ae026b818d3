"""The paper's trained network as a module, which judges the one in numpy."""

import torch

from finlab.inference.weights import NetworkConfig, TrainedWeights
from finlab.training.networks.allocator_network import AllocatorNetwork


def network_of(weights: TrainedWeights) -> AllocatorNetwork:
    """The network of a checkpoint, frozen."""
    network = AllocatorNetwork(weights.check_network(NetworkConfig))
    network.load_state_dict({key: torch.tensor(value) for key, value in weights.network.items()}, strict=True)
    return network.eval().requires_grad_(False)
