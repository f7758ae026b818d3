"""The law of thrusters that turn: azimuths and tilts.

Command: (angle [rad], force [N], 0). Own frame: turn_axis, zero, turn_axis x zero; at the angle a the force
points along cos(a) zero + sin(a) (turn_axis x zero).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.law import ActuatorLaw
from finlab.actuators.thrust_power import by_model, power_of
from finlab.arrays import Array, Values
from finlab.layout.azimuth import Azimuth


class AzimuthLaw(ActuatorLaw):
    """n turning thrusters whose models are of one kind."""

    def __init__(self, azimuths: Sequence[Azimuth]) -> None:
        """Takes n turning thrusters."""
        self.power_curve = power_of([azimuth.model for azimuth in azimuths])

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`."""
        force = np.zeros_like(command)
        force[..., 1] = command[..., 1] * np.cos(command[..., 0])
        force[..., 2] = command[..., 1] * np.sin(command[..., 0])
        return force

    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """See `ActuatorLaw`."""
        force = self.force(command)
        jacobian = np.zeros((*command.shape, 3))
        jacobian[..., 0, 1], jacobian[..., 0, 2] = -force[..., 2], force[..., 1]
        jacobian[..., 1, 1], jacobian[..., 1, 2] = np.cos(command[..., 0]), np.sin(command[..., 0])
        return force, jacobian

    def power(self, command: Values, copper_loss: float = 0.0, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`. Turning takes none."""
        return self.power_curve.watts(command[..., 1])

    def power_gradient(self, command: Array, copper_loss: float = 0.0, inflow: Array | None = None) -> Array:
        """See `ActuatorLaw`."""
        gradient = np.zeros(command.shape)
        gradient[..., 1] = self.power_curve.marginal(command[..., 1])
        return gradient


def azimuth_laws(azimuths: Sequence[Azimuth]) -> list[tuple[NDArray[np.intp], ActuatorLaw]]:
    """Returns the laws of n turning thrusters, each with the places of its own."""
    return [*by_model(azimuths, AzimuthLaw)]
