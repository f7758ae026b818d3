"""How fins should follow their commands: the filters of `finlab.physics.fin_motion` in one step per period.

`FinMotion` simulates angles, phases and the servo's limit in small steps; whoever watches ten times a second
needs the amplitude and the direction at the end of a period alone.
"""

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.angles import TURN, is_full_turn
from finlab.physics.fin_motion import Servo


class NominalLag:
    """Fins of one layout that follow as they should."""

    def __init__(self, layout: Layout, period_s: float, servo: Servo | None = None) -> None:
        """Takes the layout, the time between steps [s] and what drives the fins."""
        servo = Servo() if servo is None else servo
        n = layout.n_fins
        lower, upper = layout.lower[:, 2], layout.upper[:, 2]
        self._full = is_full_turn(upper - lower)
        pole = np.repeat([[servo.amplitude_pole], [servo.direction_pole]], n, axis=1)
        decay = np.exp(-pole * period_s)
        # Exact step of x'' = -2 pole x' - pole^2 (x - aim): new error and rate from the old ones.
        self._kept, self._carried = (1.0 + pole * period_s) * decay, period_s * decay
        self._driven, self._slowed = -(pole**2) * period_s * decay, (1.0 - pole * period_s) * decay
        self._swing = servo.speed_limit / TURN
        self._value = np.stack([np.zeros(n), 0.5 * (lower + upper)])
        self._rate = np.zeros((2, n))
        self.motion = np.zeros((n, 3))
        """What the fins do (n, 3) [rad, Hz, rad]."""

    @property
    def direction(self) -> Array:
        """Zero directions (n,) [rad], counted on over the seam."""
        direction: Array = self._value[1]
        return direction

    def step(self, command: Array) -> Array:
        """Follows a command (n, 3) for one period; returns what the fins do (n, 3). NaN rows hang still."""
        rests = np.isnan(command[:, 0])
        some_rest = bool(rests.any())
        known = np.where(rests[:, None], 0.0, command) if some_rest else command
        aim = np.empty_like(self._value)
        np.minimum(known[:, 0], self._swing / np.maximum(known[:, 1], 1e-9), out=aim[0])
        turn = known[:, 2] - self._value[1]
        aim[1] = self._value[1] + np.where(self._full, turn - TURN * np.round(turn / TURN), turn)
        error = self._value - aim
        value = aim + self._kept * error + self._carried * self._rate
        rate = self._driven * error + self._slowed * self._rate
        if some_rest:
            value[0, rests], value[1, rests], rate[:, rests] = 0.0, self._value[1, rests], 0.0
        self._value, self._rate = value, rate
        result = np.empty_like(command)
        result[:, 0], result[:, 1], result[:, 2] = value[0], known[:, 1], value[1]
        self.motion = result
        return result
