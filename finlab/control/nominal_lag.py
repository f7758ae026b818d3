"""How fins should follow their commands: the filters of `finlab.physics.fin_motion` in one step per period.

`FinMotion` simulates angles, phases and the servo's limit in small steps; whoever watches ten times a second
needs what the fins do at the end of a period alone.
"""

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.angles import TURN, is_full_turn
from finlab.physics.fin_motion import LagStep


class NominalLag:
    """Fins of one layout that follow as they should."""

    def __init__(self, layout: Layout, period_s: float) -> None:
        """Takes the layout and the time between steps [s]."""
        lower, upper = layout.lower[:, 2], layout.upper[:, 2]
        self._full = is_full_turn(upper - lower)
        self._lag = LagStep.of(np.ascontiguousarray(layout.servo_poles.T), period_s)
        self._swing = layout.speed_limit / TURN
        # Amplitude, frequency and zero direction, and their rates, (3, n) each.
        self._value = np.zeros((3, layout.n_fins))
        self._value[2] = 0.5 * (lower + upper)
        self._rate = np.zeros((3, layout.n_fins))
        self.motion = np.zeros((layout.n_fins, 3))
        """What the fins do (n, 3) [rad, Hz, rad]."""

    @property
    def direction(self) -> Array:
        """Zero directions (n,) [rad], counted on over the seam."""
        direction: Array = self._value[2]
        return direction

    def step(self, command: Array) -> Array:
        """Follows a command (n, 3) for one period; returns what the fins do (n, 3). NaN rows hang still."""
        before, aim = self._value, command.T.copy()
        rests = np.isnan(aim[0])
        some_rest = bool(rests.any())
        if some_rest:
            aim[:, rests] = before[:, rests]
        np.minimum(aim[0], self._swing / np.maximum(aim[1], 1e-9), out=aim[0])
        turn = aim[2] - before[2]
        aim[2] = before[2] + np.where(self._full, turn - TURN * np.round(turn / TURN), turn)
        value, rate = self._lag.follow(before, self._rate, aim)
        np.minimum(value[0], self._swing / np.maximum(value[1], 1e-9), out=value[0])
        if some_rest:
            value[:2, rests], value[2, rests], rate[:, rests] = 0.0, before[2, rests], 0.0
        self._value, self._rate = value, rate
        self.motion = np.ascontiguousarray(value.T)
        return self.motion
