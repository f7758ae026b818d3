"""The law of thrusters with a fixed axis: the force is the command, but none within the dead band.

Command: (force [N], 0, 0). Own frame: axis, and two directions across it, along which nothing acts. The
reaction torque of the propeller is part of the effectiveness.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.law import ActuatorLaw
from finlab.actuators.thrust_power import by_model, held, power_of
from finlab.arrays import Array, Values
from finlab.layout.thruster import Thruster


class ThrusterLaw(ActuatorLaw):
    """n thrusters whose models are of one kind."""

    def __init__(self, thrusters: Sequence[Thruster]) -> None:
        """Takes n thrusters."""
        self.power_curve = power_of([thruster.model for thruster in thrusters])
        self.dead_band = np.array([thruster.dead_band for thruster in thrusters])

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`."""
        force = np.zeros_like(command)
        force[..., 0] = held(command[..., 0], self.dead_band)
        return force

    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        """See `ActuatorLaw`."""
        jacobian = np.zeros((*command.shape, 3))
        force = self.force(command)
        jacobian[..., 0, 0] = force[..., 0] == command[..., 0]
        return force, jacobian

    def power(self, command: Values, copper_loss: float = 0.0, inflow: Array | None = None) -> Values:
        """See `ActuatorLaw`. The models tell electrical power, in which the motor's loss is included."""
        return self.power_curve.watts(held(command[..., 0], self.dead_band))

    def power_gradient(self, command: Array, copper_loss: float = 0.0, inflow: Array | None = None) -> Array:
        """See `ActuatorLaw`."""
        gradient = np.zeros(command.shape)
        gradient[..., 0] = self.power_curve.marginal(held(command[..., 0], self.dead_band))
        return gradient


def thruster_laws(thrusters: Sequence[Thruster]) -> list[tuple[NDArray[np.intp], ActuatorLaw]]:
    """Returns the laws of n thrusters, each with the places of its own."""
    return [*by_model(thrusters, ThrusterLaw)]
