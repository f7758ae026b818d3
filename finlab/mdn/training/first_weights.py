"""Random weights to start from, by the shapes of a network."""

import math

import torch
from torch import Tensor

from finlab.networks.trained import Shapes

ZERO = ("in_proj_bias", "out_proj.bias")
"""Ends of the names of arrays that start at zero, as in PyTorch's attention."""


def first_weights(shapes: Shapes, seed: int) -> dict[str, Tensor]:
    """Weights by name, drawn as PyTorch draws those of its own layers (Glorot and Bengio for attention,
    uniform over one over the root of the inputs for linear layers); they depend on the seed alone."""
    generator = torch.Generator().manual_seed(seed)
    drawn = {name: _drawn(name, shape, shapes, generator) for name, shape in shapes.items()}
    return {name: values.requires_grad_() for name, values in drawn.items()}


def _drawn(name: str, shape: tuple[int, ...], shapes: Shapes, generator: torch.Generator) -> Tensor:
    layer, _, part = name.rpartition(".")
    weight = shapes.get(f"{layer}.weight", ())
    if len(weight) == 1:  # a normalization
        return torch.ones(shape) if part == "weight" else torch.zeros(shape)
    if name.endswith(ZERO) or (part == "bias" and not weight):
        return torch.zeros(shape)
    if part in ("attention", "in_proj_weight"):
        bound = math.sqrt(6.0 / sum(shape))
    else:
        bound = 1.0 / math.sqrt(weight[1])
    return (2.0 * torch.rand(shape, generator=generator) - 1.0) * bound
