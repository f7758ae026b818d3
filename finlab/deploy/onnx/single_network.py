"""The allocator network for one target on one known layout, in the fewest operators.

It computes what `finlab.deploy.onnx.network` does. With the number of fins known, tensors are matrices with a
row for each fin, and what a layout adds to the first layer is a constant. Each operator costs about a
microsecond however little it computes, so their number is what counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.deploy.onnx.builder import Builder
from finlab.deploy.onnx.network import LOG_STD_RANGE, layer_count, score_block

Weights = Mapping[str, NDArray[Any]]

DYNAMIC = (18, 19, 23, 24, 20, 21, 22)
"""Places among the node features of those that depend on the target, as `add_hidden` takes them."""
TURN = 2 * np.pi


def add_hidden(g: Builder, dynamic: str, static: NDArray[Any], weights: Weights, heads: int) -> str:
    """Normalized hidden features (n, width).

    Args:
        g: the model in the making; holds the tensor `target` (1, 6).
        dynamic: node features (n, 7) that depend on the target, see `DYNAMIC`.
        static: the other node features (n, 18).
        weights: state of the network by PyTorch's names.
        heads: attention heads.
    """
    width = len(weights["skip.bias"])
    names = ("graph.0.source", "graph.0.target", "skip")
    first = np.concatenate([weights[f"{name}.weight"] for name in names]).T
    shift = static @ first[: static.shape[1]] + np.concatenate([weights[f"{name}.bias"] for name in names])
    both = g.add("Gemm", dynamic, g.weight("first", first[list(DYNAMIC)]), g.weight("first shift", shift))
    source, target, skip = g.add_many("Split", both, g.integers([width] * 3), names=names, axis=1)
    hidden = _attend(g, source, target, weights, "graph.0", heads)
    for i in range(1, layer_count(weights, "graph.", 1)):
        ends = [f"graph.{i}.source", f"graph.{i}.target"]
        joined = {
            f"graph.{i}.both.{part}": np.concatenate([weights[f"{end}.{part}"] for end in ends])
            for part in ("weight", "bias")
        }
        both = _linear(g, hidden, joined, f"graph.{i}.both")
        source, target = g.add_many("Split", both, g.integers([width] * 2), names=ends, axis=1)
        hidden = _attend(g, source, target, weights, f"graph.{i}", heads)
    hidden = _join(g, g.add("Add", hidden, skip), weights, width)
    for i in range(layer_count(weights, "transformer.layers.", 2)):
        hidden = _transformer_layer(g, hidden, weights, f"transformer.layers.{i}", heads, width)
    return g.layer_norm(hidden, weights, "norm")


def add_mixture(
    g: Builder, hidden: str, weights: Weights, n_components: int, lower: NDArray[Any], upper: NDArray[Any]
) -> tuple[str, str, str]:
    """Weights (1, M), means (3, M, n) and spreads (3, M, n) of the mixture; limits are (n, 3)."""
    m, n = n_components, len(lower)
    # The head's outputs for each component in turn, as rows for each of its seven numbers in turn.
    matrix = weights["head.weight"].reshape(m, 7, -1).swapaxes(0, 1).reshape(7 * m, -1)
    bias = weights["head.bias"].reshape(m, 7).T.reshape(-1, 1)
    raw = g.add("Gemm", g.weight("head", matrix), hidden, g.weight("head shift", bias), transB=1)
    beat, x, y, spread = g.add_many(
        "Split", raw, g.integers([2 * m, m, m, 3 * m]), names=("raw.size", "raw.x", "raw.y", "spread"), axis=0
    )
    half = np.maximum(0.5 * (upper - lower)[:, 2], 1e-6)
    middle = 0.5 * (upper + lower)[:, 2]
    offset = g.angle(y, g.add("Add", x, g.number(1e-6)))
    if middle.any():  # else the angle is already within half a turn of the middle
        ahead = g.add("Add", offset, g.weight("from seam", np.pi - middle))
        turns = g.add("Floor", g.add("Mul", ahead, g.number(1.0 / TURN)))
        ahead = g.add("Sub", ahead, g.add("Mul", turns, g.number(TURN)))
        offset = g.add("Sub", ahead, g.number(np.pi))
    offset = g.add("Mul", offset, g.weight("per half arc", 1.0 / half))
    inside = g.add("Clip", offset, g.number(-1.0), g.number(1.0))
    shape = g.integers([3, m, n])
    mean = g.add("Reshape", g.add("Concat", g.add("Tanh", beat), inside, axis=0), shape)
    low, high = LOG_STD_RANGE
    inner = g.add("Add", g.add("Mul", g.add("Sigmoid", spread), g.number(high - low)), g.number(low))
    std = g.add("Reshape", g.add("Exp", inner), shape)
    pooled = g.add("ReduceMean", hidden, axes=(0,), keepdims=1)
    return g.add("Softmax", _linear(g, pooled, weights, "weight"), axis=-1), mean, std


def _linear(g: Builder, x: str, weights: Weights, name: str) -> str:
    """A linear layer on a matrix (n, in), with PyTorch's `<name>.weight` (out, in) and `<name>.bias`."""
    matrix = g.weight(f"{name}.weight", weights[f"{name}.weight"].T)
    return g.add("Gemm", x, matrix, g.weight(f"{name}.bias", weights[f"{name}.bias"]))


