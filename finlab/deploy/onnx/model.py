"""An ONNX model as a value, and the bytes of its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.deploy.onnx.wire import block, integer, single

IR_VERSION = 8
"""Version of the file format; old enough for every runtime since 2022."""
OPSET = 17
"""Version of the operators; the first with LayerNormalization."""
PRODUCER = "finlab"

FLOAT = 1
"""ONNX's number for float32."""
TYPES: dict[int, np.dtype[Any]] = {FLOAT: np.dtype("<f4"), 7: np.dtype("<i8")}
"""Types of weights by ONNX's numbers: float32 and int64."""
_ATTRIBUTE_FLOAT, _ATTRIBUTE_INT, ATTRIBUTE_INTS = 1, 2, 7

Attribute = float | int | tuple[int, ...]


@dataclass(frozen=True)
class Node:
    """One operator."""

    operator: str
    """Its name in ONNX."""
    inputs: tuple[str, ...]
    """Names of the tensors it takes; empty for one left out."""
    outputs: tuple[str, ...]
    """Names of the tensors it makes."""
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    """Its settings."""


@dataclass(frozen=True)
class Tensor:
    """An input or output in single precision."""

    name: str
    """What it is called."""
    shape: tuple[int | str, ...]
    """Sizes; a name where the size is free."""


@dataclass(frozen=True)
class Model:
    """A network or any other function of tensors."""

    name: str
    """What it is."""
    nodes: tuple[Node, ...]
    """Operators, in the order in which they run."""
    weights: Mapping[str, NDArray[Any]]
    """Constants by name, float32 or int64."""
    inputs: tuple[Tensor, ...]
    """What it takes."""
    outputs: tuple[Tensor, ...]
    """What it answers."""
    metadata: Mapping[str, str] = field(default_factory=dict)
    """What there is to know about it."""
    description: str = ""
    """A sentence for people."""


def model_bytes(model: Model) -> bytes:
    """The contents of the ONNX file; the same model gives the same bytes."""
    graph = b"".join(block(1, _node_bytes(node, i)) for i, node in enumerate(model.nodes))
    graph += block(2, model.name)
    graph += b"".join(block(5, _weight_bytes(name, array)) for name, array in model.weights.items())
    graph += b"".join(block(11, _tensor_bytes(tensor)) for tensor in model.inputs)
    graph += b"".join(block(12, _tensor_bytes(tensor)) for tensor in model.outputs)
    parts = [integer(1, IR_VERSION), block(2, PRODUCER)]
    if model.description:
        parts.append(block(6, model.description))
    parts += [block(7, graph), block(8, block(1, "") + integer(2, OPSET))]
    parts += [block(14, block(1, key) + block(2, model.metadata[key])) for key in sorted(model.metadata)]
    return b"".join(parts)


def _node_bytes(node: Node, index: int) -> bytes:
    parts = [block(1, name) for name in node.inputs] + [block(2, name) for name in node.outputs]
    parts += [block(3, f"{index}_{node.operator}"), block(4, node.operator)]
    for name, value in sorted(node.attributes.items()):
        if isinstance(value, float):
            body = block(1, name) + single(2, value) + integer(20, _ATTRIBUTE_FLOAT)
        elif isinstance(value, int):
            body = block(1, name) + integer(3, value) + integer(20, _ATTRIBUTE_INT)
        else:
            ints = b"".join(integer(8, item) for item in value)
            body = block(1, name) + ints + integer(20, ATTRIBUTE_INTS)
        parts.append(block(5, body))
    return b"".join(parts)


def _weight_bytes(name: str, array: NDArray[Any]) -> bytes:
    kind = next(k for k, dtype in TYPES.items() if dtype == array.dtype.newbyteorder("<"))
    dims = b"".join(integer(1, size) for size in array.shape)
    raw = np.ascontiguousarray(array, dtype=TYPES[kind]).tobytes()
    return dims + integer(2, kind) + block(8, name) + block(9, raw)


def _tensor_bytes(tensor: Tensor) -> bytes:
    dims = b"".join(
        block(1, block(2, size) if isinstance(size, str) else integer(1, size)) for size in tensor.shape
    )
    kind = block(1, integer(1, FLOAT) + block(2, dims))
    return block(1, tensor.name) + block(2, kind)
