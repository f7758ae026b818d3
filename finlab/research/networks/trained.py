"""The contents of a checkpoint: weights, sizes and history of networks, and what normalizes their
numbers.

Methods `mdn` and `paper` are made of it, training ends with it, `checkpoint.py` reads and writes
it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from finlab.arrays import AnyArray, Values
from finlab.errors import CheckpointError
from finlab.files.checkpoint_config import WrenchNormalization
from finlab.research.networks.layers import single_precision

ArraysByName = Mapping[str, AnyArray]
"""Weights of a network by PyTorch's names."""
Shapes = dict[str, tuple[int, ...]]
"""Shapes of the weights of a network, by the same names."""

MAX_SIZE = 4096
"""Largest width, or number of layers or heads, of a network in a file."""
MAX_WEIGHT = 1e6
"""Largest magnitude of a weight; training stays below 100, and far beyond this answers would be
NaN."""


def to_normalized(command: Values, lower: Values, upper: Values) -> Values:
    """Returns commands in normalized coordinates, in which limits are -1 and 1.

    Args:
        command: commands (..., 3) [rad, Hz, rad].
        lower: lower limits (..., 3).
        upper: upper limits (..., 3).

    Returns:
        Coordinates (..., 3) [1]; 0 where a range has no width.
    """
    half = 0.5 * (upper - lower)
    return (command - lower - half) / half.clip(1e-9)


def to_command(x: Values, lower: Values, upper: Values) -> Values:
    """Returns commands of normalized coordinates, the inverse of `to_normalized`; not clipped.

    Args:
        x: coordinates (..., 3) [1].
        lower: lower limits (..., 3) [rad, Hz, rad].
        upper: upper limits (..., 3).

    Returns:
        Commands (..., 3) [rad, Hz, rad].
    """
    half = 0.5 * (upper - lower)
    return lower + half + x * half


class Sizes(Protocol):
    """The sizes of a network: a frozen dataclass of whole numbers, with the shapes that follow from
    them."""

    features: ClassVar[str]
    """What the network is fed, such as "raw" of the paper's."""
    joint: ClassVar[bool]
    """Whether one component is chosen for all fins together."""
    shipped: ClassVar[str]
    """The checkpoint with such a network that is shipped."""

    def shapes(self) -> Shapes:
        """Returns the shape of each array by name. Raises ValueError: there is no network of these
        sizes."""
        ...


SizesT = TypeVar("SizesT", bound=Sizes)


@dataclass(frozen=True)
class TrainedWeights:
    """The contents of a checkpoint: networks, their sizes, how they were made, and what they
    normalize by."""

    name: str
    """Name of the checkpoint's folder."""
    normalization: WrenchNormalization
    """Statistics of the wrenches that the networks were trained on."""
    network_sizes: Mapping[str, Any] | None = None
    """Sizes of the network and what it is fed, as in the file; None where only a surrogate was
    trained."""
    network: ArraysByName = field(default_factory=dict)
    """Weights of the network that proposes commands; empty where there is none."""
    surrogate_sizes: Mapping[str, Any] | None = None
    """Sizes of the paper's surrogate, as in the file; None where there is none."""
    surrogate: ArraysByName = field(default_factory=dict)
    """Weights of the paper's surrogate, learned fin physics; empty where there is none."""
    fin_model: Mapping[str, Any] = field(default_factory=dict)
    """Fin model that the surrogate learned, as in a layout file: {type, parameters}."""
    preset: str = "default"
    """Name of the settings with which it was trained."""
    training: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the runs that made it."""
    metrics: Mapping[str, Any] = field(default_factory=dict)
    """Measured figures, each with what scored it."""
    sha256: str = ""
    """SHA-256 of the file of the weights; empty for what was not read from a file."""

    @cached_property
    def single_precision(self) -> dict[str, Any]:
        """Weights of the network in single precision; all methods that are made of it share
        them."""
        return single_precision(self.network)

    def network_of(self, kind: type[SizesT]) -> SizesT:
        """Returns the sizes of the network.

        Args:
            kind: class of the sizes, which says what the network has to be fed.

        Raises:
            CheckpointError: there is no network, one of another kind, or a damaged one.
        """
        values = dict(self.network_sizes or {})
        features = values.pop("features", None)
        joint = values.pop("joint", None)
        if (features, joint) != (kind.features, kind.joint):
            content = "no network"
            if self.network_sizes:
                content = f"a network that is fed {features!r:.40}"
            raise CheckpointError(
                f"checkpoint {self.name!r} holds {content}, expected one that is fed "
                f"{kind.features!r}, as that of the shipped `{kind.shipped}`"
            )
        try:
            sizes = kind(**values)
            check_state(self.network, sizes.shapes())
        except (TypeError, ValueError) as error:
            raise CheckpointError(
                f"checkpoint {self.name!r}: its network is damaged ({error})"
            ) from error
        return sizes


def sizes_for_file(sizes: Sizes) -> dict[str, Any]:
    """Returns the sizes of a network, and what tells its kind, as plain values for a file."""
    return {"features": sizes.features, "joint": sizes.joint} | vars(sizes)


def check_state(state: ArraysByName, shapes: Shapes) -> None:
    """Refuses a network that has not exactly some arrays.

    Args:
        state: weights of the network.
        shapes: the shapes that they have to have.

    Raises:
        ValueError: one is missing, unknown or of another shape.
    """
    differing = sorted(set(shapes) ^ set(state))
    if differing:
        raise ValueError(f"{differing[0]!r:.80} is missing or not expected")
    for name, shape in shapes.items():
        if state[name].shape != shape:
            raise ValueError(f"{name}: expected shape {shape}, got {state[name].shape}")


def check_arrays(state: ArraysByName) -> None:
    """Refuses arrays that no training leaves.

    Raises:
        ValueError: one is not of float32, or a weight is NaN or beyond `MAX_WEIGHT`.
    """
    for name, array in state.items():
        if array.dtype != np.float32:
            raise ValueError(f"{name:.80}: expected float32, got {array.dtype}")
        if not (np.abs(array) <= MAX_WEIGHT).all():  # false for NaN as well
            raise ValueError(f"{name:.80}: holds NaN or a number beyond {MAX_WEIGHT:g}")


def check_sizes(*sizes: object, heads: tuple[int, int] = (1, 1)) -> None:
    """Refuses sizes that no network has.

    Args:
        sizes: widths and numbers of layers.
        heads: width of an attention layer, and its number of heads.

    Raises:
        ValueError: a size is no whole number from 1 to `MAX_SIZE`, or the number of heads does not
            divide the width.
    """
    for size in sizes:
        if isinstance(size, bool) or not isinstance(size, int) or not 1 <= size <= MAX_SIZE:
            raise ValueError(
                f"expected whole numbers from 1 to {MAX_SIZE} as sizes, got {size!r:.40}"
            )
    width, n_heads = heads
    if width % n_heads:
        raise ValueError(f"width {width} is no multiple of heads {n_heads}")


def linear_shapes(name: str, n_in: int, n_out: int) -> Shapes:
    """Returns the shapes of a linear layer: weight (n_out, n_in) and bias (n_out,).

    Args:
        name: of the layer, with which the names of its arrays begin.
        n_in: number of inputs.
        n_out: number of outputs.
    """
    return {f"{name}.weight": (n_out, n_in), f"{name}.bias": (n_out,)}


def norm_shapes(name: str, width: int) -> Shapes:
    """Returns the shapes of a layer normalization: weight and bias (width,).

    Args:
        name: of the layer, with which the names of its arrays begin.
        width: number of features.
    """
    return {f"{name}.weight": (width,), f"{name}.bias": (width,)}
