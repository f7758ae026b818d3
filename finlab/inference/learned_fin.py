"""The learned fin in numpy: force and closed-form Jacobian of `CoefficientSurrogate`.

Refinement runs on a few hundred rows at a time, where numpy's small overhead per operation beats a
tensor library's, and a robot's computer needs no such library.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

REFERENCE = (0.6, 2.1)
"""Amplitude [rad] and frequency [Hz] at which the scale of the force is one."""
FORCE_UNIT = 4.0
"""Force [N] of order one for the networks' outputs: that of a coefficient of one."""


class LearnedFin:
    """Force of one fin in its own frame (shaft, e_h, e_z) by the learned force coefficients."""

    def __init__(self, weights: Mapping[str, Array]) -> None:
        """Take over a surrogate: its perceptron's `net.<i>.weight` (out, in) and `net.<i>.bias` (out,)."""
        layers = sorted({int(key.split(".")[1]) for key in weights})
        self._layers = [
            tuple(np.array(weights[f"net.{i}.{part}"], np.float64, order="C") for part in ("weight", "bias"))
            for i in layers
        ]
        self._columns = [(weight, bias[:, None]) for weight, bias in self._layers]
        self._float32 = [
            (weight.astype(np.float32), bias.astype(np.float32)) for weight, bias in self._columns
        ]
        self._rows = [(weight.T.copy(), bias) for weight, bias in self._layers]
        weight = self._rows[0][0]
        # Cosine and sine change with the zero direction as minus the sine and the cosine.
        self._first_slopes = weight[:2] / np.array([REFERENCE]).T, np.stack([weight[3], -weight[2]])
        self._a0, self._f0 = REFERENCE
        self._unit = FORCE_UNIT
        self._scale = np.array([REFERENCE]).T
        self._scale_float32 = self._scale.astype(np.float32)

    def force(self, command: NDArray[np.floating]) -> NDArray[np.floating]:
        """Forces (..., 3) [N] of commands (..., 3), in single precision where the commands are."""
        layers = self._float32 if command.dtype == np.float32 else self._columns
        beat, hidden = self._inputs(command.reshape(-1, 3))
        c, s = hidden[2], hidden[3]
        for weight, bias in layers[:-1]:
            hidden = weight.dot(hidden)
            hidden += bias
            np.tanh(hidden, out=hidden)
        weight, bias = layers[-1]
        k = weight.dot(hidden)
        k += bias
        scale = beat[0] * beat[1]
        scale *= scale
        scale *= self._unit
        k *= scale
        return _turned(k, c, s).reshape(command.shape)

    def force_and_slopes(self, command: Array) -> tuple[Array, Array]:
        """Forces (..., 3) and, for each of the three commands in turn, their derivative by it (..., 3, 3).

        Value and derivatives go through the perceptron together, as four blocks of rows (4, R, width).
        """
        flat = command.reshape(-1, 3)
        rows = len(flat)
        beat, inputs = self._inputs(flat)
        (a, f), c, s = beat, inputs[2], inputs[3]
        (by_a, by_f), by_turn = self._first_slopes
        weight, bias = self._rows[0]
        hidden, slope = _activated(inputs.T.dot(weight), bias)
        both = np.empty((4, *hidden.shape))
        both[0] = hidden
        np.multiply(slope, by_a, out=both[1])
        np.multiply(slope, by_f, out=both[2])
        np.multiply(slope, inputs[2:].T.dot(by_turn), out=both[3])
        for weight, bias in self._rows[1:-1]:
            both = both.reshape(4 * rows, -1).dot(weight).reshape(4, rows, -1)
            hidden, slope = _activated(both[0], bias)
            both[1:] *= slope
            both[0] = hidden
        weight, bias = self._columns[-1]
        k = weight.dot(both.reshape(4 * rows, -1).T).reshape(3, 4, rows)
        value = k[:, 0]
        value += bias
        # The coefficients are scaled by (a f)^2, which has derivatives of its own.
        af = a * f
        af *= self._unit
        grown_a = value * (af * f * (2.0 / self._a0))
        grown_f = value * (af * a * (2.0 / self._f0))
        af *= a
        af *= f
        k *= af
        k[:, 1] += grown_a
        k[:, 2] += grown_f
        # So has the turn about the shaft, by which the force follows the zero direction.
        k[1, 3] -= k[2, 0]
        k[2, 3] += k[1, 0]
        turned = _turned(k, c, s)
        return turned[:, 0].reshape(command.shape), turned[:, 1:].reshape(*command.shape, 3)

    def _inputs(self, flat: Array) -> tuple[Array, Array]:
        """Normalized amplitude and frequency (2, R) of commands (R, 3); what the perceptron sees (4, R)."""
        values = flat.T
        beat = values[:2] / (self._scale_float32 if flat.dtype == np.float32 else self._scale)
        inputs = np.empty((4, len(flat)), dtype=flat.dtype)
        np.subtract(beat, 0.5, out=inputs[:2])
        np.cos(values[2], out=inputs[2])
        np.sin(values[2], out=inputs[3])
        return beat, inputs


def _activated(hidden: Array, bias: Array) -> tuple[Array, Array]:
    """Hyperbolic tangent of a layer (R, width) and its derivative."""
    hidden = hidden + bias
    np.tanh(hidden, out=hidden)
    slope = hidden * hidden
    return hidden, np.subtract(1.0, slope, out=slope)


def _turned(k: Array, c: Array, s: Array) -> Array:
    """Forces (R, ..., 3) from (3, ..., R), turned about the shaft by angles of cosine c, sine s (R,)."""
    along, across = k[1] * c, k[2] * s
    along -= across
    k[1] *= s
    k[2] *= c
    k[2] += k[1]
    k[1] = along
    return np.ascontiguousarray(k.T)
