"""The trained networks as ONNX files, for other people's runtimes: `finlab export LAYOUT -o DIR --onnx`.

Needs the package `onnx` (extra `onnx`). The operators are those of `finlab.inference`, in the same order;
batch and number of fins are free. A test holds the files against the numpy networks in onnxruntime.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import finlab
from finlab.errors import CheckpointError, DataError
from finlab.inference.fast_network import FastWeights
from finlab.inference.learned_fin import FORCE_UNIT, REFERENCE
from finlab.inference.mixture import LOG_STD_BOUND
from finlab.inference.weights import NetworkConfig, State, TrainedWeights

if TYPE_CHECKING:
    from onnx import ModelProto

OPSET = 17
"""Version of the operators; the first with LayerNormalization."""
IR_VERSION = 8
"""Version of the file format; old enough for every runtime since 2022."""
NETWORK, SURROGATE, FAST = "network.onnx", "surrogate.onnx", "fast.onnx"

Shapes = Mapping[str, Sequence[int | str]]
"""Tensors by name; a name among the sizes where the size is free."""


def onnx_files(weights: TrainedWeights) -> dict[str, bytes]:
    """The networks of a checkpoint that method `learned` works with, as ONNX files by name.

    Raises:
        DataError: the package `onnx` is not installed.
        CheckpointError: the networks are of another kind.
    """
    try:
        import onnx  # noqa: F401 (an extra)
    except ImportError:
        raise DataError("the package onnx is not installed; pip install 'finlab[onnx]'") from None
    sizes = weights.check_network()
    if not sizes.joint or weights.surrogate_config.kind != "coefficient":
        raise CheckpointError(
            f"checkpoint {weights.name!r}: only the networks of method `learned` have an export"
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
    models = {NETWORK: _network(weights.network, sizes), SURROGATE: _surrogate(weights.surrogate)}
    if weights.fast is not None:
        models[FAST] = _fast(weights.fast)
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


class _Graph:
    """A model in the making: each method adds operators and answers the name of the tensor that they make."""

    def __init__(self, state: State) -> None:
        self._nodes: list[Any] = []
        self._constants: dict[str, Any] = {}
        self.state = state

    def __call__(self, operator: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        from onnx import helper

        name = name or f"t{len(self._nodes)}"
        self._nodes.append(helper.make_node(operator, inputs, [name], **attributes))
        return name

    def parts(self, x: str, *sizes: int, axis: int = -1) -> list[str]:
        """A tensor cut into parts of these sizes along an axis."""
        from onnx import helper

        names = [f"t{len(self._nodes)}_{k}" for k in range(len(sizes))]
        self._nodes.append(helper.make_node("Split", [x, self.whole(*sizes)], names, axis=axis))
        return names

    def constant(self, value: Any, name: str = "", dtype: type[Any] = np.float32) -> str:
        from onnx import numpy_helper

        array: NDArray[Any] = np.ascontiguousarray(value, dtype=dtype)
        array = array.reshape(np.shape(value))
        name = name or f"{array.dtype} {array.tolist()}"
        self._constants[name] = numpy_helper.from_array(array, name)
        return name

    def whole(self, *values: int) -> str:
        """Whole numbers, as shapes and axes are given."""
        return self.constant(values, dtype=np.int64)

    def weight(self, name: str) -> str:
        """An array of the network; matrices are turned, so that (..., in) times (in, out) runs as it is."""
        array = self.state[name]
        return self.constant(array.T if array.ndim == 2 else array, name)

    def linear(self, x: str, name: str, separator: str = ".") -> str:
        product = self("MatMul", x, self.weight(f"{name}{separator}weight"))
        return self("Add", product, self.weight(f"{name}{separator}bias"))

    def norm(self, x: str, name: str) -> str:
        scale, shift = self.weight(f"{name}.weight"), self.weight(f"{name}.bias")
        return self("LayerNormalization", x, scale, shift, axis=-1, epsilon=1e-5)

    def split_heads(self, x: str, heads: int, width: int) -> str:
        """Tensors (N, n, width) as (N, heads, n, width / heads)."""
        split = self("Reshape", x, self.whole(0, 0, heads, width // heads))
        return self("Transpose", split, perm=[0, 2, 1, 3])

    def join_heads(self, x: str, width: int) -> str:
        """The way back."""
        return self("Reshape", self("Transpose", x, perm=[0, 2, 1, 3]), self.whole(0, 0, width))

    def angle(self, y: str, x: str) -> str:
        """The angle atan2(y, x) [rad], which ONNX lacks; x is never exactly zero here."""
        turn = self("Where", self("Less", y, self.constant(0.0)), self.constant(-np.pi), self.constant(np.pi))
        behind = self("Where", self("Less", x, self.constant(0.0)), turn, self.constant(0.0))
        return self("Add", self("Atan", self("Div", y, x)), behind)

    def model(self, name: str, inputs: Shapes, outputs: Shapes) -> ModelProto:
        from onnx import TensorProto, helper

        taken, given = (
            [helper.make_tensor_value_info(key, TensorProto.FLOAT, shape) for key, shape in end.items()]
            for end in (inputs, outputs)
        )
        graph = helper.make_graph(self._nodes, name, taken, given, initializer=list(self._constants.values()))
        opset = helper.make_opsetid("", OPSET)
        return helper.make_model(graph, opset_imports=[opset], ir_version=IR_VERSION, producer_name="finlab")


def _network(state: State, sizes: NetworkConfig) -> ModelProto:
    """Features, normalized and centred target, and limits in; mixture over normalized commands out."""
    g, width, heads, m = _Graph(state), sizes.width, sizes.heads, sizes.n_components
    hidden = "features"
    for i in range(sizes.graph_layers):
        hidden = g("Elu", _attend(g, hidden, f"graph.{i}", heads, width))
    hidden = g("Add", hidden, g.linear("features", "skip"))
    wrench = g.linear("target", "wrench.0")
    wrench = g.linear(g("Mul", wrench, g("Sigmoid", wrench)), "wrench.2")
    # The layer that sees fins and wrench side by side, as a sum of two products.
    of_fins, of_wrench = g.parts(g.weight("join.weight"), width, width, axis=0)
    wrench = g("Add", g("MatMul", wrench, of_wrench), g.weight("join.bias"))
    hidden = g("Add", g("MatMul", hidden, of_fins), g("Unsqueeze", wrench, g.whole(1)))
    for i in range(sizes.transformer_layers):
        hidden = _transform(g, hidden, f"transformer.layers.{i}", heads, width)
    hidden = g.norm(hidden, "norm")
    raw = g("Reshape", g.linear(hidden, "head"), g.whole(0, 0, m, 7))
    beat, x, y, spread = g.parts(raw, 2, 1, 1, 3)
    direction = _direction(g, x, y)
    g("Concat", g("Tanh", beat), direction, axis=-1, name="mean")
    scaled = g("Mul", g("Sigmoid", spread), g.constant(2 * LOG_STD_BOUND))
    g("Exp", g("Sub", scaled, g.constant(LOG_STD_BOUND)), name="std")
    pooled = g("ReduceMean", hidden, axes=[1], keepdims=0)
    g("Softmax", g.linear(pooled, "weight"), axis=-1, name="weight")
    n_features = state["skip.weight"].shape[1]
    ends = {"lower": ("n", 3), "upper": ("n", 3)}
    return g.model(
        "finlab allocator network",
        {"features": ("N", "n", n_features), "target": ("N", 6), **ends},
        {"weight": ("N", m), "mean": ("N", "n", m, 3), "std": ("N", "n", m, 3)},
    )


def _attend(g: _Graph, x: str, name: str, heads: int, width: int) -> str:
    """One dense GATv2 layer: (N, n, F) to (N, n, width)."""
    source, target = g.linear(x, f"{name}.source"), g.linear(x, f"{name}.target")
    pair = g("Add", g("Unsqueeze", source, g.whole(1)), g("Unsqueeze", target, g.whole(2)))
    # The attention vectors in block form, so that one product scores all heads.
    attention = g.state[f"{name}.attention"]
    block = np.repeat(np.eye(heads), width // heads, axis=0) * attention.reshape(-1, 1)
    score = g("MatMul", g("LeakyRelu", pair, alpha=0.2), g.constant(block, f"{name}.attention"))
    share = g("Softmax", g("Transpose", score, perm=[0, 3, 1, 2]), axis=-1)  # (N, heads, i, j)
    seen = g.join_heads(g("MatMul", share, g.split_heads(source, heads, width)), width)
    return g("Add", seen, g.weight(f"{name}.bias"))


def _transform(g: _Graph, x: str, name: str, heads: int, width: int) -> str:
    """One Transformer encoder layer, normalization first, ReLU."""
    both = g.linear(g.norm(x, f"{name}.norm1"), f"{name}.self_attn.in_proj", "_")
    query, key, value = (g.split_heads(part, heads, width) for part in g.parts(both, width, width, width))
    score = g("MatMul", query, g("Transpose", key, perm=[0, 1, 3, 2]))
    share = g("Softmax", g("Mul", score, g.constant((width // heads) ** -0.5)), axis=-1)
    seen = g.join_heads(g("MatMul", share, value), width)
    x = g("Add", x, g.linear(seen, f"{name}.self_attn.out_proj"))
    up = g("Relu", g.linear(g.norm(x, f"{name}.norm2"), f"{name}.linear1"))
    return g("Add", x, g.linear(up, f"{name}.linear2"))


def _direction(g: _Graph, x: str, y: str) -> str:
    """Normalized zero directions (N, n, M, 1) of vectors in the fins' thrust planes."""
    low, high = (
        g("Reshape", g("Slice", end, g.whole(2), g.whole(3), g.whole(1)), g.whole(1, -1, 1, 1))
        for end in ("lower", "upper")
    )
    middle = g("Mul", g("Add", high, low), g.constant(0.5))
    half = g("Max", g("Mul", g("Sub", high, low), g.constant(0.5)), g.constant(1e-6))
    # The angle from the middle of the arc, brought within half a turn of it.
    turn = g.constant(2 * np.pi)
    offset = g("Sub", g.angle(y, g("Add", x, g.constant(1e-6))), middle)
    ahead = g("Add", offset, g.constant(np.pi))
    turns = g("Floor", g("Div", ahead, turn))
    offset = g("Sub", g("Sub", ahead, g("Mul", turns, turn)), g.constant(np.pi))
    return g("Div", g("Min", g("Max", offset, g("Neg", half)), half), half)


