"""How the actuators of a robot follow their commands: for simulation, observer and monitor."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.layout import Fin, Layout
from finlab.layout.angles import is_full_turn
from finlab.vehicle.fin_lag import FinLag
from finlab.vehicle.first_order import FirstOrder

USED = 0.2
"""Share of its range that a command usually changes by."""


class ActuatorMotion:
    """What the actuators of one layout do if they follow as they should; commands are (n, 3)."""

    def __init__(self, layout: Layout, fins: FinLag | None = None) -> None:
        """Starts at rest; `fins` follows the fins, by default without what happens within the beat."""
        is_fin = np.array([isinstance(part, Fin) for part in layout.actuators])
        self.of_fins, self.of_others = np.flatnonzero(is_fin), np.flatnonzero(~is_fin)
        """Places of the fins and of the others."""
        self.fins = FinLag(layout) if fins is None else fins
        self.others = FirstOrder([part for part in layout.actuators if not isinstance(part, Fin)])
        self._held = np.array([part.HELD for part in layout.actuators])
        self._places = np.arange(layout.n)
        self._working = np.ones(layout.n, bool)
        widths = (layout.upper - layout.lower)[self._places, self._held]
        self.angles: NDArray[np.bool_] = np.array([part.type != "thruster" for part in layout.actuators])
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
        result[self.of_fins], result[self.of_others] = of_fins, of_others
        return result

    @property
    def command(self) -> Array:
        """What the actuators do now, as a command (n, 3); a copy."""
        return self.joined(self.fins.command, self.others.value)

    @property
    def pushes(self) -> NDArray[np.bool_]:
        """Which actuators (n,) may give a force: fins that beat, whatever the law says of others, and all
        others but those that have stopped."""
        result = self._working.copy()
        result[self.of_fins] = self.fins.value[0] * self.fins.value[1] > 0.0
        return result

    @property
    def direction(self) -> Array:
        """Where each actuator (n,) would stay if it stuck: a fin's zero direction, the angle of an azimuth or
        of a rudder [rad], a thruster's force [N]."""
        others = self.others.value[np.arange(len(self.of_others)), self._held[self.of_others]]
        return self.joined(self.fins.value[2], others)

    def held_part(self, command: Array) -> Array:
        """The parts (..., n) of commands (..., n, 3) that stay where an actuator sticks."""
        part: Array = command[..., self._places, self._held]
        return part

    def turned_to(self, command: Array, direction: Array) -> Array:
        """Commands (..., n, 3) whose held parts are those of `direction` (..., n) where it is not NaN."""
        result = command.copy()
        kept = np.where(np.isnan(direction), self.held_part(result), direction)
        result[..., self._places, self._held] = kept
        return result


@lru_cache(maxsize=256)
def following_delay(layout: Layout) -> float:
    """How late the slowest actuator of a robot is [s]: 2 / p of a fin's double pole p; of others the time
    constant, and the time in which it comes through a fifth of its range at its rate."""
    delays = [2.0 / layout.servo_poles.min()] if layout.n_fins else []
    for part in layout.actuators:
        if not isinstance(part, Fin):
            ranges = zip(part.lower, part.upper, part.rates, strict=True)
            delays.append(part.time_constant + max(USED * (high - low) / rate for low, high, rate in ranges))
    return float(max(delays))
