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

Weights = Mapping[str, Values]
"""Arrays of a network by name: numpy arrays or tensors."""
EPSILON = 1e-5
"""Added to the variance by a layer normalization, as by PyTorch's."""
LEAK = 0.2
"""Slope of the leaky rectifier of GATv2 below zero."""


def linear(w: Weights, name: str, x: Values) -> Values:
    """Features (..., out) of features (..., in); a layer without a bias has none to add."""
    xp = library_of(x)
    weight = w[f"{name}.weight"]
    bias = w.get(f"{name}.bias")
    if xp is not np:
        return xp.nn.functional.linear(x, weight, bias)
    # One product of two matrices is much faster than numpy's loop over stacked small ones.
    y = x.reshape(-1, x.shape[-1]) @ weight.T
    return (y if bias is None else y + bias).reshape(*x.shape[:-1], weight.shape[0])


def layer_norm(w: Weights, name: str, x: Values) -> Values:
    """Layer normalization of features (..., width), with scale and shift."""
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
    """Two linear layers with a rectifier between them: features (..., width) of the same."""
    hidden = linear(w, up, x)
    return linear(w, down, np.maximum(hidden, 0) if library_of(x) is np else hidden.relu())


def graph_attention(
    w: Weights, name: str, x: Values, pairs: Values | None = None, mask: Values | None = None
) -> Values:
    """A GATv2 layer (Brody, Alon, Yahav, ICLR 2022) on complete graphs with self loops: features
    (B, n, width) of the same; heads are concatenated. Features of pairs (B, n, n, F), where there
    are any, count in what is scored, and what is scored is then the message, too. No node listens
    to one where `mask` (B, n) is False."""
    xp = library_of(x)
    vectors = w[f"{name}.attention"]
    source, target = (linear(w, f"{name}.{part}", x) for part in ("source", "target"))
    seen = source[:, None] if pairs is None else linear(w, f"{name}.pair", pairs) + source[:, None]
    hidden = leaky_relu(seen + target[:, :, None])  # (B, n, n, width)
    hidden = hidden.reshape(*hidden.shape[:-1], *vectors.shape)
    score = xp.einsum("...hc,hc->...h", hidden, vectors)
    weight = softmax(
        score if mask is None else xp.where(mask[:, None, :, None], score, -math.inf), 2
    )
    if pairs is not None:
        return xp.einsum("bijh,bijhc->bihc", weight, hidden).reshape(x.shape)
    message = source.reshape(*source.shape[:2], *vectors.shape)
    return xp.einsum("bijh,bjhc->bihc", weight, message).reshape(source.shape) + w[f"{name}.bias"]


def self_attention(
    w: Weights, name: str, heads: int, x: Values, mask: Values | None = None
) -> Values:
    """Scaled dot-product attention of a Transformer (Vaswani et al., 2017): features (B, n, width)
    of the same; `mask` as in `graph_attention`."""
    width = x.shape[-1]
    packed = {"in.weight": w[f"{name}.in_proj_weight"], "in.bias": w[f"{name}.in_proj_bias"]}
    qkv = linear(packed, "in", x)
    parts = (qkv[..., k * width : (k + 1) * width] for k in range(3))
    q, k, v = (part.reshape(*x.shape[:2], heads, -1).swapaxes(1, 2) for part in parts)
    score = (q @ k.swapaxes(2, 3)) * (width // heads) ** -0.5
    if mask is not None:
        score = library_of(score).where(mask[:, None, None], score, -math.inf)
    return linear(w, f"{name}.out_proj", (softmax(score) @ v).swapaxes(1, 2).reshape(x.shape))


def leaky_relu(x: Values) -> Values:
    """x above zero, `LEAK` times x below."""
    xp = library_of(x)
    return np.maximum(x, LEAK * x) if xp is np else xp.nn.functional.leaky_relu(x, LEAK)


def elu(x: Values) -> Values:
    """x above zero, exp(x) - 1 below."""
    xp = library_of(x)
    return np.maximum(x, 0) + np.expm1(np.minimum(x, 0)) if xp is np else xp.nn.functional.elu(x)


def softmax(x: Values, axis: int = -1) -> Values:
    """exp(x) over its sum along an axis."""
    if library_of(x) is not np:
        return x.softmax(axis)
    y = np.exp(x - np.maximum.reduce(x, axis=axis, keepdims=True))
    y /= np.add.reduce(y, axis=axis, keepdims=True)
    return y


def log_sum_exp(x: Values, axis: int = -1) -> Values:
    """log(sum(exp(x))) along an axis."""
    return np.logaddexp.reduce(x, axis=axis) if library_of(x) is np else x.logsumexp(axis)


def log_softmax(x: Values) -> Values:
    """Logarithm of the softmax along the last axis."""
    return x - log_sum_exp(x)[..., None]


def take(x: Values, index: Values, axis: int) -> Values:
    """Entries of x along an axis, as numpy's `take_along_axis`."""
    xp = library_of(x)
    return np.take_along_axis(x, index, axis) if xp is np else xp.take_along_dim(x, index, axis)


def single_precision(weights: Mapping[str, Any]) -> dict[str, Any]:
    """The weights of a network as numpy arrays in single precision."""
    return {name: np.asarray(value, dtype=np.float32) for name, value in weights.items()}


def single_threaded_products() -> Callable[[], AbstractContextManager[object]]:
    """A context in which numpy's products run on one thread.

    Where threadpoolctl is missing, as on a robot that carries only the runtime, the context does
    nothing; there OPENBLAS_NUM_THREADS=1 in the environment has the same effect.
    """
    try:
        from threadpoolctl import ThreadpoolController
    except ImportError:
        return nullcontext
    return partial(ThreadpoolController().select(user_api="blas").limit, limits=1)
