"""How fins follow their commands (second-order lag, the servo's speed limit, flapping), and their power.

Amplitude and zero direction each follow their command through a critically damped filter
x'' = k (k/4 (x* - x) - x'), a double pole at k/2. The gains are those of the oscillators that drive the fins
in U-CAT's open simulator (eeUVsim: k = 15 for the amplitude, 7 for the zero direction). Frequency changes at
once, with the phase kept.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.angles import is_full_turn, wrapped
from finlab.physics.blade import Blade


@dataclass(frozen=True)
class Servo:
    """What drives one fin."""

    amplitude_pole: float = 7.5
    """Double pole of the amplitude [rad/s]; eeUVsim's k_amp = 15."""
    direction_pole: float = 3.5
    """Double pole of the zero direction [rad/s]; eeUVsim's k_zd = 7."""
    speed_limit: float = 4 * math.pi
    """Fastest that the fin turns [rad/s]; two turns a second in U-CAT's UWSim plug-in. It cuts the amplitude
    of fast flapping and slows the turning of a fin that flaps."""


class FinMotion:
    """Angles of the fins of one layout over time; all arrays are (n,)."""

    def __init__(self, layout: Layout, servo: Servo | None = None) -> None:
        """Starts at rest: no amplitude, zero directions at the middle of their arcs."""
        self.servo = Servo() if servo is None else servo
        lower, upper = layout.lower[:, 2], layout.upper[:, 2]
        self._turns_fully = is_full_turn(upper - lower)
        n = layout.n_fins
        self.amplitude = np.zeros(n)
        """Half amplitude [rad]."""
        self.amplitude_rate = np.zeros(n)
        """[rad/s]."""
        self.frequency = np.zeros(n)
        """[Hz]."""
        self.direction = 0.5 * (lower + upper)
        """Zero direction [rad], counted on over the seam."""
        self.direction_rate = np.zeros(n)
        """[rad/s]."""
        self.phase = np.zeros(n)
        """Phase of the flapping [rad]."""

    def step(self, command: Array, dt: float) -> None:
        """Follows a command (n, 3) for `dt` [s]; a fin whose row is NaN stops at once and hangs still."""
        lost = np.isnan(command[:, 0])
        known = np.where(lost[:, None], 0.0, command)
        self.frequency = known[:, 1]
        self.phase = np.mod(self.phase + 2 * math.pi * self.frequency * dt, 2 * math.pi)
        swing = 2 * math.pi * self.frequency
        aim = np.minimum(known[:, 0], self.servo.speed_limit / np.maximum(swing, 1e-9))
        self.amplitude, self.amplitude_rate = _follow(
            self.amplitude, self.amplitude_rate, aim, self.servo.amplitude_pole, dt
        )
        turn = known[:, 2] - self.direction
        turn = np.where(self._turns_fully, wrapped(turn), turn)
        before = self.direction
        after, rate = _follow(before, self.direction_rate, before + turn, self.servo.direction_pole, dt)
        # What flapping leaves of the servo's speed is there to turn the fin.
        spare = np.maximum(self.servo.speed_limit - self.amplitude * swing, 0.1 * self.servo.speed_limit)
        self.direction = before + np.clip(after - before, -spare * dt, spare * dt)
        self.direction_rate = np.clip(rate, -spare, spare)
        if lost.any():
            self.amplitude[lost] = self.amplitude_rate[lost] = self.direction_rate[lost] = 0.0
            self.direction[lost] = before[lost]

    @property
    def command(self) -> Array:
        """What the fins do now, as a command (n, 3)."""
        return np.stack([self.amplitude, self.frequency, self.direction], axis=-1)

    @property
    def angle(self) -> Array:
        """The fins' angles [rad]: theta = A sin(phase) + zero direction."""
        return self.amplitude * np.sin(self.phase) + self.direction

    @property
    def speed(self) -> Array:
        """The fins' angular speeds [rad/s]."""
        swing = 2 * math.pi * self.frequency
        return (
            self.direction_rate
            + self.amplitude_rate * np.sin(self.phase)
            + self.amplitude * swing * np.cos(self.phase)
        )

    @property
    def acceleration(self) -> Array:
        """The fins' angular accelerations [rad/s^2], those of the flapping; turning adds little."""
        swing = 2 * math.pi * self.frequency
        return swing * (
            2 * self.amplitude_rate * np.cos(self.phase) - self.amplitude * swing * np.sin(self.phase)
        )


def _follow(value: Array, rate: Array, aim: Array, pole: float, dt: float) -> tuple[Array, Array]:
    """Exact step of the critically damped filter towards a constant aim."""
    error = value - aim
    slope = rate + pole * error
    decay = math.exp(-pole * dt)
    return aim + (error + slope * dt) * decay, (rate - pole * slope * dt) * decay


class FinPower(NamedTuple):
    """Power of each fin (n,) [W] at one moment, by two measures."""

    inertial: Array
    """|I alpha omega|, the paper's: what turns the fin's own inertia, braking counted like driving."""
    torque: Array
    """max(tau omega, 0): inertia, carried water and drag together, nothing won back by braking."""


def fin_power(motion: FinMotion, blade: Blade) -> FinPower:
    """The power of fins as they move now; the torque is that of a rigid plate in still water."""
    speed, acceleration = motion.speed, motion.acceleration
    torque = blade.inertia * acceleration + blade.drag * speed * np.abs(speed)
    return FinPower(np.abs(blade.own_inertia * acceleration * speed), np.maximum(torque * speed, 0.0))
