"""Fins that follow their commands, from beat to beat and within the beat, and their power.

Amplitude, frequency and zero direction each follow their command through the filters of
`finlab.layout.Servo`, exactly for a command that stays over the step. A fin that is given another
frequency goes on from where it is in its beat.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.law import Blade
from finlab.arrays import Array
from finlab.axes import TURN, is_full_turn
from finlab.layout import Layout

TURN_SHARE_MIN = 0.1
"""Share of its speed that a servo turns its fin with, however fast that flaps."""

COPPER_LOSS = 0.5
"""Heat in the windings of a fin's motor [W/(N m)^2]: `copper_loss` of a robot that swims in
simulation. Our choice, as nothing is published of U-CAT's drives: a motor of 60 W whose windings
take 730 W/(N m)^2 at its own shaft (7 rpm per mN m) behind a gear of 50 : 1 at 80 %, with which its
fin turns twice a second."""


class LagStep(NamedTuple):
    """The exact step of critically damped filters, x'' = -2 p x' - p^2 e, towards constant targets.

    With the error e = x - target, the double pole p and the length h of the step, its transition
    matrix is

        (e, x') <- exp(-p h) [[1 + p h, h], [-p^2 h, 1 - p h]] (e, x')
    """

    error_by_error: Array
    error_by_rate: Array
    """[s]."""
    rate_by_error: Array
    """[1/s]."""
    rate_by_rate: Array

    @classmethod
    def of(cls, pole: Array, dt: float) -> "LagStep":
        """Returns the step of filters.

        Args:
            pole: p [rad/s], of any shape.
            dt: h, length of the step [s].
        """
        decay = np.exp(-pole * dt)
        return cls(
            error_by_error=(1.0 + pole * dt) * decay,
            error_by_rate=dt * decay,
            rate_by_error=-(pole**2) * dt * decay,
            rate_by_rate=(1.0 - pole * dt) * decay,
        )

    def follow(self, value: Array, rate: Array, target: Array) -> tuple[Array, Array]:
        """Returns values and rates after the step, all arguments of the poles' shape."""
        error = value - target
        value_after = target + self.error_by_error * error + self.error_by_rate * rate
        rate_after = self.rate_by_error * error + self.rate_by_rate * rate
        return value_after, rate_after


class FinLag:
    """What the n fins of one layout do if they follow as they should: enough for whoever watches
    ten times a second. `FinMotion` adds what happens within the beat."""

    def __init__(self, layout: Layout) -> None:
        """Starts at rest: no amplitude, no frequency, zero directions at the middle of their
        arcs."""
        lower, upper = np.array([fin.limits.zero_direction for fin in layout.fins]).reshape(-1, 2).T
        self._turns_fully = is_full_turn(upper - lower)
        self._poles = np.ascontiguousarray(layout.servo_poles.reshape(-1, 3).T)
        self._max_swing = layout.speed_limit / TURN  # largest A f [rad/s]
        self.value = np.zeros((3, layout.n_fins))
        """Half amplitude [rad], frequency [Hz] and zero direction [rad], counted on over the seam
        (3, n)."""
        self.value[2] = 0.5 * (lower + upper)
        self.rate = np.zeros((3, layout.n_fins))
        """The same per second (3, n)."""
        self._dt = math.nan
        self._lag: LagStep

    @property
    def command(self) -> Array:
        """What the fins do now, as a command (n, 3) [rad, Hz, rad]; a copy."""
        return self.value.T.copy()

    def step(self, command: Array, dt: float) -> None:
        """Follows a command over a step.

        Args:
            command: (n, 3) [rad, Hz, rad]; a fin whose row is NaN stops at once and hangs still.
            dt: length of the step [s].
        """
        self._follow(command, dt)

    def _follow(self, command: Array, dt: float) -> NDArray[np.bool_] | None:
        """Takes the step; returns which fins (n,) hang still, or None where all follow."""
        if dt != self._dt:
            self._dt = dt
            self._lag = LagStep.of(self._poles, dt)
        before = self.value
        target = command.T.copy()
        lost = np.isnan(target[0])
        some_lost = bool(lost.any())
        if some_lost:
            target[:, lost] = before[:, lost]
        # A f is bounded by the servo's speed, before the filter and behind it.
        np.minimum(target[0], self._max_swing / np.maximum(target[1], 1e-9), out=target[0])
        turn = target[2] - before[2]
        shorter_turn = turn - TURN * np.rint(turn / TURN)
        target[2] = before[2] + np.where(self._turns_fully, shorter_turn, turn)
        value, rate = self._lag.follow(before, self.rate, target)
        np.minimum(value[0], self._max_swing / np.maximum(value[1], 1e-9), out=value[0])
        if some_lost:
            value[:2, lost] = 0.0
            value[2, lost] = before[2, lost]
            rate[:, lost] = 0.0
        self.value = value
        self.rate = rate
        return lost if some_lost else None


