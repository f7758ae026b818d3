"""A trained surrogate on one layout: what the learned methods believe of a robot's fins. numpy only."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.inference.learned_fin import LearnedFin
from finlab.inference.mlp_surrogate import MlpFins
from finlab.inference.weights import TrainedWeights
from finlab.layout import Layout
from finlab.layout.arrays import force_columns

Array = NDArray[Any]


class FinForces(Protocol):
    """The forces of one robot's fins, each in a frame of its own choice."""

    def force(self, command: Array) -> Array:
        """Forces (..., n, 3) [N] of commands (..., n, 3)."""
        ...

    def force_and_slopes(self, command: Array) -> tuple[Array, Array]:
        """Forces and, for each of the three commands in turn, their derivative by it (..., n, 3, 3)."""
        ...


class LayoutSurrogate(NamedTuple):
    """A surrogate on one layout of n fins."""

    fins: FinForces
    """What force each fin gives."""
    columns: Array
    """Wrench per newton (n, 3, 6) of each fin's force along the three axes of its frame."""
    bias: Array
    """Wrench (6,) [N, N m] of fins that give no force; the paper's surrogate has one."""

    def wrench(self, command: Array) -> Array:
        """Wrenches (..., 6) [N, N m] of commands (..., n, 3)."""
        force = self.fins.force(command)
        return np.asarray(force.reshape(*command.shape[:-2], -1) @ self.columns.reshape(-1, 6) + self.bias)


def surrogate_on(layout: Layout, weights: TrainedWeights) -> LayoutSurrogate:
    """The surrogate of a checkpoint, of either kind, on one layout."""
    angle = layout.mounting_angle
    if weights.surrogate_config.kind == "mlp":
        limits = layout.lower, layout.upper
        fins = MlpFins(weights.surrogate, layout.position, angle, *limits)
        # The perceptron speaks in the body frame, that of a fin whose shaft points forward.
        columns = force_columns(layout.position, np.zeros_like(angle)) * (1.0 + fins.scale)
        return LayoutSurrogate(fins, columns, fins.bias)
    columns = force_columns(layout.position, angle)
    return LayoutSurrogate(LearnedFin(weights.surrogate), columns, np.zeros(6))