def _surrogate(state: State) -> ModelProto:
    """Commands and geometry in; forces of the fins in their own frames, and the robot's wrench out."""
    g = _Graph(state)
    amplitude, frequency, direction = g.parts("command", 1, 1, 1)
    amplitude = g("Div", amplitude, g.constant(REFERENCE[0]))
    frequency = g("Div", frequency, g.constant(REFERENCE[1]))
    c, s, half = g("Cos", direction), g("Sin", direction), g.constant(0.5)
    hidden = g("Concat", g("Sub", amplitude, half), g("Sub", frequency, half), c, s, axis=-1)
    layers = sorted({int(key.split(".")[1]) for key in state})
    for i in layers[:-1]:
        hidden = g("Tanh", g.linear(hidden, f"net.{i}"))
    beat = g("Mul", amplitude, frequency)
    scale = g("Mul", g("Mul", beat, beat), g.constant(FORCE_UNIT))
    k = g("Mul", g.linear(hidden, f"net.{layers[-1]}"), scale)
    shaft, along, across = g.parts(k, 1, 1, 1)
    horizontal = g("Sub", g("Mul", c, along), g("Mul", s, across))
    vertical = g("Add", g("Mul", s, along), g("Mul", c, across))
    g("Concat", shaft, horizontal, vertical, axis=-1, name="fin_force")
    angle = g("Unsqueeze", "mounting_angle", g.whole(1))
    c, s = g("Cos", angle), g("Sin", angle)
    fx = g("Sub", g("Mul", shaft, c), g("Mul", horizontal, s))
    fy = g("Add", g("Mul", shaft, s), g("Mul", horizontal, c))
    x, y, z = g.parts("position", 1, 1, 1)
    tx = g("Sub", g("Mul", y, vertical), g("Mul", z, fy))
    ty = g("Sub", g("Mul", z, fx), g("Mul", x, vertical))
    tz = g("Sub", g("Mul", x, fy), g("Mul", y, fx))
    each = g("Concat", fx, fy, vertical, tx, ty, tz, axis=-1)
    g("ReduceSum", each, g.whole(1), keepdims=0, name="wrench")
    return g.model(
        "finlab surrogate",
        {"command": ("N", "n", 3), "position": ("n", 3), "mounting_angle": ("n",)},
        {"fin_force": ("N", "n", 3), "wrench": ("N", 6)},
    )


def _fast(fast: FastWeights) -> ModelProto:
    """Node features in, the fourth root of each fin's thrust over its largest out."""
    g = _Graph(fast.state)
    hidden = g("Relu", g.linear("features", "first"))
    for i in range(fast.rounds):
        mean = g("ReduceMean", hidden, axes=[1], keepdims=1)
        everyone = g("MatMul", mean, g.weight(f"all.{i}.weight"))
        hidden = g("Add", hidden, g("Relu", g("Add", g.linear(hidden, f"own.{i}"), everyone)))
    share = g("Sigmoid", g.linear(hidden, "last"))
    g("Squeeze", share, g.whole(2), name="share")
    n_features = fast.state["first.weight"].shape[1]
    return g.model("finlab fast network", {"features": ("N", "n", n_features)}, {"share": ("N", "n")})
