"""The distilled network as an ONNX model, and its weights out of one.

The operators are those of `finlab.inference.fast_network`, in the same order.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from finlab.deploy.onnx.builder import Builder
from finlab.deploy.onnx.model import Model
from finlab.inference.fast_weights import FastWeights


def fast_model(weights: FastWeights, metadata: Mapping[str, str]) -> Model:
    """Node features in, shares of thrust out."""
    g = Builder()
    state = weights.state
    hidden = g.add("Relu", g.linear("features", state, "first."))
    for i in range(weights.rounds):
        mean = g.add("ReduceMean", hidden, axes=(1,), keepdims=1)
        everyone = g.add("MatMul", mean, g.weight(f"all.{i}.weight", state[f"all.{i}.weight"].T))
        heard = g.add("Relu", g.add("Add", g.linear(hidden, state, f"own.{i}."), everyone))
        hidden = g.add("Add", hidden, heard)
    last = g.add("Sigmoid", g.linear(hidden, state, "last."))
    g.add("Squeeze", last, g.integers([2]), name="share")
    return g.model(
        "finlab fast network",
        {"features": ("N", "n", state["first.weight"].shape[1])},
        {"share": ("N", "n")},
        metadata,
        "Node features of N targets on n fins in, the fourth root of each fin's thrust over its largest out.",
    )


def fast_weights(model: Model) -> FastWeights:
    """The distilled network out of a model that `fast_model` made."""
    state: dict[str, NDArray[np.float32]] = {
        key: array.T if array.ndim == 2 else array
        for key, array in model.weights.items()
        if array.dtype == np.float32
    }
    return FastWeights(state, sum(key.startswith("all.") for key in state))
