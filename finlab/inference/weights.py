"""Trained networks as numpy arrays: their sizes, the shapes that follow, and what they were trained for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, ClassVar, TypeVar

import numpy as np

from finlab.arrays import AnyArray
from finlab.errors import CheckpointError
from finlab.inference.features import RAW_SIZE
from finlab.inference.force_network import NODE_SIZE, PAIR_SIZE
from finlab.inference.normalization import Normalization

State = Mapping[str, AnyArray]
"""Arrays of a network by PyTorch's names."""
Shapes = dict[str, tuple[int, ...]]

LARGEST_SIZE = 4096
"""Largest width or count that a network may have."""
LARGEST_WEIGHT = 1e6
"""Largest magnitude of a weight; training stays below 100, and far beyond this answers would be NaN."""
DESCRIPTOR = 64
"""Width of the layout descriptor in the surrogate."""


@dataclass(frozen=True)
class SurrogateConfig:
    """Sizes of the paper's surrogate."""

    kind: ClassVar[str] = "mlp"
    """What it is called in files."""
    hidden: tuple[int, ...] = (512, 128)
    """Widths of the hidden layers; the first is printed, the second is not."""

    def shapes(self) -> Shapes:
        """Shape of each array; a `ValueError` where there is no surrogate of these sizes."""
        _check_sizes(*self.hidden)
        shapes: Shapes = {}
        for i, (n_in, n_out) in enumerate(pairwise([RAW_SIZE + 3, *self.hidden, 3])):
            shapes |= _linear(f"net.{2 * i}", n_in, n_out)  # activations stand between the layers
        return shapes | _linear("descriptor.0", RAW_SIZE, DESCRIPTOR) | _linear("affine", DESCRIPTOR, 12)


