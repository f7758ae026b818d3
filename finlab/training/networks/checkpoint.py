"""Checkpoints as networks that can be trained; `finlab.inference.checkpoint` knows the files."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import nn

from finlab.inference.checkpoint import checkpoint_files, read_checkpoint
from finlab.inference.fast_weights import FastWeights
from finlab.inference.features import SIZES
from finlab.inference.normalization import Normalization
from finlab.inference.weights import State, TrainedWeights
from finlab.training.networks.allocator_network import AllocatorNetwork
from finlab.training.networks.surrogate import Surrogate, make_surrogate

Network = TypeVar("Network", bound=nn.Module)


@dataclass
class Checkpoint:
    """Trained networks and what they were trained for."""

    name: str
    """Name shown to users; the folder's."""
    surrogate: Surrogate
    """Learned fin physics."""
    normalization: Normalization
    """Per-axis statistics of the wrench."""
    fin_model: dict[str, Any]
    """Fin model that the surrogate learned, as in a layout file: {type, parameters}."""
    network: AllocatorNetwork | None = None
    """The allocator network; None where only the surrogate was trained."""
    preset: str = "default"
    """Name of the training recipe."""
    training: dict[str, Any] = field(default_factory=dict)
    """Settings of the runs that made it."""
    metrics: dict[str, Any] = field(default_factory=dict)
    """Measured figures, each with what scored it."""
    sha256: str = ""
    """SHA-256 of the weights file, filled on loading and saving."""
    fast: FastWeights | None = None
    """The distilled network, if there is one; filled on loading."""

    @classmethod
    def of(cls, weights: TrainedWeights) -> Checkpoint:
        """The networks that hold these weights, not to be trained further unless told so."""
        network = None
        if weights.network_config is not None:
            sizes = weights.network_config
            network = _filled(AllocatorNetwork(sizes, SIZES[sizes.features]), weights.network)
        return cls(
            name=weights.name,
            surrogate=_filled(make_surrogate(weights.surrogate_config), weights.surrogate),
            normalization=weights.normalization,
            fin_model=dict(weights.fin_model),
            network=network,
            preset=weights.preset,
            training=dict(weights.training),
            metrics=dict(weights.metrics),
            sha256=weights.sha256,
            fast=weights.fast,
        )

    def weights(self) -> TrainedWeights:
        """The networks' weights as arrays, for the allocators."""
        return TrainedWeights(
            name=self.name,
            normalization=self.normalization,
            fin_model=self.fin_model,
            surrogate_config=self.surrogate.config,
            surrogate=_state(self.surrogate),
            network_config=None if self.network is None else self.network.config,
            network={} if self.network is None else _state(self.network),
            fast=self.fast,
            preset=self.preset,
            training=self.training,
            metrics=self.metrics,
            sha256=self.sha256,
        )


def save_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint folder; the distilled network beside it, if there is one, is left as it is."""
    folder.mkdir(parents=True, exist_ok=True)
    weights = checkpoint.weights()
    for name, content in checkpoint_files(replace(weights, fast=None)).items():
        (folder / name).write_bytes(content)
    checkpoint.sha256 = read_checkpoint(folder).sha256


def load_checkpoint(folder: Path) -> Checkpoint:
    """Read a checkpoint folder; errors as in `read_checkpoint`."""
    return Checkpoint.of(read_checkpoint(folder))


def _filled(network: Network, state: State) -> Network:
    """A network with these weights, frozen."""
    network.load_state_dict({key: torch.tensor(value) for key, value in state.items()}, strict=True)
    return network.eval().requires_grad_(False)


def _state(network: nn.Module) -> State:
    return {key: value.detach().cpu().numpy() for key, value in network.state_dict().items()}
