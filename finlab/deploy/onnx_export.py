"""The trained networks as ONNX files, for other people's runtimes: `finlab export LAYOUT -o DIR --onnx`.

Needs the package `onnx` (extra `onnx`). The operators are those of `finlab.inference`, in the same order;
batch and number of fins are free. A test holds the files against the numpy networks in onnxruntime.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import finlab
from finlab.deploy.onnx_graph import GraphBuilder
from finlab.errors import CheckpointError, DataError
from finlab.inference.features import raw_features
from finlab.inference.force_network import LEAK, LOG_STD
from finlab.inference.layers import names_of_layers
from finlab.inference.mixture import LOG_STD_BOUND
from finlab.inference.surrogate import FORCE_UNIT
from finlab.inference.weights import State, TrainedWeights

if TYPE_CHECKING:
    from onnx import ModelProto

NETWORK, SURROGATE = "network.onnx", "surrogate.onnx"


def onnx_files(weights: TrainedWeights) -> dict[str, bytes]:
    """The networks of a checkpoint, of method `mdn` or `paper`, as ONNX files by name.

    Raises:
        DataError: the package `onnx` is not installed.
        CheckpointError: there is no network, or it is of another kind.
    """
    try:
        import onnx  # noqa: F401 (an extra)
    except ImportError:
        raise DataError("the package onnx is not installed; pip install 'finlab[onnx]'") from None
    sizes = weights.network_config
    if sizes is None or sizes.features not in NETWORKS:
        raise CheckpointError(
            f"checkpoint {weights.name!r}: only the networks of the methods `mdn` and `paper` have an export"
        )
    mean, std = weights.normalization
    about = {
        "finlab": finlab.__version__,
        "checkpoint": weights.name,
        "checkpoint_sha256": weights.sha256,
        "features": sizes.features,
        "fin_model": json.dumps(dict(weights.fin_model), sort_keys=True),
        "wrench_mean": json.dumps(mean.tolist()),
        "wrench_std": json.dumps(std.tolist()),
        "frame": "FLU, origin at the centre of gravity; wrench [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m",
        "command": "amplitude [rad], frequency [Hz], zero direction [rad]",
    }
    models = {NETWORK: NETWORKS[sizes.features](weights.network, sizes)}
    if weights.surrogate:
        models[SURROGATE] = _surrogate(weights.surrogate)
    for model in models.values():
        for key, value in about.items():
            model.metadata_props.add(key=key, value=value)
    return {name: model.SerializeToString(deterministic=True) for name, model in models.items()}


def write_onnx(weights: TrainedWeights, folder: Path) -> list[str]:
    """Write the ONNX files into a folder, which is made; returns their names. Errors as in `onnx_files`."""
    files = onnx_files(weights)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            (folder / name).write_bytes(content)
    except OSError as error:
        raise DataError(f"{error.filename or folder}: cannot be written: {error.strerror}") from None
    return list(files)


def _paper_network(state: State, sizes: Any) -> ModelProto:
    """Raw features of the fins and normalized, centred target in; a mixture over each fin's command,
    normalized between its limits, out."""
    g, width, heads, m = GraphBuilder(state), sizes.width, sizes.heads, sizes.n_components
    hidden = g.linear("features", "enter")
    for i in range(sizes.graph_layers):
        hidden = g("Add", hidden, g("Elu", _attend(g, hidden, f"graph.{i}", heads, width)))
    wrench = g.linear("target", "wrench")
    # The layer that sees fins and wrench side by side, as a sum of two products.
    of_fins, of_wrench = g.parts(g.weight("join.weight"), width, width, axis=0)
    wrench = g("Add", g("MatMul", wrench, of_wrench), g.weight("join.bias"))
    hidden = g("Add", g("MatMul", hidden, of_fins), g("Unsqueeze", wrench, g.whole(1)))
    for i in range(sizes.transformer_layers):
        hidden = _transform(g, hidden, f"transformer.layers.{i}", heads, width)
    hidden = g.norm(hidden, "norm")
    raw = g("Reshape", g.linear(hidden, "head"), g.whole(0, 0, m, 6))
    mean, spread = g.parts(raw, 3, 3)
    g("Identity", mean, name="mean")
    scaled = g("Mul", g("Sigmoid", spread), g.constant(2 * LOG_STD_BOUND))
    g("Exp", g("Sub", scaled, g.constant(LOG_STD_BOUND)), name="std")
    g("Softmax", g.linear(hidden, "weight"), axis=-1, name="weight")
    n_features = state["enter.weight"].shape[1]
    return g.model(
        "finlab network of method paper",
        {"features": ("N", "n", n_features), "target": ("N", 6)},
        {"weight": ("N", "n", m), "mean": ("N", "n", m, 3), "std": ("N", "n", m, 3)},
    )


def _attend(g: GraphBuilder, x: str, name: str, heads: int, width: int) -> str:
    """One dense GATv2 layer: (N, n, F) to (N, n, width)."""
    source, target = g.linear(x, f"{name}.source"), g.linear(x, f"{name}.target")
    pair = g("Add", g("Unsqueeze", source, g.whole(1)), g("Unsqueeze", target, g.whole(2)))
    score = g("MatMul", g("LeakyRelu", pair, alpha=LEAK), g.attention(f"{name}.attention"))
    share = g("Softmax", g("Transpose", score, perm=[0, 3, 1, 2]), axis=-1)  # (N, heads, i, j)
    seen = g.join_heads(g("MatMul", share, g.split_heads(source, heads, width)), width)
    return g("Add", seen, g.weight(f"{name}.bias"))


def _transform(g: GraphBuilder, x: str, name: str, heads: int, width: int) -> str:
    """One Transformer encoder layer, normalization first, ReLU."""
    both = g.linear(g.norm(x, f"{name}.norm1"), f"{name}.self_attn.in_proj", "_")
    query, key, value = (g.split_heads(part, heads, width) for part in g.parts(both, width, width, width))
    score = g("MatMul", query, g("Transpose", key, perm=[0, 1, 3, 2]))
    share = g("Softmax", g("Mul", score, g.constant((width // heads) ** -0.5)), axis=-1)
    seen = g.join_heads(g("MatMul", share, value), width)
    x = g("Add", x, g.linear(seen, f"{name}.self_attn.out_proj"))
    up = g("Relu", g.linear(g.norm(x, f"{name}.norm2"), f"{name}.linear1"))
    return g("Add", x, g.linear(up, f"{name}.linear2"))


def _force_network(state: State, sizes: Any) -> ModelProto:
    """Features of fins and of pairs of fins in; a joint mixture over the planar forces of all fins out."""
    g, m = GraphBuilder(state), sizes.n_components
    hidden = g.linear("nodes", "enter")
    for i in range(sizes.layers):
        hidden = _look(g, hidden, f"layers.{i}", sizes.heads, sizes.width)
    hidden = g.norm(hidden, "norm")
    raw = g("Transpose", g("Reshape", g.linear(hidden, "head"), g.whole(0, 0, m, 3)), perm=[0, 2, 1, 3])
    mean, spread = g.parts(raw, 2, 1)
    g("Identity", mean, name="mean")
    middle, half = LOG_STD
    log_std = g("Add", g("Mul", g("Tanh", spread), g.constant(half)), g.constant(middle))
    g("Squeeze", g("Exp", log_std), g.whole(3), name="std")
    pooled = g("ReduceMean", hidden, axes=[1], keepdims=0)
    g("Softmax", g.linear(pooled, "weight"), axis=-1, name="weight")
    node, pair = state["enter.weight"].shape[1], state["layers.0.look.pair.weight"].shape[1]
    return g.model(
        "finlab network of method mdn",
        {"nodes": ("N", "n", node), "pairs": ("N", "n", "n", pair)},
        {"weight": ("N", m), "mean": ("N", m, "n", 2), "std": ("N", m, "n")},
    )


def _look(g: GraphBuilder, x: str, name: str, heads: int, width: int) -> str:
    """One Transformer layer whose attention is GATv2's with features of pairs; what scores is the message."""
    seen = g.norm(x, f"{name}.norm1")
    source = g("Unsqueeze", g.linear(seen, f"{name}.look.source"), g.whole(1))
    target = g("Unsqueeze", g("MatMul", seen, g.weight(f"{name}.look.target.weight")), g.whole(2))
    both = g("Add", g("MatMul", "pairs", g.weight(f"{name}.look.pair.weight")), g("Add", source, target))
    pair = g("LeakyRelu", both, alpha=LEAK)  # (N, i, j, width)
    score = g("MatMul", pair, g.attention(f"{name}.look.attention"))
    share = g("Unsqueeze", g("Softmax", score, axis=2), g.whole(4))
    split = g("Reshape", pair, g.whole(0, 0, 0, heads, width // heads))
    message = g("ReduceSum", g("Mul", share, split), g.whole(2), keepdims=0)
    x = g("Add", x, g.linear(g("Reshape", message, g.whole(0, 0, width)), f"{name}.look.out"))
    up = g("Relu", g.linear(g.norm(x, f"{name}.norm2"), f"{name}.up"))
    return g("Add", x, g.linear(up, f"{name}.down"))


NETWORKS: dict[str, Callable[[State, Any], ModelProto]] = {"raw": _paper_network, "forces": _force_network}
"""By what a network is fed."""


def _surrogate(state: State) -> ModelProto:
    """Commands and geometry in; forces of the fins in the body frame, and the robot's wrench out."""
    g = GraphBuilder(state)
    # Each raw feature is proportional to one number of the fin.
    ones = np.ones((1, 3))
    scale = raw_features(ones, ones[:, 0], ones, ones)[0]
    ends = (g("Unsqueeze", end, g.whole(2)) for end in ("lower", "upper"))
    limits = g("Reshape", g("Concat", *ends, axis=2), g.whole(0, 6))
    numbers = g("Concat", "position", g("Unsqueeze", "mounting_angle", g.whole(1)), limits, axis=-1)
    features = g("Mul", numbers, g.constant(scale))
    half = g("Mul", g("Sub", "upper", "lower"), g.constant(0.5))
    command = g("Sub", g("Sub", "command", "lower"), half)
    command = g("Div", command, g("Max", half, g.constant(1e-9)))
    # The first layer, that sees features and command side by side, as a sum of two products.
    of_fin, of_command = g.parts(g.weight("net.0.weight"), 10, 3, axis=0)
    fixed = g("Add", g("MatMul", features, of_fin), g.weight("net.0.bias"))
    hidden = g("Add", g("MatMul", command, of_command), fixed)
    for name in names_of_layers(state, "net")[1:]:
        hidden = g.linear(g.silu(hidden), name)
    force = g("Mul", hidden, g.constant(FORCE_UNIT), name="fin_force")
    x, y, z = g.parts("position", 1, 1, 1)
    fx, fy, fz = g.parts(force, 1, 1, 1)
    tx = g("Sub", g("Mul", y, fz), g("Mul", z, fy))
    ty = g("Sub", g("Mul", z, fx), g("Mul", x, fz))
    tz = g("Sub", g("Mul", x, fy), g("Mul", y, fx))
    total = g("ReduceSum", g("Concat", fx, fy, fz, tx, ty, tz, axis=-1), g.whole(1), keepdims=0)
    pooled = g("ReduceMean", g("Tanh", g.linear(features, "descriptor.0")), axes=[0], keepdims=1)
    stretch, bias = g.parts(g.linear(pooled, "affine"), 6, 6)
    g("Add", g("Mul", total, g("Add", stretch, g.constant(1.0))), bias, name="wrench")
    limits_ = {"lower": ("n", 3), "upper": ("n", 3)}
    return g.model(
        "finlab surrogate of method paper",
        {"command": ("N", "n", 3), "position": ("n", 3), "mounting_angle": ("n",), **limits_},
        {"fin_force": ("N", "n", 3), "wrench": ("N", 6)},
    )
