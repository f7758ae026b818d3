"""Builds ONNX models operator by operator, and the blocks that the networks are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from finlab.arrays import AnyArray
from finlab.inference.layers import head_scores
from finlab.inference.weights import State

if TYPE_CHECKING:
    from onnx import ModelProto

OPSET = 17
"""Version of the operators; the first with LayerNormalization."""
IR_VERSION = 8
"""Version of the file format; old enough for every runtime since 2022."""

Shapes = Mapping[str, Sequence[int | str]]
"""Tensors by name; a name among the sizes where the size is free."""


class GraphBuilder:
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

        array: AnyArray = np.ascontiguousarray(value, dtype=dtype)
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

    def silu(self, x: str) -> str:
        return self("Mul", x, self("Sigmoid", x))

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

    def attention(self, name: str) -> str:
        """Attention vectors in block form (width, heads)."""
        return self.constant(head_scores(self.state[name]), name)

    def model(self, name: str, inputs: Shapes, outputs: Shapes) -> ModelProto:
        from onnx import TensorProto, helper

        taken, given = (
            [helper.make_tensor_value_info(key, TensorProto.FLOAT, shape) for key, shape in end.items()]
            for end in (inputs, outputs)
        )
        graph = helper.make_graph(self._nodes, name, taken, given, initializer=list(self._constants.values()))
        opset = helper.make_opsetid("", OPSET)
        return helper.make_model(graph, opset_imports=[opset], ir_version=IR_VERSION, producer_name="finlab")