@dataclass(frozen=True)
class NetworkConfig:
    """Sizes of the paper's network: raw features in, a mixture over the commands of each fin out."""

    features: ClassVar[str] = "raw"
    """What it is fed, by its name in files."""
    joint: ClassVar[bool] = False
    """Whether one component is chosen for all fins together."""
    width: int = 128
    """Width of every hidden layer."""
    heads: int = 4
    """Attention heads of GATv2 and of the Transformer."""
    graph_layers: int = 2
    """Number of GATv2 layers."""
    transformer_layers: int = 3
    """Number of Transformer encoder layers."""
    feedforward: int = 512
    """Hidden width of the Transformer's feed-forward blocks; not printed."""
    n_components: int = 8
    """Number M of mixture components."""

    def shapes(self) -> Shapes:
        """Shape of each array; a `ValueError` where there is no network of these sizes."""
        width, shapes = self.width, _ends(self, 6)
        for i in range(self.graph_layers):
            name = f"graph.{i}"
            shapes |= {f"{name}.attention": (self.heads, width // self.heads), f"{name}.bias": (width,)}
            shapes |= _linear(f"{name}.source", width, width) | _linear(f"{name}.target", width, width)
        shapes |= _linear("enter", RAW_SIZE, width) | _linear("wrench", 6, width)
        shapes |= _linear("join", 2 * width, width)
        for i in range(self.transformer_layers):
            name, look = f"transformer.layers.{i}", f"transformer.layers.{i}.self_attn"
            shapes |= {f"{look}.in_proj_weight": (3 * width, width), f"{look}.in_proj_bias": (3 * width,)}
            shapes |= _linear(f"{look}.out_proj", width, width)
            shapes |= _feed_forward(self, name, "linear1", "linear2")
        return shapes


@dataclass(frozen=True)
class ForceNetworkConfig:
    """Sizes of the network of method `mdn`: a joint mixture over the planar forces of all fins."""

    features: ClassVar[str] = "forces"
    """What it is fed, by its name in files."""
    joint: ClassVar[bool] = True
    """Whether one component is chosen for all fins together."""
    width: int = 64
    """Width of every hidden layer."""
    heads: int = 4
    """Attention heads."""
    layers: int = 4
    """Number of Transformer layers."""
    feedforward: int = 128
    """Hidden width of their feed-forward blocks."""
    n_components: int = 16
    """Number M of mixture components."""

    def shapes(self) -> Shapes:
        """Shape of each array; a `ValueError` where there is no network of these sizes."""
        width, shapes = self.width, _ends(self, 3) | _linear("enter", NODE_SIZE, self.width)
        for i in range(self.layers):
            name, look = f"layers.{i}", f"layers.{i}.look"
            shapes |= {f"{look}.attention": (self.heads, width // self.heads)}
            shapes |= {f"{look}.target.weight": (width, width), f"{look}.pair.weight": (width, PAIR_SIZE)}
            shapes |= _linear(f"{look}.source", width, width) | _linear(f"{look}.out", width, width)
            shapes |= _feed_forward(self, name, "up", "down")
        return shapes


AnyNetworkConfig = NetworkConfig | ForceNetworkConfig
Config = TypeVar("Config", NetworkConfig, ForceNetworkConfig)


@dataclass(frozen=True)
class TrainedWeights:
    """The contents of a checkpoint."""

    name: str
    """Name shown to users; the checkpoint folder's."""
    normalization: Normalization
    """Per-axis statistics of the wrench."""
    network_config: AnyNetworkConfig | None = None
    """Sizes of the network; None where only a surrogate was trained."""
    network: State = field(default_factory=dict)
    """The network; empty where there is none."""
    surrogate_config: SurrogateConfig | None = None
    """Sizes of the surrogate; None where there is none."""
    surrogate: State = field(default_factory=dict)
    """The paper's surrogate, learned fin physics; empty where there is none."""
    fin_model: Mapping[str, Any] = field(default_factory=dict)
    """Fin model that the surrogate learned, as in a layout file: {type, parameters}."""
    preset: str = "default"
    """Name of the training recipe."""
    training: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the runs that made it."""
    metrics: Mapping[str, Any] = field(default_factory=dict)
    """Measured figures, each with what scored it."""
    sha256: str = ""
    """SHA-256 of the file of the weights; empty for what was not read from a file."""

    def check_network(self, kind: type[Config]) -> Config:
        """The sizes of the network; a `CheckpointError` where there is none, or one of another kind."""
        sizes, verb = self.network_config, "mdn" if kind is ForceNetworkConfig else "allocator"
        if not isinstance(sizes, kind):
            has = "no network" if sizes is None else f"a network that is fed {sizes.features!r}"
            raise CheckpointError(
                f"checkpoint {self.name!r} holds {has}, expected one that is fed {kind.features!r}; train it "
                f"with `finlab train {verb}`"
            )
        return sizes


def check_state(state: State, shapes: Shapes) -> None:
    """Raise a `ValueError` unless a network has exactly these arrays, in float32 and of sane size."""
    if wrong := sorted(set(shapes) ^ set(state)):
        raise ValueError(f"{wrong[0]!r:.80} is missing or not expected")
    for name, shape in shapes.items():
        array = state[name]
        if array.shape != shape or array.dtype != np.float32:
            raise ValueError(f"{name}: expected float32 of shape {shape}, got {array.dtype} {array.shape}")
        if not (np.abs(array) <= LARGEST_WEIGHT).all():  # false for NaN as well
            raise ValueError(f"{name}: holds NaN or a number beyond {LARGEST_WEIGHT:g}")


def _ends(config: AnyNetworkConfig, outputs: int) -> Shapes:
    """The last layers of a network of possible sizes, with so many outputs for each component."""
    _check_sizes(*vars(config).values())
    width, m = config.width, config.n_components
    if width % config.heads:
        raise ValueError(f"width {width} is no multiple of heads {config.heads}")
    return _norm("norm", width) | _linear("head", width, outputs * m) | _linear("weight", width, m)


def _feed_forward(config: AnyNetworkConfig, name: str, up: str, down: str) -> Shapes:
    """The feed-forward block of a Transformer layer, and both its normalizations."""
    width, inside = config.width, config.feedforward
    shapes = _linear(f"{name}.{up}", width, inside) | _linear(f"{name}.{down}", inside, width)
    return shapes | _norm(f"{name}.norm1", width) | _norm(f"{name}.norm2", width)


def _check_sizes(*sizes: object) -> None:
    for size in sizes:
        if isinstance(size, bool) or not isinstance(size, int) or not 1 <= size <= LARGEST_SIZE:
            raise ValueError(f"expected whole numbers from 1 to {LARGEST_SIZE} as sizes, got {size!r:.40}")


def _linear(name: str, n_in: int, n_out: int) -> Shapes:
    return {f"{name}.weight": (n_out, n_in), f"{name}.bias": (n_out,)}


def _norm(name: str, width: int) -> Shapes:
    return {f"{name}.weight": (width,), f"{name}.bias": (width,)}
