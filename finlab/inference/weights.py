"""Trained networks as numpy arrays: their sizes, the shapes that follow, and what they were trained for."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any

from numpy.typing import NDArray

from finlab.errors import CheckpointError
from finlab.inference.fast_network import FastWeights
from finlab.inference.features import RAW_SIZE, SIZES
from finlab.inference.normalization import Normalization

Array = NDArray[Any]
State = Mapping[str, Array]
"""Arrays of a network by PyTorch's names."""
Shapes = dict[str, tuple[int, ...]]

LARGEST_SIZE = 4096
"""Largest width or count that a network may have."""
DESCRIPTOR = 64
"""Width of the layout descriptor in an `mlp` surrogate."""


@dataclass(frozen=True)
class SurrogateConfig:
    """Kind and size of a surrogate."""

    kind: str = "coefficient"
    """`coefficient` (force coefficient in the fin's own frame) or `mlp` (the paper's)."""
    hidden: tuple[int, ...] = (32, 32)
    """Widths of the hidden layers."""

    def shapes(self) -> Shapes:
        """Shape of each array of such a surrogate.

        Raises:
            ValueError: there is no such surrogate.
        """
        if self.kind not in ("coefficient", "mlp"):
            raise ValueError(f"expected a surrogate of kind coefficient or mlp, got {self.kind!r:.40}")
        _check_sizes(*self.hidden)
        coefficient = self.kind == "coefficient"
        sizes = [4 if coefficient else RAW_SIZE + 3, *self.hidden, 3]
        shapes: Shapes = {}
        for i, (n_in, n_out) in enumerate(pairwise(sizes)):
            shapes |= _linear(f"net.{2 * i}", n_in, n_out)  # activations stand between the layers
        if coefficient:
            return shapes
        return shapes | _linear("descriptor.0", RAW_SIZE, DESCRIPTOR) | _linear("affine", DESCRIPTOR, 12)


@dataclass(frozen=True)
class NetworkConfig:
    """Sizes of the allocator network."""

    features: str = "fin_frame"
    """Which node features it is fed: `raw` (the paper's ten) or `fin_frame`."""
    joint: bool = True
    """One mixture component for all fins together (True) or one mixture per fin (False, the paper)."""
    width: int = 128
    """Width of every hidden layer."""
    heads: int = 4
    """Attention heads of GATv2 and of the Transformer."""
    graph_layers: int = 2
    """Number of GATv2 layers."""
    transformer_layers: int = 3
    """Number of Transformer encoder layers."""
    feedforward: int = 256
    """Hidden width of the Transformer's feed-forward blocks."""
    n_components: int = 8
    """Number M of mixture components."""

    def shapes(self) -> Shapes:
        """Shape of each array of such a network.

        Raises:
            ValueError: there is no such network.
        """
        if self.features not in SIZES or not isinstance(self.joint, bool):
            raise ValueError(f"expected features {', '.join(SIZES)} and joint true or false")
        _check_sizes(*(getattr(self, f.name) for f in fields(self) if f.name not in ("features", "joint")))
        width, n_features = self.width, SIZES[self.features]
        if width % self.heads:
            raise ValueError(f"width {width} is no multiple of heads {self.heads}")
        shapes: Shapes = {}
        for i in range(self.graph_layers):
            name, n_in = f"graph.{i}", width if i else n_features
            shapes |= {f"{name}.attention": (self.heads, width // self.heads), f"{name}.bias": (width,)}
            shapes |= _linear(f"{name}.source", n_in, width) | _linear(f"{name}.target", n_in, width)
        shapes |= _linear("skip", n_features, width) | _linear("join", 2 * width, width)
        shapes |= _linear("wrench.0", 6, width) | _linear("wrench.2", width, width)
        for i in range(self.transformer_layers):
            name = f"transformer.layers.{i}"
            shapes |= {
                f"{name}.self_attn.in_proj_weight": (3 * width, width),
                f"{name}.self_attn.in_proj_bias": (3 * width,),
            }
            shapes |= _linear(f"{name}.self_attn.out_proj", width, width)
            shapes |= _linear(f"{name}.linear1", width, self.feedforward)
            shapes |= _linear(f"{name}.linear2", self.feedforward, width)
            shapes |= _scale(f"{name}.norm1", width) | _scale(f"{name}.norm2", width)
        per_component = 7 if self.joint else 6
        shapes |= _scale("norm", width) | _linear("head", width, self.n_components * per_component)
        return shapes | _linear("weight", width, self.n_components)


@dataclass(frozen=True)
class TrainedWeights:
    """The contents of a checkpoint."""

    name: str
    """Name shown to users; the checkpoint folder's."""
    normalization: Normalization
    """Per-axis statistics of the wrench."""
    fin_model: Mapping[str, Any]
    """Fin model that the surrogate learned, as in a layout file: {type, parameters}."""
    surrogate_config: SurrogateConfig
    """Kind and size of the surrogate."""
    surrogate: State
    """The surrogate, learned fin physics."""
    network_config: NetworkConfig | None = None
    """Sizes of the allocator network; None where only the surrogate was trained."""
    network: State = field(default_factory=dict)
    """The allocator network; empty where there is none."""
    fast: FastWeights | None = None
    """The distilled network, where one was trained."""
    preset: str = "default"
    """Name of the training recipe."""
    training: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the runs that made it."""
    metrics: Mapping[str, Any] = field(default_factory=dict)
    """Measured figures, each with what scored it."""
    sha256: str = ""
    """SHA-256 of the file of the weights; empty for what was not read from a file."""

    def check_network(self) -> NetworkConfig:
        """The sizes of the allocator network, which must be there.

        Raises:
            CheckpointError: only the surrogate was trained.
        """
        if self.network_config is None:
            raise CheckpointError(
                f"checkpoint {self.name!r} holds a surrogate only; train the allocator with "
                "`finlab train allocator`"
            )
        return self.network_config


def _check_sizes(*sizes: object) -> None:
    for size in sizes:
        if isinstance(size, bool) or not isinstance(size, int) or not 1 <= size <= LARGEST_SIZE:
            raise ValueError(f"expected whole numbers from 1 to {LARGEST_SIZE} as sizes, got {size!r:.40}")


def _linear(name: str, n_in: int, n_out: int) -> Shapes:
    return {f"{name}.weight": (n_out, n_in), f"{name}.bias": (n_out,)}


def _scale(name: str, width: int) -> Shapes:
    return {f"{name}.weight": (width,), f"{name}.bias": (width,)}
