"""The paper's surrogate: learned fin physics, commands and node features in, a wrench out.

A perceptron gives each fin's force in the body frame, F_i = f([x_i, u_i]); the wrench is the sum of
(F_i, r_i x F_i), then stretched and shifted by what a descriptor of the whole layout says. Here it
answers for one layout with its gradient, in numpy; `training/modules.py` trains it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from finlab.arrays import AnyArray
from finlab.errors import CheckpointError
from finlab.layout import Layout
from finlab.layout.effectiveness import force_effectiveness
from finlab.research.networks import layers, trained
from finlab.research.paper.network import RAW_SIZE, raw_features

FORCE_UNIT = 4.0
"""Force [N] of order one for the perceptron's outputs."""
DESCRIPTOR = 64
"""Size of the descriptor of a whole layout."""
BLOCK = 64
"""Robots whose fins are worked on at once: some hundred rows of the hidden layers, half a
megabyte."""


@dataclass(frozen=True)
class SurrogateConfig:
    """Sizes of the surrogate's perceptron, and the arrays that follow from them."""

    hidden: tuple[int, ...] = (512, 128)
    """Widths of the hidden layers; the first is printed, the second is not."""

    def shapes(self) -> trained.Shapes:
        """Shape of each array by name. Raises ValueError: there is no surrogate of these sizes."""
        trained.check_sizes(*self.hidden)
        shapes: trained.Shapes = {}
        for name, (n_in, n_out) in zip(
            self.layers(), pairwise([RAW_SIZE + 3, *self.hidden, 3]), strict=True
        ):
            shapes |= trained.linear_shapes(name, n_in, n_out)
        shapes |= trained.linear_shapes("descriptor.0", RAW_SIZE, DESCRIPTOR)
        return shapes | trained.linear_shapes("affine", DESCRIPTOR, 12)

    def layers(self) -> list[str]:
        """Names of the perceptron's layers, between which activations stand."""
        return [f"net.{2 * i}" for i in range(len(self.hidden) + 1)]

    @classmethod
    def of(cls, weights: trained.TrainedWeights) -> "SurrogateConfig":
        """The sizes of the surrogate of a checkpoint. Raises CheckpointError: it holds none, or a
        damaged one."""
        sizes = weights.surrogate_sizes
        if sizes is None:
            raise CheckpointError(f"checkpoint {weights.name!r} holds no surrogate; `paper` does")
        try:
            if set(sizes) != {"kind", "hidden"} or sizes["kind"] != "mlp":
                raise ValueError("expected the kind 'mlp' and the widths of its hidden layers")
            config = cls(tuple(sizes["hidden"]))
            trained.check_state(weights.surrogate, config.shapes())
        except (TypeError, ValueError) as error:
            raise CheckpointError(
                f"checkpoint {weights.name!r}: damaged surrogate ({error})"
            ) from error
        return config


class LayoutSurrogate:
    """A surrogate (Eq. 4) on one layout of n fins, with the gradient of its forces; in single
    precision."""

    def __init__(self, layout: Layout, weights: trained.TrainedWeights) -> None:
        """Take over the surrogate of a checkpoint. Raises CheckpointError: it holds none, or a
        damaged one."""
        self.config = SurrogateConfig.of(weights)
        self._w = layers.single_precision(weights.surrogate)
        features = raw_features(
            layout.position, layout.mounting_angle, layout.lower, layout.upper
        ).astype(np.float32)
        # The first layer's part that does not depend on the command, (n, hidden).
        self._first_of_fins = (
            features @ self._w["net.0.weight"][:, :RAW_SIZE].T + self._w["net.0.bias"]
        )
        self._lower = layout.lower.astype(np.float32)
        self._upper = layout.upper.astype(np.float32)
        self._half = np.maximum(0.5 * (self._upper - self._lower), np.float32(1e-9))
        descriptor = np.tanh(layers.linear(self._w, "descriptor.0", features)).mean(0)
        scale, self.bias = np.split(layers.linear(self._w, "affine", descriptor), 2)
        """Wrench (6,) [N, N m] of fins that give no force."""
        effectiveness = force_effectiveness(layout.position, np.zeros_like(layout.mounting_angle))
        self.effectiveness: AnyArray = effectiveness * (1.0 + scale)
        """Wrench per newton (n, 3, 6) of each fin's force along the three axes of the body."""

    def force(self, command: AnyArray) -> AnyArray:
        """Forces (R, n, 3) [N] of commands (R, n, 3)."""
        return np.concatenate([self._forward(command[rows]) for rows in blocks_of(len(command))])

    def force_and_pullback(
        self, command: AnyArray
    ) -> tuple[AnyArray, Callable[[AnyArray], AnyArray]]:
        """Returns forces and their vector-Jacobian product.

        Args:
            command: (R, n, 3).

        Returns:
            Forces (R, n, 3) [N], and a function from a number's derivatives by them (R, n, 3) to
            those by the commands (R, n, 3).
        """
        jacobian: list[AnyArray] = []
        force = self._forward(command, jacobian)

        def pull(by_force: AnyArray) -> AnyArray:
            by_layer = FORCE_UNIT * by_force.reshape(-1, 3)
            for name, slope in zip(
                reversed(self.config.layers()[1:]), reversed(jacobian), strict=True
            ):
                by_layer = by_layer @ self._w[f"{name}.weight"]
                by_layer *= slope.reshape(by_layer.shape)
            by_command = by_layer @ self._w["net.0.weight"][:, RAW_SIZE:]
            return np.asarray(by_command.reshape(command.shape) / self._half)

        return force, pull

    def wrench(self, command: AnyArray) -> AnyArray:
        """Wrenches (..., 6) [N, N m] of commands (..., n, 3)."""
        force = self.force(command.reshape(-1, *command.shape[-2:]))
        wrench = force.reshape(len(force), -1) @ self.effectiveness.reshape(-1, 6) + self.bias
        return np.asarray(wrench.reshape(*command.shape[:-2], 6))

    def _forward(self, command: AnyArray, jacobian: list[AnyArray] | None = None) -> AnyArray:
        """Forces; `jacobian` takes the derivatives of the activations, layer by layer."""
        # Rounded first: where a range has no width, any remainder would be blown up.
        x = trained.to_normalized(command.astype(np.float32), self._lower, self._upper)
        z = (
            layers.linear({"command.weight": self._w["net.0.weight"][:, RAW_SIZE:]}, "command", x)
            + self._first_of_fins
        )
        for name in self.config.layers()[1:]:
            gate = 0.5 * np.tanh(0.5 * z) + 0.5  # 1 / (1 + exp(-z)), which never overflows
            silu = z * gate
            if jacobian is not None:
                jacobian.append(gate + silu * (1.0 - gate))
            z = layers.linear(self._w, name, silu)
        return np.asarray(z * FORCE_UNIT)


def blocks_of(rows: int) -> list[slice]:
    """Slices of so few robots that a hidden layer of their fins stays in the processor's cache."""
    return [slice(k, k + BLOCK) for k in range(0, rows, BLOCK)]
