"""Thrusters with a fixed axis: the force is the command, but none within the dead band.

Command: (force [N], 0, 0). Own frame: axis, and two directions across it, along which nothing acts. The
reaction torque of the propeller is part of the effectiveness.
"""

from collections.abc import Sequence

import numpy as np

from finlab.actuators.response import Group, Line
from finlab.actuators.thrust_power import PropellerLaw, ThrustPower, radial_table
from finlab.arrays import Array, Values
from finlab.layout.propellers import Thruster


class ThrusterLaw(PropellerLaw):
    """n thrusters."""

    column = 0

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        force = np.zeros_like(command)
        force[..., 0] = self.given(command)
        return force

    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        jacobian = np.zeros((*command.shape, 3))
        force = self.force(command)
        jacobian[..., 0, 0] = force[..., 0] == command[..., 0]
        return force, jacobian


class ThrusterGroup(Group):
    """What the thrusters of a robot offer for prices."""

    def __init__(self, thrusters: Sequence[Thruster], effectiveness: Array) -> None:
        """Takes thrusters and the wrench (m, 3, 6) per newton along each own axis."""
        self._sign = np.array([1.0 if thruster.force[1] > 0.0 else -1.0 for thruster in thrusters])
        self.responses = [
            _response(thruster, sign * matrix[0])
            for thruster, sign, matrix in zip(thrusters, self._sign, effectiveness, strict=True)
        ]
        self._limits = np.array([thruster.force for thruster in thrusters])
        self._power = ThrustPower([thruster.model for thruster in thrusters])

    def commands(self, force: Array, previous: Array | None = None) -> Array:
        command = np.zeros((*force.shape[:-1], 3))
        command[..., 0] = np.clip(self._sign * force[..., 0], self._limits[:, 0], self._limits[:, 1])
        return command

    def radial_worth(self, price: Array, back: Array) -> Array:
        return self._power.worth(self._sign * price, *self._limits.T)

    def reach(self, lower: Array, upper: Array) -> Array:
        ends = self._sign[:, None] * np.stack([lower[:, 0], upper[:, 0]], axis=-1)
        return np.pad(np.sort(ends, axis=-1), ((0, 0), (0, 2)))


def _response(thruster: Thruster, along: Array) -> Line:
    """What one thruster offers; `along` (6,) is the wrench per newton, of one that only pulls in reverse."""
    least, most = thruster.force
    if most <= 0.0:
        return Line(along, radial_table(thruster.model, -1, 0.0, -least), band=thruster.dead_band)
    reverse = radial_table(thruster.model, -1, 0.0, -least) if least < 0.0 else None
    return Line(along, radial_table(thruster.model, 1, 0.0, most), reverse, thruster.dead_band)
