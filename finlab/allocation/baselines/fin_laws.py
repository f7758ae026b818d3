"""Fin models with derivatives in numpy float64, for the model-based methods.

A law works on the fins of one layout that share a fin model: commands (..., n, 3) to forces in each fin's own
frame, component by component, with their derivatives. The physics package stays the judge; tests hold the two
together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.special import j0, j1

from finlab.layout import FinModelSpec
from finlab.physics import Drag, FinModel, Lighthill, make_fin_model

Array = NDArray[np.float64]

DIFFERENCE_STEP = 1e-5
"""Half width of the central differences of models without a closed form [rad, Hz, rad]."""


class LocalForce(NamedTuple):
    """Force of n fins in their own frames and its derivatives by amplitude, frequency, zero direction."""

    shaft: Array | None
    """Component (..., n) along the shaft [N]; None where the law has none."""
    horizontal: Array
    """Component (..., n) along the horizontal thrust axis [N]."""
    vertical: Array
    """Component (..., n) along the body's z axis [N]."""
    d_shaft: Array | None
    """Derivatives (..., n, 3) of `shaft`."""
    d_horizontal: Array
    """Derivatives (..., n, 3) of `horizontal`."""
    d_vertical: Array
    """Derivatives (..., n, 3) of `vertical`."""


class FinLaw(Protocol):
    """Forces of the fins that share a model."""

    def force(self, command: Array) -> LocalForce:
        """Forces and derivatives for commands (..., n, 3)."""

    def thrust(self, amplitude: Array, frequency: Array) -> Array:
        """Size of the force (..., n) at zero direction zero [N]."""


class DragLaw:
    """`T = c f^2 sin^2(A)`, pointing where the zero direction points."""

    def __init__(self, models: Sequence[Drag]) -> None:
        self.factor = np.array([model.coefficient for model in models])

    def thrust(self, amplitude: Array, frequency: Array) -> Array:
        return self.factor * (frequency * np.sin(amplitude)) ** 2

    def force(self, command: Array) -> LocalForce:
        amplitude, frequency, direction = command[..., 0], command[..., 1], command[..., 2]
        sine = np.sin(amplitude)
        scaled = self.factor * frequency * sine
        return _planar(
            scaled * frequency * sine,
            2 * scaled * frequency * np.cos(amplitude),
            2 * scaled * sine,
            direction,
        )


class LighthillLaw:
    """`T = c f^2 A J1(A)`, pointing where the zero direction points."""

    def __init__(self, models: Sequence[Lighthill]) -> None:
        self.factor = np.array([model.coefficient for model in models])

    def thrust(self, amplitude: Array, frequency: Array) -> Array:
        return self.factor * frequency**2 * amplitude * j1(amplitude)

    def force(self, command: Array) -> LocalForce:
        amplitude, frequency, direction = command[..., 0], command[..., 1], command[..., 2]
        scaled = self.factor * frequency
        shape = amplitude * j1(amplitude)
        return _planar(
            scaled * frequency * shape,
            scaled * frequency * amplitude * j0(amplitude),  # d(A J1)/dA = A J0
            2 * scaled * shape,
            direction,
        )


class NumericalLaw:
    """Any other fin model, one per fin, by central differences of its float64 torch force."""

    def __init__(self, models: Sequence[FinModel]) -> None:
        self.models = tuple(models)

    def _evaluate(self, command: Array) -> Array:
        """Forces (..., n, 3) in the fins' frames."""
        tensor = torch.from_numpy(np.ascontiguousarray(command))
        with torch.no_grad():
            forces = [model.force(tensor[..., i, :]) for i, model in enumerate(self.models)]
        return torch.stack(forces, dim=-2).numpy()

    def thrust(self, amplitude: Array, frequency: Array) -> Array:
        command = np.stack(np.broadcast_arrays(amplitude, frequency, 0.0), axis=-1)
        return np.linalg.norm(self._evaluate(command), axis=-1)

    def force(self, command: Array) -> LocalForce:
        value = self._evaluate(command)
        slopes = np.empty((*value.shape, 3))
        for k in range(3):
            offset = np.zeros(3)
            offset[k] = DIFFERENCE_STEP
            difference = self._evaluate(command + offset) - self._evaluate(command - offset)
            slopes[..., k] = difference / (2 * DIFFERENCE_STEP)
        parts = [value[..., axis] for axis in range(3)]
        return LocalForce(*parts, *(slopes[..., axis, :] for axis in range(3)))


LAWS: dict[str, Callable[[Sequence[Any]], FinLaw]] = {"drag": DragLaw, "lighthill": LighthillLaw}
"""Fin models with a closed form here; all others go through `NumericalLaw`."""


def group_laws(specs: Sequence[FinModelSpec]) -> list[tuple[NDArray[np.intp], FinLaw]]:
    """The fins of a layout by the law that evaluates them together: (their places, the law)."""
    kinds = [spec.type if spec.type in LAWS else "" for spec in specs]
    groups: list[tuple[NDArray[np.intp], FinLaw]] = []
    for kind in sorted(set(kinds)):
        places = [i for i, own in enumerate(kinds) if own == kind]
        models = [make_fin_model(specs[i]) for i in places]
        groups.append((np.array(places), LAWS.get(kind, NumericalLaw)(models)))
    return groups


def _planar(thrust: Array, by_amplitude: Array, by_frequency: Array, direction: Array) -> LocalForce:
    """A thrust in the plane of the horizontal axis and z, with its derivatives."""
    cosine, sine = np.cos(direction), np.sin(direction)
    horizontal, vertical = thrust * cosine, thrust * sine
    return LocalForce(
        None,
        horizontal,
        vertical,
        None,
        np.stack([by_amplitude * cosine, by_frequency * cosine, -vertical], axis=-1),
        np.stack([by_amplitude * sine, by_frequency * sine, horizontal], axis=-1),
    )
