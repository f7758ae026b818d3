"""Reading ONNX files strictly.

A model may hold what our exporter writes (plain operators, weights inside the file, tensors for inputs and
outputs) and nothing else. Weights in other files, subgraphs, functions and operators of other domains, all of
which could reach beyond the file, are refused.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.deploy.onnx.model import ATTRIBUTE_INTS, FLOAT, OPSET, TYPES, Attribute, Model, Node, Tensor
from finlab.deploy.onnx.wire import Value, fields, signed
from finlab.errors import DataError

MAX_BYTES = 64 * 2**20
"""Largest file that is read."""
_OPERATORS = """
Add Atan Concat Cos Div Elu Exp Floor GreaterOrEqual LayerNormalization LeakyRelu Less MatMul Max Min Mul Neg
ReduceMean ReduceSum Relu Reshape Sigmoid Sin Slice Softmax Split Squeeze Sub Tanh Transpose Unsqueeze Where
"""
OPERATORS = frozenset(_OPERATORS.split())
"""Operators that our models use; others are refused."""


def read_model(content: bytes, source: str = "model") -> Model:
    """The model in the bytes of an ONNX file.

    Raises:
        DataError: not a file that our exporter could have written; the sentence says what is foreign.
    """
    try:
        if len(content) > MAX_BYTES:
            raise DataError(f"is larger than {MAX_BYTES:,} bytes, too large for an allocator")
        return _model(memoryview(content))
    except DataError as error:
        raise DataError(f"{source}: {error}") from None


def _model(message: memoryview) -> Model:
    graph: memoryview | None = None
    metadata: dict[str, str] = {}
    description = ""
    for number, value in fields(message):
        if number == 7:
            if graph is not None:
                raise DataError("holds two graphs")
            graph = _bytes(value)
        elif number == 14:
            entry = dict(fields(_bytes(value)))
            metadata[_text(entry.get(1, 0))] = _text(entry.get(2, 0))
        elif number == 8:
            opset = dict(fields(_bytes(value)))
            if _text(opset.get(1, memoryview(b""))) or opset.get(2) != OPSET:
                raise DataError(f"asks for other operators than those of ONNX opset {OPSET}")
        elif number == 6:
            description = _text(value)
        elif number not in (1, 2):
            raise DataError(f"holds what a finlab model never does (model field {number})")
    if graph is None:
        raise DataError("is no ONNX file: it holds no graph")
    return _graph(graph, metadata, description)


def _graph(message: memoryview, metadata: dict[str, str], description: str) -> Model:
    name = ""
    nodes: list[Node] = []
    weights: dict[str, NDArray[Any]] = {}
    inputs: list[Tensor] = []
    outputs: list[Tensor] = []
    for number, value in fields(message):
        if number == 1:
            nodes.append(_node(_bytes(value)))
        elif number == 2:
            name = _text(value)
        elif number == 5:
            key, array = _weight(_bytes(value))
            if key in weights:
                raise DataError(f"holds the weight {key!r:.60} twice")
            weights[key] = array
        elif number in (11, 12):
            (inputs if number == 11 else outputs).append(_tensor(_bytes(value)))
        else:
            raise DataError(f"holds what a finlab model never does (graph field {number})")
    return Model(name, tuple(nodes), weights, tuple(inputs), tuple(outputs), metadata, description)


def _node(message: memoryview) -> Node:
    operator = ""
    inputs: list[str] = []
    outputs: list[str] = []
    attributes: dict[str, Attribute] = {}
    for number, value in fields(message):
        if number in (1, 2):
            (inputs if number == 1 else outputs).append(_text(value))
        elif number == 4:
            operator = _text(value)
        elif number == 5:
            attributes.update(_attribute(_bytes(value)))
        elif number != 3:
            raise DataError(f"holds an operator of a foreign kind (node field {number})")
    if operator not in OPERATORS:
        raise DataError(f"uses the operator {operator!r:.40}, which no finlab model needs")
    return Node(operator, tuple(inputs), tuple(outputs), attributes)


def _attribute(message: memoryview) -> Iterator[tuple[str, Attribute]]:
    name, kind = "", 0
    value: Attribute | None = None
    ints: list[int] = []
    for number, raw in fields(message):
        if number == 1:
            name = _text(raw)
        elif number == 2:
            value = float(struct.unpack("<f", _bytes(raw, 4))[0])
        elif number == 3:
            value = signed(_whole(raw))
        elif number == 8:
            ints.append(signed(_whole(raw)))
        elif number == 20:
            kind = _whole(raw)
        else:
            raise DataError("holds an operator with a subgraph or another foreign setting")
    if kind == ATTRIBUTE_INTS:
        value = tuple(ints)
    if value is None:
        raise DataError(f"holds an operator whose setting {name!r:.40} has no value")
    yield name, value


def _weight(message: memoryview) -> tuple[str, NDArray[Any]]:
    name, kind = "", 0
    dims: list[int] = []
    raw = memoryview(b"")
    for number, value in fields(message):
        if number == 1:
            dims.append(_whole(value))
        elif number == 2:
            kind = _whole(value)
        elif number == 8:
            name = _text(value)
        elif number == 9:
            raw = _bytes(value)
        elif number in (13, 14):
            raise DataError("keeps weights outside the file, which is refused: a bundle holds all it needs")
        else:
            raise DataError(f"holds a weight of a foreign kind (tensor field {number})")
    if kind not in TYPES:
        raise DataError(f"holds the weight {name!r:.60} of element type {kind}; expected float32 or int64")
    size = 1
    for dim in dims:
        size *= dim
    if len(dims) > 8 or size * TYPES[kind].itemsize != len(raw):
        raise DataError(f"holds the weight {name!r:.60} with {len(raw)} bytes, not what its shape asks for")
    array = np.frombuffer(raw, TYPES[kind]).reshape(dims)
    if not np.isfinite(array).all():
        raise DataError(f"holds the weight {name!r:.60} with a value that is not finite")
    return name, array


def _tensor(message: memoryview) -> Tensor:
    parts = dict(fields(message))
    kind = dict(fields(_bytes(parts.get(2, 0))))
    about = dict(fields(_bytes(kind.get(1, 0))))
    if about.get(1) != FLOAT:
        raise DataError("takes or answers something else than float32")
    shape: list[int | str] = []
    for _, dim in fields(_bytes(about.get(2, 0))):
        entry = dict(fields(_bytes(dim)))
        shape.append(_text(entry[2]) if 2 in entry else _whole(entry.get(1, memoryview(b""))))
    return Tensor(_text(parts.get(1, 0)), tuple(shape))


def _bytes(value: Value, size: int | None = None) -> memoryview:
    if isinstance(value, int) or (size is not None and len(value) != size):
        raise DataError("is no ONNX file: a field is of the wrong type")
    return value


def _whole(value: Value) -> int:
    if not isinstance(value, int):
        raise DataError("is no ONNX file: a field is of the wrong type")
    return value


def _text(value: Value) -> str:
    try:
        return bytes(_bytes(value)).decode()
    except UnicodeDecodeError:
        raise DataError("is no ONNX file: a name is not UTF-8 text") from None