class FinMotion(FinLag):
    """Angles of the fins of one layout over time, in steps much shorter than a beat; all arrays are
    (n,)."""

    def __init__(self, layout: Layout) -> None:
        """Starts at rest, as `FinLag`."""
        super().__init__(layout)
        self._speed_limit = layout.speed_limit
        self._min_turn_speed = TURN_SHARE_MIN * self._speed_limit
        self._before = self.value
        self._acceleration = np.zeros((3, layout.n_fins))
        self.phase = np.zeros(layout.n_fins)
        """Phase of the flapping [rad]."""

    def step(self, command: Array, dt: float) -> None:
        """Follows a command as `FinLag`, within the beat."""
        before = self.value
        rate_before = self.rate
        lost = self._follow(command, dt)
        value = self.value
        rate = self.rate
        # What flapping leaves of the servo's speed is there to turn the fin.
        swing = value[0] * (TURN * value[1])
        turn_speed = np.maximum(self._speed_limit - swing, self._min_turn_speed)
        turn = np.minimum(np.maximum(value[2] - before[2], -turn_speed * dt), turn_speed * dt)
        value[2] = before[2] + turn
        rate[2] = np.minimum(np.maximum(rate[2], -turn_speed), turn_speed)
        if lost is not None:
            before = np.where(lost, value, before)
        self.phase = np.mod(self.phase + (0.5 * TURN * dt) * (before[1] + value[1]), TURN)
        self._acceleration = (rate - rate_before) / dt
        self._before = before

    @property
    def mean_command(self) -> Array:
        """`command` as a mean over the last step (n, 3)."""
        command: Array = 0.5 * (self._before + self.value).T
        return command

    @property
    def angle(self) -> Array:
        """The fins' angles [rad]: theta = A sin(phase) + zero direction (the paper's Eq. 1)."""
        return np.asarray(self.value[0] * np.sin(self.phase) + self.value[2])

    def speed_and_acceleration(self) -> tuple[Array, Array]:
        """Returns the fins' angular speeds (n,) [rad/s] and accelerations (n,) [rad/s^2]; those by
        changes of the command are means over the last step."""
        # theta = A sin(phase) + phi, phase' = omega: differentiated twice
        amplitude, frequency, _ = self.value
        amplitude_rate, frequency_rate, phi_rate = self.rate
        amplitude_acceleration, _, phi_acceleration = self._acceleration
        omega = TURN * frequency
        swing = amplitude * omega
        sine = np.sin(self.phase)
        cosine = np.cos(self.phase)
        speed = phi_rate + amplitude_rate * sine + swing * cosine
        by_sine = amplitude_acceleration - swing * omega
        by_cosine = 2.0 * amplitude_rate * omega + (TURN * amplitude) * frequency_rate
        acceleration = phi_acceleration + by_sine * sine + by_cosine * cosine
        return speed, acceleration


class FinPower(NamedTuple):
    """Power of each fin (..., n) [W], by two measures."""

    inertial: Array
    """|I alpha omega|, the paper's: what turns the fin's own inertia, braking counted like
    driving."""
    driving: Array
    """max(tau omega, 0), inertia, carried water and drag together, nothing won back by braking, and
    the heat in the motor's windings, copper_loss tau^2: what a battery gives, but for the
    electronics."""


def fin_power(
    speed: Array, acceleration: Array, blade: Blade, copper_loss: float = COPPER_LOSS
) -> FinPower:
    """Returns the power of fins; the torque is that of a rigid plate in still water.

    Args:
        speed: angular speeds omega (..., n) [rad/s].
        acceleration: angular accelerations alpha (..., n) [rad/s^2].
        blade: inertia and drag of the fins, each (n,).
        copper_loss: heat in a motor's windings [W/(N m)^2].
    """
    torque = blade.inertia * acceleration + blade.drag * speed * np.abs(speed)
    mechanical = np.maximum(torque * speed, 0.0)
    inertial = np.abs(blade.own_inertia * acceleration * speed)
    return FinPower(inertial, mechanical + copper_loss * torque * torque)