def _attend(g: Builder, source: str, target: str, weights: Weights, name: str, heads: int) -> str:
    """One dense GATv2 layer (n, width) from both projections (n, width), and the unit after it."""
    block = score_block(weights[f"{name}.attention"])
    width = len(block)
    sources = g.add("Reshape", source, g.integers([1, -1, width]))
    targets = g.add("Reshape", target, g.integers([-1, 1, width]))
    pair = g.add("LeakyRelu", g.add("Add", sources, targets), alpha=0.2)
    share = g.add("Softmax", g.add("MatMul", pair, g.weight(f"{name}.attention", block)), axis=1)
    # Each head's share, repeated for all that it sees: (n, n, width).
    spread = g.weight("heads", np.repeat(np.eye(heads), width // heads, axis=1))
    seen = g.add("Mul", g.add("MatMul", share, spread), sources)
    out = g.add("ReduceSum", seen, g.integers([1]), keepdims=0)
    return g.add("Elu", g.add("Add", out, g.weight(f"{name}.bias", weights[f"{name}.bias"])))


def _join(g: Builder, hidden: str, weights: Weights, width: int) -> str:
    """The layer that sees fins (n, width) and wrench (1, width) side by side."""
    wrench = _linear(g, "target", weights, "wrench.0")
    wrench = g.add("Mul", wrench, g.add("Sigmoid", wrench))
    # Two linear layers in a row are one.
    matrix = weights["join.weight"].T.astype(np.float64)
    both = g.weight("wrench.join", weights["wrench.2.weight"].T @ matrix[width:])
    shift = g.weight("wrench.shift", weights["wrench.2.bias"] @ matrix[width:] + weights["join.bias"])
    seen = g.add("Gemm", wrench, both, shift)
    return g.add("Gemm", hidden, g.weight("join", matrix[:width]), seen)


def _transformer_layer(g: Builder, x: str, weights: Weights, name: str, heads: int, width: int) -> str:
    """One Transformer encoder layer, normalization first, ReLU."""
    part = width // heads
    normed = g.layer_norm(x, weights, f"{name}.norm1")
    scaled = {
        "weight": weights[f"{name}.self_attn.in_proj_weight"].copy(),
        "bias": weights[f"{name}.self_attn.in_proj_bias"].copy(),
    }
    for array in scaled.values():
        array[:width] *= part**-0.5
    own = f"{name}.qkv"
    qkv = _linear(g, normed, {f"{own}.{key}": array for key, array in scaled.items()}, own)
    qkv = g.add("Transpose", g.add("Reshape", qkv, g.integers([-1, 3 * heads, part])), perm=(1, 0, 2))
    roles = [f"{name}.{role}" for role in ("query", "key", "value")]
    query, key, value = g.add_many("Split", qkv, g.integers([heads] * 3), names=roles, axis=0)
    score = g.add("MatMul", query, g.add("Transpose", key, perm=(0, 2, 1)))
    seen = g.add("MatMul", g.add("Softmax", score, axis=-1), value)
    seen = g.add("Reshape", g.add("Transpose", seen, perm=(1, 0, 2)), g.integers([-1, width]))
    x = g.add("Add", x, _linear(g, seen, weights, f"{name}.self_attn.out_proj"))
    normed = g.layer_norm(x, weights, f"{name}.norm2")
    up = g.add("Relu", _linear(g, normed, weights, f"{name}.linear1"))
    return g.add("Add", x, _linear(g, up, weights, f"{name}.linear2"))
