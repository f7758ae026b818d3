"""How fins follow their commands: critically damped filters, and a servo whose speed flapping takes up.

Amplitude, frequency and zero direction each follow their command through the filters of
`finlab.layout.Servo`, exactly for a command that stays over the step.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.angles import TURN, is_full_turn


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


class FinLag:
    """What the n fins of one layout do if they follow as they should: enough for whoever watches ten times a
    second. `FinMotion` adds what happens within the beat."""

    def __init__(self, layout: Layout) -> None:
        """Starts at rest: no amplitude, no frequency, zero directions at the middle of their arcs."""
        lower, upper = np.array([fin.limits.zero_direction for fin in layout.fins]).reshape(-1, 2).T
        self._turns_fully = is_full_turn(upper - lower)
        self._poles = np.ascontiguousarray(layout.servo_poles.reshape(-1, 3).T)
        self._fastest_swing = layout.speed_limit / TURN
        self.value = np.zeros((3, layout.n_fins))
        """Half amplitude [rad], frequency [Hz] and zero direction [rad], counted on over the seam (3, n)."""
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
        """Follows a command (n, 3) for `dt` [s]; a fin whose row is NaN stops at once and hangs still."""
        self._follow(command, dt)

    def _follow(self, command: Array, dt: float) -> NDArray[np.bool_] | None:
        """Takes the step; returns which fins (n,) hang still, or None where all follow."""
        if dt != self._dt:
            self._dt, self._lag = dt, LagStep.of(self._poles, dt)
        before, aim = self.value, command.T.copy()
        lost = np.isnan(aim[0])
        some_lost = bool(lost.any())
        if some_lost:
            aim[:, lost] = before[:, lost]
        np.minimum(aim[0], self._fastest_swing / np.maximum(aim[1], 1e-9), out=aim[0])
        turn = aim[2] - before[2]
        aim[2] = before[2] + np.where(self._turns_fully, turn - TURN * np.rint(turn / TURN), turn)
        value, rate = self._lag.follow(before, self.rate, aim)
        np.minimum(value[0], self._fastest_swing / np.maximum(value[1], 1e-9), out=value[0])
        if some_lost:
            value[:2, lost], value[2, lost], rate[:, lost] = 0.0, before[2, lost], 0.0
        self.value, self.rate = value, rate
        return lost if some_lost else None
