"""How fins follow their commands (second-order lag, the servo's speed limit, flapping), and their power.

Amplitude, frequency and zero direction each follow their command through the critically damped filters of
`finlab.layout.Servo`. A fin that is given another frequency goes on from where it is in its beat.
"""

import math
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.angles import TURN, is_full_turn
from finlab.physics.blade import COPPER_LOSS, Blade

CREEP = 0.1
"""Share of its speed that a servo turns its fin with, however fast that flaps."""


class LagStep(NamedTuple):
    """The exact step of critically damped filters towards aims that stay: for an error e = x - aim,
    e <- kept e + carried x' and x' <- driven e + slowed x'."""

    kept: Array
    """Share of the error that is left."""
    carried: Array
    """What the rate adds to it [s]."""
    driven: Array
    """What the error adds to the rate [1/s]."""
    slowed: Array
    """Share of the rate that is left."""

    @classmethod
    def of(cls, pole: Array, dt: float) -> "LagStep":
        """The step over `dt` [s] of filters with double poles [rad/s], of any shape."""
        decay = np.exp(-pole * dt)
        return cls((1.0 + pole * dt) * decay, dt * decay, -(pole**2) * dt * decay, (1.0 - pole * dt) * decay)

    def follow(self, value: Array, rate: Array, aim: Array) -> tuple[Array, Array]:
        """Values and rates after the step."""
        error = value - aim
        return aim + self.kept * error + self.carried * rate, self.driven * error + self.slowed * rate


class FinMotion:
    """Angles of the fins of one layout over time; all arrays are (n,)."""

    def __init__(self, layout: Layout) -> None:
        """Starts at rest: no amplitude, no frequency, zero directions at the middle of their arcs."""
        lower, upper = layout.lower[:, 2], layout.upper[:, 2]
        self._turns_fully = is_full_turn(upper - lower)
        self._poles = np.ascontiguousarray(layout.servo_poles.T)
        self._speed_limit = layout.speed_limit
        self._creep = CREEP * self._speed_limit
        # Half amplitude [rad], frequency [Hz], zero direction [rad] counted on over the seam; rates per s.
        self._value = np.zeros((3, layout.n_fins))
        self._value[2] = 0.5 * (lower + upper)
        self._before = self._value
        self._rate = np.zeros((3, layout.n_fins))
        self._change = np.zeros((3, layout.n_fins))
        self.phase = np.zeros(layout.n_fins)
        """Phase of the flapping [rad]."""
        self._dt = math.nan
        self._lag: LagStep

    def step(self, command: Array, dt: float) -> None:
        """Follows a command (n, 3) for `dt` [s]; a fin whose row is NaN stops at once and hangs still."""
        if dt != self._dt:
            self._dt, self._lag = dt, LagStep.of(self._poles, dt)
        before, aim = self._value, command.T.copy()
        lost = np.isnan(aim[0])
        some_lost = bool(lost.any())
        if some_lost:
            aim[:, lost] = before[:, lost]
        aim[0] = np.minimum(aim[0], self._speed_limit / (TURN * np.maximum(aim[1], 1e-9)))
        turn = aim[2] - before[2]
        aim[2] = before[2] + np.where(self._turns_fully, turn - TURN * np.rint(turn / TURN), turn)
        value, rate = self._lag.follow(before, self._rate, aim)
        swing = TURN * value[1]
        # What flapping leaves of the servo's speed is there to turn the fin.
        value[0] = np.minimum(value[0], self._speed_limit / np.maximum(swing, 1e-9))
        spare = np.maximum(self._speed_limit - value[0] * swing, self._creep)
        turned = np.minimum(np.maximum(value[2] - before[2], -spare * dt), spare * dt)
        value[2] = before[2] + turned
        rate[2] = np.minimum(np.maximum(rate[2], -spare), spare)
        if some_lost:
            value[:2, lost], value[2, lost], rate[:, lost] = 0.0, before[2, lost], 0.0
            before = np.where(lost, value, before)
        self.phase = np.mod(self.phase + (0.5 * TURN * dt) * (before[1] + value[1]), TURN)
        self._change = (rate - self._rate) / dt
        self._before, self._value, self._rate = before, value, rate

    @property
    def amplitude(self) -> Array:
        """Half amplitude [rad]; a view, and so are the next four."""
        amplitude: Array = self._value[0]
        return amplitude

    @property
    def frequency(self) -> Array:
        """[Hz]."""
        frequency: Array = self._value[1]
        return frequency

    @property
    def direction(self) -> Array:
        """Zero direction [rad], counted on over the seam."""
        direction: Array = self._value[2]
        return direction

    @property
    def amplitude_rate(self) -> Array:
        """[rad/s]."""
        rate: Array = self._rate[0]
        return rate

    @property
    def direction_rate(self) -> Array:
        """[rad/s]."""
        rate: Array = self._rate[2]
        return rate

    @property
    def command(self) -> Array:
        """What the fins do now, as a command (n, 3); a copy."""
        command: Array = self._value.T.copy()
        return command

    @property
    def mean_command(self) -> Array:
        """The same as a mean over the last step (n, 3)."""
        command: Array = 0.5 * (self._before + self._value).T
        return command

    @property
    def angle(self) -> Array:
        """The fins' angles [rad]: theta = A sin(phase) + zero direction."""
        return self.amplitude * np.sin(self.phase) + self.direction

    @property
    def speed(self) -> Array:
        """The fins' angular speeds [rad/s]."""
        swing = TURN * self.frequency
        return (
            self.direction_rate
            + self.amplitude_rate * np.sin(self.phase)
            + self.amplitude * swing * np.cos(self.phase)
        )

    def speed_and_acceleration(self) -> tuple[Array, Array]:
        """The fins' angular speeds [rad/s] and accelerations [rad/s^2], those of servos that change their aim
        as means over the last step."""
        sine, cosine = np.sin(self.phase), np.cos(self.phase)
        swing = TURN * self._value[1]
        fast, growth = self._value[0] * swing, self._rate[0]
        speed = self._rate[2] + growth * sine + fast * cosine
        acceleration = (
            self._change[2]
            + (self._change[0] - fast * swing) * sine
            + (2.0 * growth * swing + (TURN * self._value[0]) * self._rate[1]) * cosine
        )
        return speed, acceleration


class FinPower(NamedTuple):
    """Power of each fin (..., n) [W], by three measures."""

    inertial: Array
    """|I alpha omega|, the paper's: what turns the fin's own inertia, braking counted like driving."""
    torque: Array
    """max(tau omega, 0): inertia, carried water and drag together, nothing won back by braking."""
    driving: Array
    """The same and the heat in the motor's windings, copper_loss tau^2: what a battery gives, but for the
    electronics. Its mean over a steady beat is `Blade.driving_power`."""


def fin_power(speed: Array, acceleration: Array, blade: Blade, copper_loss: float = COPPER_LOSS) -> FinPower:
    """The power of fins with angular speeds (..., n) [rad/s] and accelerations (..., n) [rad/s^2]; the torque
    is that of a rigid plate in still water, and `copper_loss` the heat in its motor [W/(N m)^2]."""
    torque = blade.inertia * acceleration + blade.drag * speed * np.abs(speed)
    mechanical = np.maximum(torque * speed, 0.0)
    inertial = np.abs(blade.own_inertia * acceleration * speed)
    return FinPower(inertial, mechanical, mechanical + copper_loss * torque * torque)
