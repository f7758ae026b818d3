"""The layers of the networks, each written once: numpy answers with them, PyTorch trains through
them.

A network is a function of its weights, a mapping from PyTorch's names to arrays or tensors, and of
its inputs. On a robot the weights are numpy arrays in single precision and no tensor library is
needed.
"""

import math
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import Any

import numpy as np

from finlab.arrays import Values, library_of
from finlab.research.networks.padding import Padding

Weights = Mapping[str, Values]
"""Arrays of a network by name: numpy arrays or tensors."""
EPSILON = 1e-5
"""Added to the variance by a layer normalization, as by PyTorch's."""
LEAK = 0.2
"""Slope of the leaky rectifier of GATv2 below zero."""


def linear(w: Weights, name: str, x: Values) -> Values:
    """Returns the outputs of a linear layer, x W^T + b.

    Args:
        w: weights of the network.
        name: of the layer; without a bias among the weights, none is added.
        x: features (..., in).

    Returns:
        Features (..., out).
    """
    xp = library_of(x)
    weight = w[f"{name}.weight"]
    bias = w.get(f"{name}.bias")
    if xp is not np:
        return xp.nn.functional.linear(x, weight, bias)
    # One product of two matrices is much faster than numpy's loop over stacked small ones.
    y = x.reshape(-1, x.shape[-1]) @ weight.T
    return (y if bias is None else y + bias).reshape(*x.shape[:-1], weight.shape[0])


def layer_norm(w: Weights, name: str, x: Values) -> Values:
    """Returns normalized features, with scale and shift (Ba, Kiros, Hinton, 2016).

    Args:
        w: weights of the network.
        name: of the layer.
        x: features (..., width).

    Returns:
        Features (..., width).
    """
    weight = w[f"{name}.weight"]
    bias = w[f"{name}.bias"]
    xp = library_of(x)
    if xp is not np:
        return xp.nn.functional.layer_norm(x, x.shape[-1:], weight, bias, EPSILON)
    width = np.float32(x.shape[-1])
    y = x - np.add.reduce(x, axis=-1, keepdims=True) / width
    variance = np.einsum("...i,...i->...", y, y) / width + np.float32(EPSILON)
    y /= np.sqrt(variance)[..., None]
    y *= weight
    y += bias
    return y


def feed_forward(w: Weights, up: str, down: str, x: Values) -> Values:
    """Returns the outputs of two linear layers with a rectifier between them.

    Args:
        w: weights of the network.
        up: name of the first layer.
        down: name of the second layer.
        x: features (..., width).

    Returns:
        Features (..., width).
    """
    hidden = linear(w, up, x)
    rectified = np.maximum(hidden, 0) if library_of(x) is np else hidden.relu()
    return linear(w, down, rectified)


def graph_attention(
    w: Weights, name: str, x: Values, pairs: Values | None = None, padding: Padding | None = None
) -> Values:
    """Returns the outputs of a GATv2 layer (Brody, Alon, Yahav, ICLR 2022) on complete graphs with
    self loops; heads are concatenated.

    Args:
        w: weights of the network.
        name: of the layer.
        x: features (B, n, width) of the nodes; with padding their rows (M, width).
        pairs: features (B, n, n, F) of pairs, target before source, which count in the scores; what
            is scored is then the message, too. None for none.
        padding: of graphs with fewer than n nodes: none receives a message from padding.

    Returns:
        Features of the same shape as x.
    """
    xp = library_of(x)
    vectors = w[f"{name}.attention"]
    source = linear(w, f"{name}.source", x)
    target = linear(w, f"{name}.target", x)
    if padding is not None:
        source = padding.padded(source)
        target = padding.padded(target)
    sent = source[:, None]
    if pairs is not None:
        sent = linear(w, f"{name}.pair", pairs) + sent
    hidden = leaky_relu(sent + target[:, :, None])  # (B, n, n, width)
    hidden = hidden.reshape(*hidden.shape[:-1], *vectors.shape)
    score = xp.einsum("...hc,hc->...h", hidden, vectors)
    if padding is not None:
        score = xp.where(padding.mask[:, None, :, None], score, -math.inf)
    weight = softmax(score, 2)
    if pairs is not None:
        return xp.einsum("bijh,bijhc->bihc", weight, hidden).reshape(x.shape)
    message = source.reshape(*source.shape[:2], *vectors.shape)
    attended = xp.einsum("bijh,bjhc->bihc", weight, message).reshape(source.shape)
    if padding is not None:
        attended = padding.rows(attended)
    return attended + w[f"{name}.bias"]


