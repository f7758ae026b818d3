"""Torch modules from the weights of a checkpoint, and back; `finlab.inference.checkpoint` knows the files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import torch
from torch import Tensor, nn

from finlab.inference.checkpoint import checkpoint_files, read_checkpoint
from finlab.inference.features import SIZES
from finlab.inference.weights import State, TrainedWeights
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.networks.surrogate import Surrogate, make_surrogate

Module = TypeVar("Module", bound=nn.Module)


def surrogate_of(weights: TrainedWeights) -> Surrogate:
    """The surrogate as a module, frozen."""
    return _filled(make_surrogate(weights.surrogate_config), weights.surrogate)


def network_of(weights: TrainedWeights) -> AllocatorNetwork:
    """The allocator network as a module, frozen.

    Raises:
        CheckpointError: only the surrogate was trained.
    """
    sizes = weights.check_network()
    return _filled(AllocatorNetwork(sizes, SIZES[sizes.features]), weights.network)


def state_of(tensors: Mapping[str, Tensor]) -> State:
    """The state of a module, or what was trained of it, as arrays."""
    return {key: value.detach().cpu().numpy() for key, value in tensors.items()}


def save_checkpoint(folder: Path, weights: TrainedWeights) -> TrainedWeights:
    """Write a checkpoint folder, and answer what is in it; a distilled network beside it is left as it is."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in checkpoint_files(replace(weights, fast=None)).items():
        (folder / name).write_bytes(content)
    return read_checkpoint(folder)


def _filled(module: Module, state: State) -> Module:
    module.load_state_dict({key: torch.tensor(value) for key, value in state.items()}, strict=True)
    return module.eval().requires_grad_(False)
