"""The learned fin physics as an ONNX model, and its weights out of one.

What `finlab.inference.learned_fin` computes for one fin, and the sum over the fins of a robot.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.deploy.onnx.builder import Builder
from finlab.deploy.onnx.model import Model

Weights = Mapping[str, NDArray[Any]]


def surrogate_model(
    weights: Weights, reference: tuple[float, float], unit: float, metadata: Mapping[str, str]
) -> Model:
    """Commands and geometry in, forces and wrenches out.

    Args:
        weights: state of a `coefficient` surrogate, `net.<i>.weight` (out, in) and `net.<i>.bias` (out,).
        reference: amplitude [rad] and frequency [Hz] at which the scale of the force is one.
        unit: force [N] of a coefficient of one.
        metadata: what to write beside the weights.
    """
    g = Builder()
    shaft, horizontal, vertical = add_fin(g, weights, reference, unit)
    _sum(g, shaft, horizontal, vertical)
    return g.model(
        "finlab surrogate",
        {"command": ("N", "n", 3), "position": ("n", 3), "mounting_angle": ("n",)},
        {"fin_force": ("N", "n", 3), "wrench": ("N", 6)},
        metadata,
        "Commands of n fins in; forces in their own frames [N] and the wrench [N, N m] of the robot out.",
    )


def add_fin(
    g: Builder, weights: Weights, reference: tuple[float, float], unit: float
) -> tuple[str, str, str]:
    """From the tensor `command` (N, n, 3) to `fin_force`, and its three parts (N, n, 1)."""
    parts = ("amplitude", "frequency", "direction")
    amplitude, frequency, direction = g.add_many(
        "Split", "command", g.integers([1, 1, 1]), names=parts, axis=-1
    )
    amplitude = g.add("Mul", amplitude, g.number(1.0 / reference[0]))
    frequency = g.add("Mul", frequency, g.number(1.0 / reference[1]))
    c, s = g.add("Cos", direction), g.add("Sin", direction)
    half = g.number(0.5)
    hidden = g.add("Concat", g.add("Sub", amplitude, half), g.add("Sub", frequency, half), c, s, axis=-1)
    layers = sorted({int(key.split(".")[1]) for key in weights})
    for i in layers[:-1]:
        hidden = g.add("Tanh", g.linear(hidden, weights, f"net.{i}."))
    coefficient = g.linear(hidden, weights, f"net.{layers[-1]}.")
    beat = g.add("Mul", amplitude, frequency)
    scale = g.add("Mul", g.add("Mul", beat, beat), g.number(unit))
    k = g.add("Mul", coefficient, scale)
    shaft, along, across = g.add_many(
        "Split", k, g.integers([1, 1, 1]), names=("shaft", "along", "across"), axis=-1
    )
    horizontal = g.add("Sub", g.add("Mul", c, along), g.add("Mul", s, across))
    vertical = g.add("Add", g.add("Mul", s, along), g.add("Mul", c, across))
    g.add("Concat", shaft, horizontal, vertical, axis=-1, name="fin_force")
    return shaft, horizontal, vertical


def surrogate_weights(model: Model) -> dict[str, NDArray[np.float32]]:
    """The surrogate's state by PyTorch's names, out of a model that `surrogate_model` made."""
    named = {key: array for key, array in model.weights.items() if key.startswith("net.")}
    return {key: array.T if array.ndim == 2 else array for key, array in named.items()}


def _sum(g: Builder, shaft: str, horizontal: str, vertical: str) -> None:
    """The output `wrench` of forces in the fins' own frames, each part (N, n, 1)."""
    angle = g.add("Unsqueeze", "mounting_angle", g.integers([1]))  # (n, 1)
    c, s = g.add("Cos", angle), g.add("Sin", angle)
    fx = g.add("Sub", g.add("Mul", shaft, c), g.add("Mul", horizontal, s))
    fy = g.add("Add", g.add("Mul", shaft, s), g.add("Mul", horizontal, c))
    x, y, z = g.add_many("Split", "position", g.integers([1, 1, 1]), names=("x", "y", "z"), axis=-1)
    tx = g.add("Sub", g.add("Mul", y, vertical), g.add("Mul", z, fy))
    ty = g.add("Sub", g.add("Mul", z, fx), g.add("Mul", x, vertical))
    tz = g.add("Sub", g.add("Mul", x, fy), g.add("Mul", y, fx))
    each = g.add("Concat", fx, fy, vertical, tx, ty, tz, axis=-1)  # (N, n, 6)
    g.add("ReduceSum", each, g.integers([1]), keepdims=0, name="wrench")
