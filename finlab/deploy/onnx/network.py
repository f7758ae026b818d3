"""The allocator network as an ONNX model, and its weights out of one.

The operators are those of `finlab.inference.network`, in the same order; tests hold both against the
network that was trained.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.deploy.onnx.builder import Builder
from finlab.deploy.onnx.model import Model

Weights = Mapping[str, NDArray[Any]]

LOG_STD_RANGE = (-3.0, 3.0)
"""As in `finlab.training.networks.mixture`, which needs torch."""


def network_model(weights: Weights, heads: int, n_components: int, metadata: Mapping[str, str]) -> Model:
    """Features, target and limits in, mixture out.

    Args:
        weights: state of a joint-mixture allocator network by PyTorch's names.
        heads: attention heads.
        n_components: number M of mixture components.
        metadata: what to write beside the weights.
    """
    g = Builder()
    add_network(g, weights, heads, n_components)
    n_features = weights["skip.weight"].shape[1]
    return g.model(
        "finlab allocator network",
        {"features": ("N", "n", n_features), "target": ("N", 6), "lower": ("n", 3), "upper": ("n", 3)},
        {
            "weight": ("N", n_components),
            "mean": ("N", "n", n_components, 3),
            "std": ("N", "n", n_components, 3),
        },
        metadata,
        "N normalized, centred target wrenches on n fins in, a mixture over their normalized commands out.",
    )


def add_network(g: Builder, weights: Weights, heads: int, n_components: int) -> None:
    """From the tensors `features`, `target`, `lower` and `upper` to `weight`, `mean` and `std`."""
    width = len(weights["skip.bias"])
    hidden = "features"
    for i in range(layer_count(weights, "graph.", 1)):
        hidden = g.add("Elu", _graph_layer(g, hidden, weights, f"graph.{i}", heads, width))
    hidden = g.add("Add", hidden, g.linear("features", weights, "skip."))
    wrench = g.linear("target", weights, "wrench.0.")
    wrench = g.linear(g.add("Mul", wrench, g.add("Sigmoid", wrench)), weights, "wrench.2.")
    hidden = _join(g, hidden, wrench, weights, width)
    for i in range(layer_count(weights, "transformer.layers.", 2)):
        hidden = _transformer_layer(g, hidden, weights, f"transformer.layers.{i}", heads, width)
    hidden = g.layer_norm(hidden, weights, "norm")
    _mixture(g, hidden, weights, n_components)


def network_weights(model: Model) -> dict[str, NDArray[np.float32]]:
    """The network's state by PyTorch's names, out of a model that `network_model` made."""
    state = {}
    for name, array in model.weights.items():
        if array.dtype != np.float32 or " " in name:  # shapes and plain numbers
            continue
        if name.endswith(".attention"):
            heads = array.shape[1]
            state[name] = np.stack([np.split(array[:, i], heads)[i] for i in range(heads)])
        else:
            state[name] = array.T if array.ndim == 2 else array
    return state


def score_block(attention: NDArray[Any]) -> NDArray[np.float32]:
    """A GATv2 layer's attention vectors (heads, part) as (width, heads), so that one product scores all."""
    heads, part = attention.shape
    block = np.zeros((heads * part, heads), dtype=np.float32)
    for head in range(heads):
        block[head * part : (head + 1) * part, head] = attention[head]
    return block


def layer_count(weights: Weights, prefix: str, place: int) -> int:
    """How many layers there are whose names start with `prefix`."""
    return len({key.split(".")[place] for key in weights if key.startswith(prefix)})


