"""Writing a network down, operator by operator.

Each method adds operators and answers the name of the tensor that they make, so that the calls read like the
network's own code.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.deploy.onnx.model import Attribute, Model, Node, Tensor


class Builder:
    """A model in the making."""

    def __init__(self) -> None:
        self._nodes: list[Node] = []
        self._weights: dict[str, NDArray[Any]] = {}

    def add(self, operator: str, *inputs: str, name: str = "", **attributes: Attribute) -> str:
        """Add an operator with one output; `name` names the output."""
        return self.add_many(operator, *inputs, names=(name or f"t{len(self._nodes)}",), **attributes)[0]

    def add_many(
        self, operator: str, *inputs: str, names: Sequence[str], **attributes: Attribute
    ) -> tuple[str, ...]:
        """Add an operator with the outputs `names`."""
        self._nodes.append(Node(operator, inputs, tuple(names), attributes))
        return tuple(names)

    def weight(self, name: str, value: NDArray[np.floating]) -> str:
        """A named weight in single precision."""
        self._weights[name] = np.ascontiguousarray(value, dtype=np.float32)
        return name

    def number(self, value: float) -> str:
        """A constant in single precision."""
        return self.weight(f"number {float(np.float32(value))!r}", np.array(value))

    def integers(self, value: ArrayLike) -> str:
        """Constant whole numbers, as shapes and axes are given."""
        array = np.array(value, dtype=np.int64)
        name = f"integers {array.tolist()}"
        self._weights[name] = array
        return name

    def linear(self, x: str, weights: Mapping[str, NDArray[np.floating]], name: str) -> str:
        """A linear layer with PyTorch's `<name>weight` (out, in) and `<name>bias`, on tensors (..., in)."""
        # Turned here once: a product of (..., in) and (in, out) runs as it is.
        matrix = self.weight(f"{name}weight", weights[f"{name}weight"].T)
        return self.add(
            "Add", self.add("MatMul", x, matrix), self.weight(f"{name}bias", weights[f"{name}bias"])
        )

    def layer_norm(self, x: str, weights: Mapping[str, NDArray[np.floating]], name: str) -> str:
        """Layer normalization over the last axis."""
        scale, shift = (
            self.weight(f"{name}.{part}", weights[f"{name}.{part}"]) for part in ("weight", "bias")
        )
        return self.add("LayerNormalization", x, scale, shift, axis=-1, epsilon=1e-5)

    def split_heads(self, x: str, heads: int, width: int) -> str:
        """Tensors (N, n, heads * width) as (N, heads, n, width)."""
        split = self.add("Reshape", x, self.integers([0, 0, heads, width]))
        return self.add("Transpose", split, perm=(0, 2, 1, 3))

    def join_heads(self, x: str, total: int) -> str:
        """Tensors (N, heads, n, width) as (N, n, total)."""
        back = self.add("Transpose", x, perm=(0, 2, 1, 3))
        return self.add("Reshape", back, self.integers([0, 0, total]))

    def angle(self, y: str, x: str) -> str:
        """The angle atan2(y, x) [rad], which ONNX lacks; x is never exactly zero here."""
        slope = self.add("Atan", self.add("Div", y, x))
        up = self.add("GreaterOrEqual", y, self.number(0.0))
        turn = self.add("Where", up, self.number(np.pi), self.number(-np.pi))
        behind = self.add("Less", x, self.number(0.0))
        return self.add("Add", slope, self.add("Where", behind, turn, self.number(0.0)))

    def model(
        self,
        name: str,
        inputs: Mapping[str, tuple[int | str, ...]],
        outputs: Mapping[str, tuple[int | str, ...]],
        metadata: Mapping[str, str],
        description: str,
    ) -> Model:
        """The finished model, with the shapes of what it takes and answers."""
        return Model(
            name,
            tuple(self._nodes),
            self._weights,
            tuple(Tensor(key, shape) for key, shape in inputs.items()),
            tuple(Tensor(key, shape) for key, shape in outputs.items()),
            metadata,
            description,
        )
