"""The learned fin in numpy: force and closed-form Jacobian of `finlab.model.surrogate.CoefficientSurrogate`.

Refinement runs on a few hundred rows at a time, where numpy's small overhead per operation beats a
tensor library's, and a robot's computer needs no such library.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


class LearnedFin:
    """Force of one fin in its own frame (shaft, e_h, e_z) by the learned force coefficients."""

    def __init__(self, weights: Mapping[str, Array], reference: tuple[float, float], unit: float) -> None:
        """Take over a trained surrogate.

        Args:
            weights: state of the perceptron, `net.<i>.weight` (out, in) and `net.<i>.bias` (out,).
            reference: amplitude [rad] and frequency [Hz] at which the scale is one.
            unit: force [N] of a coefficient of one.
        """
        layers = sorted({int(key.split(".")[1]) for key in weights})
        self._layers = [
            (
                np.array(weights[f"net.{i}.weight"], np.float64).T.copy(),
                np.array(weights[f"net.{i}.bias"], np.float64),
            )
            for i in layers
        ]
        self._rough = [(weight.astype(np.float32), bias.astype(np.float32)) for weight, bias in self._layers]
        self._a0, self._f0 = reference
        self._unit = unit

    def force(self, command: NDArray[np.floating]) -> NDArray[np.floating]:
        """Forces (..., 3) [N] of commands (..., 3), in single precision where the commands are."""
        flat = command.reshape(-1, 3)
        layers = self._rough if command.dtype == np.float32 else self._layers
        a, f, c, s = self._inputs(flat)
        hidden = _columns(a - 0.5, f - 0.5, c, s)
        for weight, bias in layers[:-1]:
            hidden = hidden @ weight
            hidden += bias
            np.tanh(hidden, out=hidden)
        weight, bias = layers[-1]
        k = (hidden @ weight + bias) * ((a * f) ** 2 * self._unit)[:, None]
        force = np.empty_like(k)
        force[:, 0] = k[:, 0]
        force[:, 1] = c * k[:, 1] - s * k[:, 2]
        force[:, 2] = s * k[:, 1] + c * k[:, 2]
        return force.reshape(command.shape)

    def force_and_jacobian(self, command: Array) -> tuple[Array, Array]:
        """Forces (..., 3) and their derivatives (..., 3, 3) by amplitude, frequency and zero direction."""
        flat = command.reshape(-1, 3)
        rows = len(flat)
        a, f, c, s = self._inputs(flat)
        hidden = _columns(a - 0.5, f - 0.5, c, s)
        tangent = np.zeros((rows, 3, 4))  # d inputs / d command
        tangent[:, 0, 0] = 1.0 / self._a0
        tangent[:, 1, 1] = 1.0 / self._f0
        tangent[:, 2, 2], tangent[:, 2, 3] = -s, c
        for weight, bias in self._layers[:-1]:
            hidden = np.tanh(hidden @ weight + bias)
            slope = 1.0 - hidden * hidden
            tangent = (tangent.reshape(rows * 3, -1) @ weight).reshape(rows, 3, -1) * slope[:, None]
        weight, bias = self._layers[-1]
        k = hidden @ weight + bias
        dk = (tangent.reshape(rows * 3, -1) @ weight).reshape(rows, 3, 3)  # (rows, command, coefficient)
        scale = (a * f) ** 2 * self._unit
        dk *= scale[:, None, None]
        dk[:, 0] += (2.0 * self._unit / self._a0 * a * f * f)[:, None] * k
        dk[:, 1] += (2.0 * self._unit / self._f0 * a * a * f)[:, None] * k
        k *= scale[:, None]
        force = _columns(k[:, 0], c * k[:, 1] - s * k[:, 2], s * k[:, 1] + c * k[:, 2])
        jacobian = np.empty((rows, 3, 3))
        c3, s3 = c[:, None], s[:, None]
        jacobian[:, 0] = dk[:, :, 0]
        jacobian[:, 1] = c3 * dk[:, :, 1] - s3 * dk[:, :, 2]
        jacobian[:, 2] = s3 * dk[:, :, 1] + c3 * dk[:, :, 2]
        jacobian[:, 1, 2] -= force[:, 2]
        jacobian[:, 2, 2] += force[:, 1]
        return force.reshape(command.shape), jacobian.reshape(*command.shape, 3)

    def _inputs(self, flat: Array) -> tuple[Array, Array, Array, Array]:
        return flat[:, 0] / self._a0, flat[:, 1] / self._f0, np.cos(flat[:, 2]), np.sin(flat[:, 2])


def _columns(*columns: Array) -> Array:
    """Vectors (R,) side by side; `np.stack` takes four times as long for so few."""
    result = np.empty((len(columns[0]), len(columns)), dtype=columns[0].dtype)
    for i, column in enumerate(columns):
        result[:, i] = column
    return result
