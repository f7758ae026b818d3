"""The contents of a checkpoint: weights, sizes and history of networks, and what normalizes their
numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Protocol, TypeVar

import numpy as np

from finlab.arrays import AnyArray, Array, Values
from finlab.errors import CheckpointError
from finlab.research.networks.layers import single_precision

State = Mapping[str, AnyArray]
"""Arrays of a network by PyTorch's names."""
Shapes = dict[str, tuple[int, ...]]

LARGEST_SIZE = 4096
LARGEST_WEIGHT = 1e6
"""Largest magnitude of a weight; training stays below 100, and far beyond this answers would be
NaN."""


class WrenchNormalization(NamedTuple):
    """Mean and standard deviation of the wrench over a data set, each of shape (6,) [N, N m]."""

    mean: Array
    std: Array
    """Per-axis standard deviation; `sigma` in the error measure."""

    @classmethod
    def parse(cls, values: Any) -> WrenchNormalization:
        """The statistics under the keys `mean` and `std`. Raises ValueError: there are no such six
        numbers."""
        try:
            mean, std = (np.asarray(values[name], dtype=np.float64) for name in cls._fields)
        except (KeyError, TypeError, ValueError):
            mean = std = np.empty(0)
        if (
            mean.shape != (6,)
            or std.shape != (6,)
            or not (np.isfinite(mean).all() and (std > 0.0).all())
        ):
            raise ValueError("normalization must be six means and six standard deviations above 0")
        return cls(mean, std)


def to_normalized(command: Values, lower: Values, upper: Values) -> Values:
    """Normalized coordinates (..., 3) in [-1, 1] of commands (..., 3) [rad, Hz, rad] between limits
    (..., 3); a range of no width maps to 0."""
    half = 0.5 * (upper - lower)
    return (command - lower - half) / half.clip(1e-9)


def to_command(x: Values, lower: Values, upper: Values) -> Values:
    """Commands (..., 3) of normalized coordinates (..., 3) between limits (..., 3), the inverse of
    `to_normalized`; not clamped."""
    half = 0.5 * (upper - lower)
    return lower + half + x * half


class Sizes(Protocol):
    """The sizes of a network: a frozen dataclass of whole numbers, with the shapes that follow from
    them."""

    features: ClassVar[str]
    joint: ClassVar[bool]
    """Whether one component is chosen for all fins together."""
    shipped: ClassVar[str]
    """The checkpoint with such a network that is shipped."""

    def shapes(self) -> Shapes:
        """Shape of each array by name. Raises ValueError: there is no network of these sizes."""
        ...


Kind = TypeVar("Kind", bound=Sizes)


@dataclass(frozen=True)
class TrainedWeights:
    """The contents of a checkpoint: networks, their sizes, how they were made, and what they
    normalize by."""

    name: str
    normalization: WrenchNormalization
    network_sizes: Mapping[str, Any] | None = None
    """Sizes of the network and what it is fed, as in the file; None where only a surrogate was
    trained."""
    network: State = field(default_factory=dict)
    surrogate_sizes: Mapping[str, Any] | None = None
    """Sizes of the paper's surrogate, as in the file; None where there is none."""
    surrogate: State = field(default_factory=dict)
    """The paper's surrogate, learned fin physics; empty where there is none."""
    fin_model: Mapping[str, Any] = field(default_factory=dict)
    """Fin model that the surrogate learned, as in a layout file: {type, parameters}."""
    preset: str = "default"
    training: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the runs that made it."""
    metrics: Mapping[str, Any] = field(default_factory=dict)
    """Measured figures, each with what scored it."""
    sha256: str = ""
    """SHA-256 of the file of the weights; empty for what was not read from a file."""

    @cached_property
    def single_precision(self) -> dict[str, Any]:
        """The network in single precision, ready to be asked; every method that is made of it
        shares this."""
        return single_precision(self.network)

    def network_of(self, kind: type[Kind]) -> Kind:
        """The sizes of the network. Raises CheckpointError: there is none, one of another kind, or
        a damaged one."""
        known = self.network_sizes or {}
        if (known.get("features"), known.get("joint")) != (kind.features, kind.joint):
            has = f"a network that is fed {known.get('features')!r:.40}" if known else "no network"
            raise CheckpointError(
                f"checkpoint {self.name!r} holds {has}, expected one that is fed "
                f"{kind.features!r}, as that of the shipped `{kind.shipped}`"
            )
        try:
            sizes = kind(
                **{key: value for key, value in known.items() if key not in ("features", "joint")}
            )
            check_state(self.network, sizes.shapes())
        except (TypeError, ValueError) as error:
            raise CheckpointError(
                f"checkpoint {self.name!r}: its network is damaged ({error})"
            ) from error
        return sizes


def sizes_for_file(sizes: Sizes) -> dict[str, Any]:
    """The sizes of a network, and what tells its kind, for a file."""
    return {"features": sizes.features, "joint": sizes.joint} | vars(sizes)


def check_state(state: State, shapes: Shapes) -> None:
    """Refuse a network without exactly these arrays. Raises ValueError: one is missing, unknown or
    of another shape."""
    if wrong := sorted(set(shapes) ^ set(state)):
        raise ValueError(f"{wrong[0]!r:.80} is missing or not expected")
    for name, shape in shapes.items():
        if state[name].shape != shape:
            raise ValueError(f"{name}: expected shape {shape}, got {state[name].shape}")


def check_arrays(state: State) -> None:
    """Refuse arrays that no training leaves. Raises ValueError: one is not of float32, or a weight
    is NaN or beyond `LARGEST_WEIGHT`."""
    for name, array in state.items():
        if array.dtype != np.float32:
            raise ValueError(f"{name:.80}: expected float32, got {array.dtype}")
        if not (np.abs(array) <= LARGEST_WEIGHT).all():  # false for NaN as well
            raise ValueError(f"{name:.80}: holds NaN or a number beyond {LARGEST_WEIGHT:g}")


def check_sizes(*sizes: object, heads: tuple[int, int] = (1, 1)) -> None:
    """Refuse sizes that no network has. Raises ValueError: one is no whole number from 1 to
    `LARGEST_SIZE`, or of `heads`, a width and a number of heads, the second does not divide the
    first."""
    for size in sizes:
        if isinstance(size, bool) or not isinstance(size, int) or not 1 <= size <= LARGEST_SIZE:
            raise ValueError(
                f"expected whole numbers from 1 to {LARGEST_SIZE} as sizes, got {size!r:.40}"
            )
    if heads[0] % heads[1]:
        raise ValueError(f"width {heads[0]} is no multiple of heads {heads[1]}")


def linear_shapes(name: str, n_in: int, n_out: int) -> Shapes:
    """The shapes of a linear layer: weight (n_out, n_in) and bias (n_out,), by name."""
    return {f"{name}.weight": (n_out, n_in), f"{name}.bias": (n_out,)}


def norm_shapes(name: str, width: int) -> Shapes:
    """The shapes of a layer normalization: weight and bias (width,), by name."""
    return {f"{name}.weight": (width,), f"{name}.bias": (width,)}
