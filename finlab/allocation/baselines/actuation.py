"""The actuation map of one layout, command to wrench, with its Jacobian.

The model-based methods optimize over it. It uses the layout's own analytic fin models, that is the plant, as
the paper's baselines do. Numpy float64.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.baselines.fin_laws import LocalForce, group_laws
from finlab.layout import Layout
from finlab.layout.arrays import planar_effectiveness, stack_layouts

Array = NDArray[np.float64]

FULL_TURN = 2 * np.pi - 1e-9


class Actuation:
    """Command to wrench of one layout, linearizable, with the layout's limits at hand."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.n_fins = layout.n_fins
        arrays = stack_layouts([layout])
        self.lower, self.upper = arrays.lower[0], arrays.upper[0]
        self.width = self.upper - self.lower
        self.full_turn = self.width[:, 2] >= FULL_TURN
        """Fins (n,) whose zero direction may turn freely; theirs wraps instead of ending at a limit."""
        planar = planar_effectiveness(arrays.position[0], arrays.mounting_angle[0])
        self.horizontal = planar[..., 0].T.copy()
        """Wrench (6, n) of 1 N along each fin's horizontal thrust axis."""
        self.vertical = planar[..., 1].T.copy()
        """Wrench (6, n) of 1 N along z at each fin."""
        along = np.stack([np.cos(arrays.mounting_angle[0]), np.sin(arrays.mounting_angle[0])], -1)
        shaft = np.pad(along, ((0, 0), (0, 1)))
        self.shaft = np.concatenate([shaft, np.cross(arrays.position[0], shaft)], axis=1).T.copy()
        """Wrench (6, n) of 1 N along each fin's shaft."""
        self._groups = group_laws([fin.model for fin in layout.fins])

    def thrust(self, amplitude: Array, frequency: Array) -> Array:
        """Size of each fin's force (..., n) at zero direction zero [N]."""
        if len(self._groups) == 1:
            return self._groups[0][1].thrust(amplitude, frequency)
        result = np.empty(np.broadcast_shapes(amplitude.shape, frequency.shape))
        for index, law in self._groups:
            result[..., index] = law.thrust(amplitude[..., index], frequency[..., index])
        return result

    def wrench(self, command: Array) -> Array:
        """Wrenches (..., 6) of commands (..., n, 3)."""
        return self._wrench(self._force(command))

    def linearize(self, command: Array) -> tuple[Array, Array]:
        """Wrenches (..., 6) of commands (..., n, 3) and their derivatives (..., 6, 3 n), fin by fin."""
        force = self._force(command)
        jacobian = (
            self.horizontal[..., None] * force.d_horizontal[..., None, :, :]
            + self.vertical[..., None] * force.d_vertical[..., None, :, :]
        )
        if force.d_shaft is not None:
            jacobian += self.shaft[..., None] * force.d_shaft[..., None, :, :]
        return self._wrench(force), jacobian.reshape(*jacobian.shape[:-2], 3 * self.n_fins)

    def feasible(self, command: Array) -> Array:
        """Commands (..., n, 3) brought within the limits exactly: full turns wrap, all else clips."""
        result = np.array(command, np.float64)
        direction = result[..., 2]
        wrapped = self.lower[:, 2] + (direction - self.lower[:, 2]) % (2 * np.pi)
        result[..., 2] = np.where(self.full_turn, wrapped, direction)
        return np.clip(result, self.lower, self.upper)

    def sample(self, rng: np.random.Generator, size: tuple[int, ...]) -> Array:
        """Uniform commands (*size, n, 3) within the limits."""
        return self.lower + rng.uniform(size=(*size, self.n_fins, 3)) * self.width

    def _wrench(self, force: LocalForce) -> Array:
        wrench = force.horizontal @ self.horizontal.T + force.vertical @ self.vertical.T
        return wrench if force.shaft is None else wrench + force.shaft @ self.shaft.T

    def _force(self, command: Array) -> LocalForce:
        if len(self._groups) == 1:
            return self._groups[0][1].force(command)
        shape = command.shape[:-1]
        value, slope = np.zeros((3, *shape)), np.zeros((3, *shape, 3))
        for index, law in self._groups:
            part = law.force(command[..., index, :])
            for axis in range(3):
                component, derivative = part[axis], part[axis + 3]
                if component is not None and derivative is not None:
                    value[axis][..., index] = component
                    slope[axis][..., index, :] = derivative
        return LocalForce(*value, *slope)