def self_attention(
    w: Weights, name: str, heads: int, x: Values, padding: Padding | None = None
) -> Values:
    """Returns the outputs of scaled dot-product attention (Vaswani et al., 2017).

    Args:
        w: weights of the network.
        name: of the layer.
        heads: number of heads.
        x: features (B, n, width); with padding their rows (M, width).
        padding: as for `graph_attention`.

    Returns:
        Features of the same shape as x.
    """
    width = x.shape[-1]
    packed = {"in.weight": w[f"{name}.in_proj_weight"], "in.bias": w[f"{name}.in_proj_bias"]}
    qkv = linear(packed, "in", x)
    if padding is not None:
        qkv = padding.padded(qkv)
    robots, n, _ = qkv.shape  # (B, n, 3 width)

    def by_head(first: int) -> Values:
        """Features (B, heads, n, width / heads) of `width` columns."""
        columns = qkv[..., first : first + width]
        return columns.reshape(robots, n, heads, -1).swapaxes(1, 2)

    q = by_head(0)
    k = by_head(width)
    v = by_head(2 * width)
    score = (q @ k.swapaxes(2, 3)) * (width // heads) ** -0.5
    if padding is not None:
        score = library_of(score).where(padding.mask[:, None, None], score, -math.inf)
    attended = (softmax(score) @ v).swapaxes(1, 2).reshape(robots, n, width)
    if padding is not None:
        attended = padding.rows(attended)
    return linear(w, f"{name}.out_proj", attended)


def leaky_relu(x: Values) -> Values:
    """Returns x above zero, `LEAK` times x below, of any shape."""
    xp = library_of(x)
    return np.maximum(x, LEAK * x) if xp is np else xp.nn.functional.leaky_relu(x, LEAK)


def elu(x: Values) -> Values:
    """Returns x above zero, exp(x) - 1 below, of any shape."""
    xp = library_of(x)
    if xp is not np:
        return xp.nn.functional.elu(x)
    return np.maximum(x, 0) + np.expm1(np.minimum(x, 0))


def softmax(x: Values, axis: int = -1) -> Values:
    """Returns exp(x) over its sum along an axis."""
    if library_of(x) is not np:
        return x.softmax(axis)
    y = np.exp(x - np.maximum.reduce(x, axis=axis, keepdims=True))
    y /= np.add.reduce(y, axis=axis, keepdims=True)
    return y


def log_sum_exp(x: Values, axis: int = -1) -> Values:
    """Returns log(sum(exp(x))) along an axis."""
    return np.logaddexp.reduce(x, axis=axis) if library_of(x) is np else x.logsumexp(axis)


def log_softmax(x: Values) -> Values:
    """Returns the logarithm of the softmax along the last axis."""
    return x - log_sum_exp(x)[..., None]


def take(x: Values, index: Values, axis: int) -> Values:
    """Returns entries along an axis, as numpy's `take_along_axis`.

    Args:
        x: values (...).
        index: which entries, with as many axes as x.
        axis: the axis along which they are taken.
    """
    xp = library_of(x)
    return np.take_along_axis(x, index, axis) if xp is np else xp.take_along_dim(x, index, axis)


def single_precision(weights: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the weights of a network as numpy arrays in single precision."""
    return {name: np.asarray(value, dtype=np.float32) for name, value in weights.items()}


def single_threaded_products() -> Callable[[], AbstractContextManager[object]]:
    """Returns a function that makes a context in which numpy's products run on one thread.

    Where threadpoolctl is missing, as on a robot that carries only the runtime, the context does
    nothing; there OPENBLAS_NUM_THREADS=1 in the environment has the same effect.
    """
    try:
        from threadpoolctl import ThreadpoolController
    except ImportError:
        return nullcontext
    return partial(ThreadpoolController().select(user_api="blas").limit, limits=1)
