"""The law of thrusters that turn: azimuths and tilts.

Command: (angle [rad], force [N], 0). Own frame: turn_axis, zero, turn_axis x zero; at the angle a the force
points along cos(a) zero + sin(a) (turn_axis x zero). There is none within the dead band.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.law import ActuatorLaw
from finlab.actuators.thrust_power import by_model, held, power_of
from finlab.arrays import Array, Values
from finlab.layout.azimuth import Azimuth


class AzimuthLaw(ActuatorLaw):
    """n turning thrusters whose models are of one kind."""

    def __init__(self, azimuths: Sequence[Azimuth]) -> None:
        """Takes n turning thrusters."""
        self.power_curve = power_of([azimuth.model for azimuth in azimuths])
        self.dead_band = np.array([azimuth.dead_band for azimuth in azimuths])

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`."""
        force = np.zeros_like(command)
        size = held(command[..., 1], self.dead_band)
        force[..., 1], force[..., 2] = size * np.cos(command[..., 0]), size * np.sin(command[..., 0])
        return force

    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """See `ActuatorLaw`."""
        force = self.force(command)
        jacobian = np.zeros((*command.shape, 3))
        jacobian[..., 0, 1], jacobian[..., 0, 2] = -force[..., 2], force[..., 1]
        free = held(command[..., 1], self.dead_band) == command[..., 1]
        jacobian[..., 1, 1], jacobian[..., 1, 2] = (
            np.cos(command[..., 0]) * free,
            np.sin(command[..., 0]) * free,
        )
        return force, jacobian

    def power(self, command: Values, copper_loss: float = 0.0, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`. Turning takes none."""
        return self.power_curve.watts(held(command[..., 1], self.dead_band))

    def power_gradient(self, command: Array, copper_loss: float = 0.0, inflow: Array | None = None) -> Array:
        """See `ActuatorLaw`."""
        gradient = np.zeros(command.shape)
        gradient[..., 1] = self.power_curve.marginal(held(command[..., 1], self.dead_band))
        return gradient


def azimuth_laws(azimuths: Sequence[Azimuth]) -> list[tuple[NDArray[np.intp], ActuatorLaw]]:
    """Returns the laws of n turning thrusters, each with the places of its own."""
    return [*by_model(azimuths, AzimuthLaw)]
