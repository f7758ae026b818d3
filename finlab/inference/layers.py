"""What the trained networks are made of, in numpy and single precision: linear layers, norms, activations.

A network this small spends most of its time on the overhead of each tensor operation; numpy's is a few times
smaller than a tensor library's, and a robot's computer need not have one.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray

EPSILON = np.float32(1e-5)
"""Added to the variance by a layer normalization, as by PyTorch's."""


class Linear(NamedTuple):
    """A linear layer."""

    weight: AnyArray
    """(in, out)."""
    bias: AnyArray
    """(out,)."""

    def __call__(self, x: AnyArray) -> AnyArray:
        """Features (R, out) of features (R, in)."""
        # One product of two matrices is much faster than numpy's loop over stacked small ones.
        y: AnyArray = x.dot(self.weight)
        y += self.bias
        return y

    def after_norm(self, w: Mapping[str, AnyArray], name: str) -> "Linear":
        """The layer that also scales and shifts, as the layer normalization `name` before it does."""
        scale, shift = (w[f"{name}.{part}"].astype(np.float64) for part in ("weight", "bias"))
        bias = self.bias + shift @ self.weight
        return Linear((self.weight * scale[:, None]).astype(np.float32), bias.astype(np.float32))


def single_precision(weights: Mapping[str, NDArray[np.floating]]) -> dict[str, AnyArray]:
    """The state of a network by PyTorch's names, in single precision."""
    return {key: np.asarray(value, dtype=np.float32) for key, value in weights.items()}


def names_of_layers(w: Mapping[str, AnyArray], name: str) -> list[str]:
    """Those of the layers `name.0`, `name.1` ... that there are, in order."""
    numbers = {int(key[len(name) + 1 :].split(".")[0]) for key in w if key.startswith(f"{name}.")}
    return [f"{name}.{number}" for number in sorted(numbers)]


def linear(w: Mapping[str, AnyArray], *names: str) -> Linear:
    """A linear layer, or several of them side by side; one without a bias has 0."""
    weight = np.concatenate([w[f"{name}.weight"] for name in names]).T.copy()
    none = np.zeros(weight.shape[1] // len(names), dtype=np.float32)
    return Linear(weight, np.concatenate([w.get(f"{name}.bias", none) for name in names]))


def normalized(x: AnyArray) -> AnyArray:
    """Layer normalization of features (R, width), without scale and shift."""
    result = x - np.add.reduce(x, axis=1, keepdims=True) / np.float32(x.shape[1])
    square = np.einsum("ri,ri->r", result, result)
    square /= np.float32(x.shape[1])
    square += EPSILON
    result /= np.sqrt(square, out=square)[:, None]
    return result


def head_scores(attention: AnyArray) -> AnyArray:
    """Attention vectors (heads, c) in block form (heads c, heads), so that one product scores all heads."""
    heads, size = attention.shape
    blocks: AnyArray = np.repeat(np.eye(heads, dtype=attention.dtype), size, axis=0)
    return blocks * attention.reshape(-1, 1)


class FeedForward:
    """The feed-forward block of a Transformer layer, normalization first, ReLU."""

    def __init__(self, w: Mapping[str, AnyArray], up: str, down: str, norm: str) -> None:
        """Take over the layers of these names."""
        self._up, self._down = linear(w, up).after_norm(w, norm), linear(w, down)

    def __call__(self, x: AnyArray) -> None:
        """Add what it makes of hidden features (R, width) to them, in place."""
        up = self._up(normalized(x))
        x += self._down(np.maximum(up, 0, out=up))


# Activation functions. Sigmoids go by way of a tangent, which never overflows.


def softmax(x: AnyArray, axis: int = -1) -> AnyArray:
    """Softmax, in place."""
    x -= np.maximum.reduce(x, axis=axis, keepdims=True)
    np.exp(x, out=x)
    x /= np.add.reduce(x, axis=axis, keepdims=True)
    return x


def elu(x: AnyArray) -> AnyArray:
    """Exponential linear unit, in place."""
    below = np.minimum(x, 0)
    np.expm1(below, out=below)
    np.maximum(x, 0, out=x)
    x += below
    return x


def sigmoid(x: AnyArray) -> AnyArray:
    """Sigmoid."""
    y: AnyArray = x * np.float32(0.5)
    np.tanh(y, out=y)
    y += np.float32(1.0)
    y *= np.float32(0.5)
    return y


def silu(x: AnyArray) -> AnyArray:
    """Sigmoid linear unit, in place."""
    x *= sigmoid(x)
    return x


def silu_and_slope(x: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Sigmoid linear unit, in place, and its derivative s + x s (1 - s)."""
    gate = sigmoid(x)
    slope = np.float32(1.0) - gate
    x *= gate
    slope *= x
    slope += gate
    return x, slope
