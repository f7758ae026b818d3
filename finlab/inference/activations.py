"""Activation functions of the trained networks. Sigmoids go by way of a tangent, which never overflows."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def softmax(x: Array, axis: int = -1) -> Array:
    """Softmax, in place."""
    x -= np.maximum.reduce(x, axis=axis, keepdims=True)
    np.exp(x, out=x)
    x /= np.add.reduce(x, axis=axis, keepdims=True)
    return x


def elu(x: Array) -> Array:
    """Exponential linear unit, in place."""
    below = np.minimum(x, 0)
    np.expm1(below, out=below)
    np.maximum(x, 0, out=x)
    x += below
    return x


def sigmoid(x: Array) -> Array:
    """Sigmoid."""
    y = np.tanh(x * np.float32(0.5))
    y += np.float32(1.0)
    y *= np.float32(0.5)
    return y


def silu(x: Array) -> Array:
    """Sigmoid linear unit, in place."""
    x *= sigmoid(x)
    return x


def silu_and_slope(x: Array) -> tuple[Array, Array]:
    """Sigmoid linear unit, in place, and its derivative s + x s (1 - s)."""
    gate = sigmoid(x)
    slope = np.float32(1.0) - gate
    x *= gate
    slope *= x
    slope += gate
    return x, slope