def _graph_layer(g: Builder, x: str, weights: Weights, name: str, heads: int, width: int) -> str:
    """One dense GATv2 layer: (N, n, F) to (N, n, width)."""
    source = g.linear(x, weights, f"{name}.source.")
    target = g.linear(x, weights, f"{name}.target.")
    pair = g.add(
        "Add",
        g.add("Unsqueeze", source, g.integers([1])),
        g.add("Unsqueeze", target, g.integers([2])),
    )
    block = score_block(weights[f"{name}.attention"])
    score = g.add("MatMul", g.add("LeakyRelu", pair, alpha=0.2), g.weight(f"{name}.attention", block))
    share = g.add("Softmax", g.add("Transpose", score, perm=(0, 3, 1, 2)), axis=-1)  # (N, heads, i, j)
    out = g.add("MatMul", share, g.split_heads(source, heads, width // heads))
    return g.add("Add", g.join_heads(out, width), g.weight(f"{name}.bias", weights[f"{name}.bias"]))


def _join(g: Builder, hidden: str, wrench: str, weights: Weights, width: int) -> str:
    """The layer that sees fins (N, n, width) and wrench (N, width) side by side."""
    matrix = g.weight("join.weight", weights["join.weight"].T)
    of_fins, of_wrench = g.add_many(
        "Split", matrix, g.integers([width, width]), names=("join.fins", "join.wrench"), axis=0
    )
    fins = g.add("MatMul", hidden, of_fins)
    seen = g.add("MatMul", wrench, of_wrench)
    seen = g.add("Add", seen, g.weight("join.bias", weights["join.bias"]))
    return g.add("Add", fins, g.add("Unsqueeze", seen, g.integers([1])))


def _transformer_layer(g: Builder, x: str, weights: Weights, name: str, heads: int, width: int) -> str:
    """One Transformer encoder layer, normalization first, ReLU."""
    part = width // heads
    normed = g.layer_norm(x, weights, f"{name}.norm1")
    qkv = g.linear(normed, weights, f"{name}.self_attn.in_proj_")
    names = [f"{name}.{role}" for role in ("query", "key", "value")]
    query, key, value = g.add_many("Split", qkv, g.integers([width] * 3), names=names, axis=-1)
    query = g.split_heads(query, heads, part)
    key = g.add("Transpose", g.add("Reshape", key, g.integers([0, 0, heads, part])), perm=(0, 2, 3, 1))
    score = g.add("Mul", g.add("MatMul", query, key), g.number(part**-0.5))
    seen = g.add("MatMul", g.add("Softmax", score, axis=-1), g.split_heads(value, heads, part))
    x = g.add("Add", x, g.linear(g.join_heads(seen, width), weights, f"{name}.self_attn.out_proj."))
    normed = g.layer_norm(x, weights, f"{name}.norm2")
    up = g.add("Relu", g.linear(normed, weights, f"{name}.linear1."))
    return g.add("Add", x, g.linear(up, weights, f"{name}.linear2."))


def _mixture(g: Builder, hidden: str, weights: Weights, n_components: int) -> None:
    """Heads (N, n, width) to the outputs weight, mean and std."""
    raw = g.add("Reshape", g.linear(hidden, weights, "head."), g.integers([0, 0, n_components, 7]))
    rest, x, y, spread = g.add_many(
        "Split",
        raw,
        g.integers([2, 1, 1, 3]),
        names=("raw.size", "raw.x", "raw.y", "raw.spread"),
        axis=-1,
    )
    direction = _direction(g, x, y)
    g.add("Concat", g.add("Tanh", rest), direction, axis=-1, name="mean")
    low, high = LOG_STD_RANGE
    inner = g.add("Mul", g.add("Sigmoid", spread), g.number(high - low))
    g.add("Exp", g.add("Add", inner, g.number(low)), name="std")
    pooled = g.add("ReduceMean", hidden, axes=(1,), keepdims=0)
    g.add("Softmax", g.linear(pooled, weights, "weight."), axis=-1, name="weight")


def _direction(g: Builder, x: str, y: str) -> str:
    """Zero directions (N, n, M, 1) in normalized coordinates from vectors in the fins' thrust planes."""
    lower = g.add("Slice", "lower", g.integers([2]), g.integers([3]), g.integers([1]))  # (n, 1)
    upper = g.add("Slice", "upper", g.integers([2]), g.integers([3]), g.integers([1]))
    half = g.add("Mul", g.add("Sub", upper, lower), g.number(0.5))
    half = g.add("Unsqueeze", g.add("Max", half, g.number(1e-6)), g.integers([1]))  # (n, 1, 1)
    middle = g.add("Mul", g.add("Add", upper, lower), g.number(0.5))
    middle = g.add("Unsqueeze", middle, g.integers([1]))
    angle = g.angle(y, g.add("Add", x, g.number(1e-6)))
    turn = 2 * np.pi
    ahead = g.add("Add", g.add("Sub", angle, middle), g.number(turn / 2))
    turns = g.add("Floor", g.add("Div", ahead, g.number(turn)))
    offset = g.add("Sub", g.add("Sub", ahead, g.add("Mul", turns, g.number(turn))), g.number(turn / 2))
    inside = g.add("Min", g.add("Max", offset, g.add("Neg", half)), half)
    return g.add("Div", inside, half)
