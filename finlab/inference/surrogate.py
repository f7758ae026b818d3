"""The paper's trained surrogate in numpy, on one layout: what its method believes of a robot's fins."""

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

import numpy as np

from finlab.arrays import AnyArray
from finlab.errors import CheckpointError
from finlab.inference.features import RAW_SIZE, raw_features
from finlab.inference.layers import Linear, linear, names_of_layers, silu, silu_and_slope, single_precision
from finlab.inference.weights import TrainedWeights
from finlab.layout import Layout
from finlab.layout.arrays import force_columns

FORCE_UNIT = 4.0
"""Force [N] of order one for the perceptron's outputs."""
BLOCK = 64
"""Robots whose fins are worked on at once: some hundred rows of the hidden layers, half a megabyte."""


class MlpFins:
    """The fins of one layout by the paper's perceptron: commands in, forces in the body frame out.

    It works in single precision, whatever the commands are in.
    """

    def __init__(
        self,
        weights: Mapping[str, AnyArray],
        position: AnyArray,
        mounting_angle: AnyArray,
        lower: AnyArray,
        upper: AnyArray,
    ) -> None:
        """Take over a trained surrogate, its state by PyTorch's names, for fins at `position` (n, 3) [m] with
        shafts at `mounting_angle` (n,) [rad] and limits (n, 3), which are features as well."""
        state = single_precision(weights)
        features = raw_features(position, mounting_angle, lower, upper).astype(np.float32)
        first, *self._layers, last = (linear(state, name) for name in names_of_layers(state, "net"))
        self._layers.append(Linear(FORCE_UNIT * last.weight, FORCE_UNIT * last.bias))
        half = (0.5 * (upper - lower)).astype(np.float32)
        self._middle, self._half = lower.astype(np.float32) + half, np.maximum(half, np.float32(1e-9))
        # The features of a fin never change, and what follows the first layer is linear in its slopes.
        self._by_fin = features @ first.weight[:RAW_SIZE] + first.bias
        self._by_command, second = first.weight[RAW_SIZE:], self._layers[0].weight
        # Laid out for the way back: products with transposed views take twice the time.
        self._back = [layer.weight.T.copy() for layer in self._layers]
        self._command_back = self._by_command.T.copy()
        self._slopes = (self._by_command.T[:, :, None] * second[:, None]).reshape(len(second), -1)
        pooled = np.tanh(features @ state["descriptor.0.weight"].T + state["descriptor.0.bias"]).mean(0)
        self.scale, self.bias = np.split(state["affine.weight"] @ pooled + state["affine.bias"], 2)
        """By how much the sum of the fins' wrenches is stretched, and what is added to it, (6,) each."""

    def force(self, command: AnyArray) -> AnyArray:
        """Forces (R, n, 3) [N] of commands (R, n, 3)."""
        result = np.empty(command.shape, dtype=np.float32)
        for rows in blocks_of(len(command)):
            z = self._first(command[rows])
            for layer in self._layers:
                z = layer(silu(z))
            result[rows] = z.reshape(result[rows].shape)
        return result

    def force_and_slopes(self, command: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Forces (R, n, 3) and, for each of the three commands in turn, their derivatives (R, n, 3, 3)."""
        parts = [self._force_and_slopes(command[rows]) for rows in blocks_of(len(command))]
        force, slopes = map(np.concatenate, zip(*parts, strict=True))
        return force, slopes

    def _force_and_slopes(self, command: AnyArray) -> tuple[AnyArray, AnyArray]:
        z = self._first(command)
        slopes = None
        for layer in self._layers:
            value, slope = silu_and_slope(z)
            z, weight = layer(value), layer.weight
            if slopes is None:
                slopes = slope.dot(self._slopes).reshape(len(z), 3, -1)
            else:
                slopes = (slopes * slope[:, None]).reshape(3 * len(z), -1).dot(weight).reshape(len(z), 3, -1)
        assert slopes is not None
        slopes = slopes.reshape(*command.shape, 3)
        slopes /= self._half[..., None]
        return z.reshape(command.shape), slopes

    def force_and_pullback(self, command: AnyArray) -> tuple[AnyArray, Callable[[AnyArray], AnyArray]]:
        """Forces (R, n, 3) [N], and what turns derivatives of a number by them into those by the commands.

        Both are (R, n, 3); it is a third of the work of all slopes.
        """
        z, slopes = self._first(command), []
        for layer in self._layers:
            value, slope = silu_and_slope(z)
            slopes.append(slope)
            z = layer(value)

        def pull(by_force: AnyArray) -> AnyArray:
            by_layer = by_force.reshape(z.shape)
            for back, slope in zip(reversed(self._back), reversed(slopes), strict=True):
                by_layer = by_layer.dot(back)
                by_layer *= slope
            by_command = by_layer.dot(self._command_back).reshape(command.shape)
            by_command /= self._half
            return np.asarray(by_command)

        return z.reshape(command.shape), pull

    def _first(self, command: AnyArray) -> AnyArray:
        """What the first hidden layer adds up (R n, width)."""
        # Rounded first: where a range has no width, any remainder would be blown up.
        x = (command.astype(np.float32) - self._middle) / self._half
        z = x.reshape(-1, 3).dot(self._by_command).reshape(*x.shape[:-1], -1)
        z += self._by_fin
        return np.asarray(z.reshape(-1, z.shape[-1]))


def blocks_of(rows: int) -> list[slice]:
    """Slices of so few robots that a hidden layer of their fins stays in the processor's cache."""
    return [slice(k, k + BLOCK) for k in range(0, rows, BLOCK)]


class FinForces(Protocol):
    """The forces of one robot's fins, each in a frame of its own choice."""

    def force(self, command: AnyArray) -> AnyArray:
        """Forces (..., n, 3) [N] of commands (..., n, 3)."""
        ...

    def force_and_slopes(self, command: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Forces and, for each of the three commands in turn, their derivative by it (..., n, 3, 3)."""
        ...


class LayoutSurrogate(NamedTuple):
    """A surrogate on one layout of n fins."""

    fins: MlpFins
    """What force each fin gives."""
    columns: AnyArray
    """Wrench per newton (n, 3, 6) of each fin's force along the three axes of its frame."""
    bias: AnyArray
    """Wrench (6,) [N, N m] of fins that give no force; the paper's surrogate has one."""

    def wrench(self, command: AnyArray) -> AnyArray:
        """Wrenches (..., 6) [N, N m] of commands (..., n, 3)."""
        force = self.fins.force(command)
        return np.asarray(force.reshape(*command.shape[:-2], -1) @ self.columns.reshape(-1, 6) + self.bias)


def surrogate_on(layout: Layout, weights: TrainedWeights) -> LayoutSurrogate:
    """The surrogate of a checkpoint on one layout; a `CheckpointError` where it holds none."""
    if weights.surrogate_config is None:
        raise CheckpointError(
            f"checkpoint {weights.name!r} holds no surrogate; train one with `finlab train surrogate`"
        )
    angle = layout.mounting_angle
    fins = MlpFins(weights.surrogate, layout.position, angle, layout.lower, layout.upper)
    # The perceptron speaks in the body frame, that of a fin whose shaft points forward.
    columns = force_columns(layout.position, np.zeros_like(angle)) * (1.0 + fins.scale)
    return LayoutSurrogate(fins, columns, fins.bias)
