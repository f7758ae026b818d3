"""Fins within their beat: phase, angle, the servo's speed limit, and their power.

A fin that is given another frequency goes on from where it is in its beat.
"""

from typing import NamedTuple

import numpy as np

from finlab.actuators.fin.blade import Blade
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.angles import TURN
from finlab.vehicle.fin_lag import FinLag

CREEP = 0.1
"""Share of its speed that a servo turns its fin with, however fast that flaps."""

COPPER_LOSS = 0.5
"""Heat in the windings of a fin's motor [W/(N m)^2]: `copper_loss` of a robot that swims in simulation. Our
choice, as nothing is published of U-CAT's drives: a motor of 60 W whose windings take 730 W/(N m)^2 at its
own shaft (7 rpm per mN m) behind a gear of 50 : 1 at 80 %, with which its fin turns twice a second."""


class FinMotion(FinLag):
    """Angles of the fins of one layout over time, in steps much shorter than a beat; all arrays are (n,)."""

    def __init__(self, layout: Layout) -> None:
        """Starts at rest: no amplitude, no frequency, zero directions at the middle of their arcs."""
        super().__init__(layout)
        self._speed_limit = layout.speed_limit
        self._creep = CREEP * self._speed_limit
        self._before = self.value
        self._change = np.zeros((3, layout.n_fins))
        self.phase = np.zeros(layout.n_fins)
        """Phase of the flapping [rad]."""

    def step(self, command: Array, dt: float) -> None:
        """Follows a command (n, 3) for `dt` [s]; a fin whose row is NaN stops at once and hangs still."""
        before, rate_before = self.value, self.rate
        lost = self._follow(command, dt)
        value, rate = self.value, self.rate
        # What flapping leaves of the servo's speed is there to turn the fin.
        spare = np.maximum(self._speed_limit - value[0] * (TURN * value[1]), self._creep)
        turned = np.minimum(np.maximum(value[2] - before[2], -spare * dt), spare * dt)
        value[2] = before[2] + turned
        rate[2] = np.minimum(np.maximum(rate[2], -spare), spare)
        if lost is not None:
            before = np.where(lost, value, before)
        self.phase = np.mod(self.phase + (0.5 * TURN * dt) * (before[1] + value[1]), TURN)
        self._change = (rate - rate_before) / dt
        self._before = before

    @property
    def mean_command(self) -> Array:
        """`command` as a mean over the last step (n, 3)."""
        command: Array = 0.5 * (self._before + self.value).T
        return command

    @property
    def angle(self) -> Array:
        """The fins' angles [rad]: theta = A sin(phase) + zero direction."""
        return np.asarray(self.value[0] * np.sin(self.phase) + self.value[2])

    @property
    def speed(self) -> Array:
        """The fins' angular speeds [rad/s]."""
        return self.speed_and_acceleration()[0]

    def speed_and_acceleration(self) -> tuple[Array, Array]:
        """The fins' angular speeds [rad/s] and accelerations [rad/s^2], those of servos that change their aim
        as means over the last step."""
        sine, cosine = np.sin(self.phase), np.cos(self.phase)
        swing = TURN * self.value[1]
        fast, growth = self.value[0] * swing, self.rate[0]
        speed = self.rate[2] + growth * sine + fast * cosine
        acceleration = (
            self._change[2]
            + (self._change[0] - fast * swing) * sine
            + (2.0 * growth * swing + (TURN * self.value[0]) * self.rate[1]) * cosine
        )
        return speed, acceleration


class FinPower(NamedTuple):
    """Power of each fin (..., n) [W], by two measures."""

    inertial: Array
    """|I alpha omega|, the paper's: what turns the fin's own inertia, braking counted like driving."""
    driving: Array
    """max(tau omega, 0), inertia, carried water and drag together, nothing won back by braking, and the heat
    in the motor's windings, copper_loss tau^2: what a battery gives, but for the electronics."""


def fin_power(speed: Array, acceleration: Array, blade: Blade, copper_loss: float = COPPER_LOSS) -> FinPower:
    """The power of fins with angular speeds (..., n) [rad/s] and accelerations (..., n) [rad/s^2]; the torque
    is that of a rigid plate in still water, and `copper_loss` the heat in its motor [W/(N m)^2]."""
    torque = blade.inertia * acceleration + blade.drag * speed * np.abs(speed)
    mechanical = np.maximum(torque * speed, 0.0)
    inertial = np.abs(blade.own_inertia * acceleration * speed)
    return FinPower(inertial, mechanical + copper_loss * torque * torque)
