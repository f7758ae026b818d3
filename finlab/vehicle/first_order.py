"""How thrusters, azimuths, tilts and rudders follow their commands: to first order, within their rates.

A command x with the time constant T and the rate r follows its aim x* by x' = (x* - x) / T, but no faster
than r; exactly for an aim that stays over the step. The angle of an azimuth has a rate alone.
"""

from collections.abc import Sequence

import numpy as np

from finlab.arrays import Array
from finlab.layout import Azimuth, Rudder, Thruster
from finlab.layout.angles import TURN, is_full_turn

AT_ONCE, UNLIMITED = 1e-9, 1e12
"""Time constant [s] and rate [per s] of what follows at once."""


class FirstOrder:
    """m actuators that are no fins; commands (m, 3) are those of the layout."""

    def __init__(self, actuators: Sequence[Thruster | Azimuth | Rudder]) -> None:
        """Starts at rest: no force, angles as near to 0 as their arcs allow."""
        m = len(actuators)
        self._rate = np.minimum(np.array([each.rates for each in actuators]).reshape(m, 3), UNLIMITED)
        self._time_constant = np.full((m, 3), AT_ONCE)
        self._circles, self._angles = np.zeros((m, 3), bool), np.zeros((m, 3), bool)
        self.value = np.zeros((m, 3))
        """What they do now (m, 3); angles are counted on over the seam."""
        for i, each in enumerate(actuators):
            self._time_constant[i, each.LAGS] = each.time_constant
            if isinstance(each, Thruster):
                continue
            low, high = each.lower[0], each.upper[0]
            self._angles[i, 0], self._circles[i, 0] = True, is_full_turn(high - low)
            self.value[i, 0] = min(max(0.0, low), high)
        self._corner = self._rate * self._time_constant
        self.before = self.value
        """The same before the last step."""

    def step(self, command: Array, dt: float) -> None:
        """Follows a command (m, 3) for `dt` [s]; one whose row is NaN stops at once and does not turn."""
        self.before = value = self.value
        error = command - value
        error = np.where(self._circles, error - TURN * np.rint(error / TURN), error)
        size = np.abs(error)
        run = np.minimum(np.maximum(size - self._corner, 0.0) / self._rate, dt)
        left = (size - run * self._rate) * np.exp((run - dt) / self._time_constant)
        stopped = np.where(self._angles, value, 0.0)
        self.value = np.where(np.isnan(command), stopped, value + np.sign(error) * (size - left))
