"""Activation functions of the trained networks. Sigmoids go by way of a tangent, which never overflows."""

import numpy as np

from finlab.arrays import AnyArray


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
    y = np.tanh(x * np.float32(0.5))
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
