"""Thrusters with a fixed axis, and those that turn: the force is the command, but none in the dead band.

Fixed: command (force [N], 0, 0); own frame: axis, and two directions across it, along which nothing acts. The
reaction torque of the propeller is part of the effectiveness.

Azimuths and tilts: command (angle [rad], force [N], 0); own frame: turn_axis, zero, turn_axis x zero; at the
angle a the force points along cos(a) zero + sin(a) (turn_axis x zero).
"""

from collections.abc import Sequence

import numpy as np

from finlab.actuators.response import Group, Line, Plane
from finlab.actuators.thrust_power import PropellerLaw, ThrustPower, radial_table
from finlab.arrays import Array, Values
from finlab.layout.axes import TURN, is_full_turn, wrapped
from finlab.layout.propellers import Azimuth, Thruster
from finlab.precision import NEARLY


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
            _line(thruster, sign * matrix[0])
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


def _line(thruster: Thruster, along: Array) -> Line:
    """What one thruster offers; `along` (6,) is the wrench per newton, of one that only pulls in reverse."""
    least, most = thruster.force
    if most <= 0.0:
        return Line(along, radial_table(thruster.model, -1, 0.0, -least), band=thruster.dead_band)
    reverse = radial_table(thruster.model, -1, 0.0, -least) if least < 0.0 else None
    return Line(along, radial_table(thruster.model, 1, 0.0, most), reverse, thruster.dead_band)


class AzimuthLaw(PropellerLaw):
    """n turning thrusters."""

    column = 1

    def force(self, command: Values, inflow: Array | None = None) -> Values:
        force = np.zeros_like(command)
        size = self.given(command)
        force[..., 1], force[..., 2] = size * np.cos(command[..., 0]), size * np.sin(command[..., 0])
        return force

    def force_and_jacobian(self, command: Array, inflow: Array | None = None) -> tuple[Array, Array]:
        force = self.force(command)
        jacobian = np.zeros((*command.shape, 3))
        jacobian[..., 0, 1], jacobian[..., 0, 2] = -force[..., 2], force[..., 1]
        angle, free = command[..., 0], self.given(command) == command[..., 1]
        jacobian[..., 1, 1], jacobian[..., 1, 2] = np.cos(angle) * free, np.sin(angle) * free
        return force, jacobian


class AzimuthGroup(Group):
    """What the turning thrusters of a robot offer for prices."""

    def __init__(self, azimuths: Sequence[Azimuth], effectiveness: Array) -> None:
        """Takes turning thrusters and the wrench (m, 3, 6) per newton along each own axis."""
        self._lower = np.array([azimuth.lower for azimuth in azimuths])
        self._upper = np.array([azimuth.upper for azimuth in azimuths])
        self._power = ThrustPower([azimuth.model for azimuth in azimuths])
        middle, half = _arcs(self._lower[:, 0], self._upper[:, 0])
        self.responses = [
            _plane(azimuth, matrix[1:], float(middle[i]), float(half[i]))
            for i, (azimuth, matrix) in enumerate(zip(azimuths, effectiveness, strict=True))
        ]

    def commands(self, force: Array, previous: Array | None = None) -> Array:
        """See `Group`. Where no force is wanted, the angle stays that of the `previous` commands, or comes as
        near to 0 as the arc allows. What can be given forward and in reverse is given at the least power."""
        size = np.hypot(force[..., 0], force[..., 1])
        before = np.zeros_like(size) if previous is None else np.nan_to_num(previous[..., 0])
        angle = np.where(size > 0.0, np.arctan2(force[..., 1], force[..., 0]), before)
        ahead, back = self._pushed(angle, size), self._pushed(angle + np.pi, -size)
        if (self._lower[:, 1] >= 0.0).all():
            return ahead
        wanted, least = np.stack([size * np.cos(angle), size * np.sin(angle)]), NEARLY * self._upper[:, 1]
        missing, watts = [], []
        for way in (ahead, back):
            force = way[..., 1] * np.stack([np.cos(way[..., 0]), np.sin(way[..., 0])])
            missing.append(np.linalg.norm(force - wanted, axis=0))
            watts.append(self._power.watts(way[..., 1]))
        cheaper = (missing[1] <= missing[0] + least) & (watts[1] < watts[0] * (1.0 - NEARLY))
        return np.where(((missing[1] < missing[0] - least) | cheaper)[..., None], back, ahead)

    def _pushed(self, angle: Array, force: Array) -> Array:
        """Commands (..., m, 3) that come nearest to angles [rad] and forces [N] (..., m)."""
        middle, _ = _arcs(self._lower[:, 0], self._upper[:, 0])
        command = np.zeros((*force.shape, 3))
        command[..., 0] = middle + wrapped(angle - middle)
        command[..., 1] = force
        return np.clip(command, self._lower, self._upper)

    def radial_worth(self, price: Array, back: Array) -> Array:
        least, most = self._lower[:, 1], self._upper[:, 1]
        ahead = self._power.worth(price, np.maximum(least, 0.0), most)
        return np.where(least < 0.0, np.maximum(ahead, self._power.worth(-back, least, 0.0 * most)), ahead)

    def reach(self, lower: Array, upper: Array) -> Array:
        return np.stack([lower[:, 1], upper[:, 1], *_arcs(lower[:, 0], upper[:, 0])], axis=-1)


def _plane(azimuth: Azimuth, matrix: Array, middle: float, half: float) -> Plane:
    """What one offers; `matrix` (2, 6) is the wrench per newton."""
    least, most = azimuth.force
    table = radial_table(azimuth.model, 1, max(least, 0.0), most)
    reverse = radial_table(azimuth.model, -1, 0.0, -least) if least < 0.0 else None
    return Plane(matrix, table, middle, half, band=azimuth.dead_band, reverse=reverse)


def _arcs(low: Array, high: Array) -> tuple[Array, Array]:
    """Middles and halves (m,) of arcs [rad]; pi is the half of a full turn."""
    return 0.5 * (low + high), np.where(is_full_turn(high - low), 0.5 * TURN, 0.5 * (high - low))
