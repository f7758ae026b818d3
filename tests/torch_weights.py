"""Weights of networks as arrays and as tensors."""

import torch

from finlab.research.networks.trained import ArraysByName


def arrays_of(weights: dict[str, torch.Tensor]) -> ArraysByName:
    """Weights as arrays."""
    return {name: value.detach().numpy() for name, value in weights.items()}
