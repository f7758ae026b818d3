"""The distilled network in numpy. A test holds it against `FastNetwork`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.inference.activations import sigmoid
from finlab.inference.fast_weights import FastWeights

Array = NDArray[Any]


class NumpyFastNetwork:
    """Node features in, shares of thrust out."""

    def __init__(self, weights: FastWeights) -> None:
        """Take over a trained network."""
        state = {key: np.ascontiguousarray(value, dtype=np.float32) for key, value in weights.state.items()}

        def matrix(name: str) -> Array:
            return state[f"{name}.weight"].T.copy()

        self._first = (matrix("first"), state["first.bias"])
        self._rounds = [
            (matrix(f"own.{i}"), state[f"own.{i}.bias"], matrix(f"all.{i}")) for i in range(weights.rounds)
        ]
        self._last = (matrix("last")[:, 0].copy(), state["last.bias"])

    def __call__(self, x: Array) -> Array:
        """Fourth root (N, n) of thrust over largest thrust, for features (N, n, F) in single precision."""
        rows, n, _ = x.shape
        hidden = x.reshape(rows * n, -1) @ self._first[0]
        hidden += self._first[1]
        np.maximum(hidden, 0, out=hidden)
        each = np.full((1, n), 1.0 / n, dtype=np.float32)
        for own, bias, everyone in self._rounds:
            mean = (each @ hidden.reshape(rows, n, -1)) @ everyone
            mean += bias
            heard = (hidden @ own).reshape(rows, n, -1)
            heard += mean
            np.maximum(heard, 0, out=heard)
            hidden = hidden + heard.reshape(rows * n, -1)
        return sigmoid((hidden @ self._last[0] + self._last[1]).reshape(rows, n))
