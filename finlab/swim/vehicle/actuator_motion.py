"""Actuators that follow their commands: for simulation, observer and monitor."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.axes import TURN, is_full_turn
from finlab.layout import Actuator, Layout
from finlab.swim.vehicle.fin_motion import FinLag

AT_ONCE, UNLIMITED = 1e-9, 1e12
"""Time constant [s] and rate [per s] of what follows at once."""


class FirstOrder:
    """m actuators that are no fins; commands (m, 3) are those of the layout."""

    def __init__(self, actuators: Sequence[Actuator]) -> None:
        """Starts at rest: no force, angles as near to 0 as their arcs allow."""
        m = len(actuators)
        self._rate = np.minimum(
            np.array([each.rates for each in actuators]).reshape(m, 3), UNLIMITED
        )
        self._time_constant = np.full((m, 3), AT_ONCE)
        self._circles = np.zeros((m, 3), bool)
        self._angles = np.zeros((m, 3), bool)
        self.value = np.zeros((m, 3))
        """What they do now (m, 3); angles are counted on over the seam."""
        for i, each in enumerate(actuators):
            self._time_constant[i, each.KIND.lagging_number] = getattr(
                each, "time_constant", AT_ONCE
            )
            if not each.KIND.sticks_at_angle:
                continue
            low = each.lower[0]
            high = each.upper[0]
            self._angles[i, 0] = True
            self._circles[i, 0] = is_full_turn(high - low)
            self.value[i, 0] = min(max(0.0, low), high)
        self._corner = self._rate * self._time_constant
        self.before = self.value
        """The same before the last step."""

    def step(self, command: Array, dt: float) -> None:
        """Follows a command (m, 3) for `dt` [s]; one whose row is NaN stops at once and does not
        turn."""
        self.before = value = self.value
        error = command - value
        error = np.where(self._circles, error - TURN * np.rint(error / TURN), error)
        size = np.abs(error)
        run = np.minimum(np.maximum(size - self._corner, 0.0) / self._rate, dt)
        left = (size - run * self._rate) * np.exp((run - dt) / self._time_constant)
        stopped = np.where(self._angles, value, 0.0)
        self.value = np.where(np.isnan(command), stopped, value + np.sign(error) * (size - left))


class ActuatorMotion:
    """What the actuators of one layout do if they follow as they should; commands are (n, 3)."""

    def __init__(self, layout: Layout, fins: FinLag | None = None) -> None:
        """Starts at rest; `fins` follows the fins, by default without what happens within the
        beat."""
        self.of_fins, self.of_others = np.flatnonzero(layout.is_fin), np.flatnonzero(~layout.is_fin)
        """Places of the fins and of the others."""
        self.fins = FinLag(layout) if fins is None else fins
        self.others = FirstOrder([layout.actuators[i] for i in self.of_others])
        self._held = np.array([part.KIND.stuck_number for part in layout.actuators])
        self._places = np.arange(layout.n)
        self._working = np.ones(layout.n, bool)
        widths = (layout.upper - layout.lower)[self._places, self._held]
        self.angles: NDArray[np.bool_] = np.array(
            [part.KIND.sticks_at_angle for part in layout.actuators]
        )
        """Which actuators (n,) have an angle that stays where they stick."""
        self.turns_fully: NDArray[np.bool_] = self.angles & is_full_turn(widths)
        """Which actuators (n,) may come to any direction."""

    def step(self, command: Array, dt: float) -> None:
        """Follows a command (n, 3) for `dt` [s]; an actuator whose row is NaN stops at once."""
        if not len(self.of_others):
            return self.fins.step(command, dt)
        self._working = np.isfinite(command[:, 0])
        if len(self.of_fins):
            self.fins.step(command[self.of_fins], dt)
        self.others.step(command[self.of_others], dt)

    def joined(self, of_fins: Array, of_others: Array) -> Array:
        """Values (n, ...) of all actuators, of those of the fins and of the others."""
        if not len(self.of_others):
            return of_fins
        result = np.empty((len(self._places), *of_others.shape[1:]))
        result[self.of_fins] = of_fins
        result[self.of_others] = of_others
        return result

    @property
    def command(self) -> Array:
        """What the actuators do now, as a command (n, 3); a copy."""
        return self.joined(self.fins.command, self.others.value)

    @property
    def pushes(self) -> NDArray[np.bool_]:
        """Which actuators (n,) may give a force: fins that beat, whatever the law says of others,
        and all others but those that have stopped."""
        result = self._working.copy()
        result[self.of_fins] = self.fins.value[0] * self.fins.value[1] > 0.0
        return result

    @property
    def direction(self) -> Array:
        """Where each actuator (n,) would stay if it stuck: a fin's zero direction, another one's
        angle [rad], or a force [N]."""
        others = self.others.value[np.arange(len(self.of_others)), self._held[self.of_others]]
        return self.joined(self.fins.value[2], others)

    def held_part(self, command: Array) -> Array:
        """The parts (..., n) of commands (..., n, 3) that stay where an actuator sticks."""
        part: Array = command[..., self._places, self._held]
        return part

    def turned_to(self, command: Array, direction: Array) -> Array:
        """Commands (..., n, 3) whose held parts are those of `direction` (..., n) where it is not
        NaN."""
        result = command.copy()
        kept = np.where(np.isnan(direction), self.held_part(result), direction)
        result[..., self._places, self._held] = kept
        return result
