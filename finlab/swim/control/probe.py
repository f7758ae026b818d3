"""Pushes that keep actuators known: small steady ones of fins that rest, and short ones of those
that are called lost or stuck."""

import math

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.axes import is_full_turn
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.swim.control.monitor_settings import MonitorSettings

PROBE_FORCE_N = 0.6
"""Force of a whole fin that is probed [N], or what it can give if that is less."""
THRUSTER_SHARE = 0.1
"""Force of a thruster that is probed, as a share of its largest."""
STUCK_FACTOR = -0.5
"""Force of a thruster that is called stuck and probed, over the force at which it is stuck. So one
that is stuck, whole, lost or reversed each gives something else."""
STUCK_SHARE = 0.03
"""Least size of that, as a share of its largest force."""
PROBE_S = 2.0
"""How long a probe lasts [s]; a fin takes half a second to swing up, and a whole one to turn."""
BUSY_FACTOR = 1.5
"""A fin is busy when it is commanded to push this many times the least."""
FINS_MIN = 3
"""Working fins from which on those that would rest push a little: two have none to spare, and would
lead the robot off its course."""
TABLE_SIZE = 24
"""Frequencies at which the thrust is tabulated."""


class Probe:
    """Pushes for the fins of one layout, up or down: that heels the hull, which its gyros feel at
    once and its weight rights again, and hardly moves it from its course."""

    def __init__(self, layout: Layout, settings: MonitorSettings, period_s: float) -> None:
        """Prepares for a robot.

        Args:
            layout: the robot.
            settings: how often and how strongly it may push.
            period_s: time between calls [s].
        """
        self._plant = plant_of(layout)
        self._amplitude = layout.lower[:, 0] + 0.75 * (layout.upper[:, 0] - layout.lower[:, 0])
        share = np.linspace(0.0, 1.0, TABLE_SIZE)[:, None]
        self._frequency = layout.lower[:, 1] + share * (layout.upper[:, 1] - layout.lower[:, 1])
        self._thrust = np.maximum.accumulate(self._plant.thrust(self._amplitude, self._frequency))
        self._lower = layout.lower[:, 2]
        self._upper = layout.upper[:, 2]
        self._turns_fully = is_full_turn(self._upper - self._lower)
        self._min_force = settings.least_push
        self._probe_every_ticks = round(settings.probe_every_s / period_s)
        self._probe_ticks = round(PROBE_S / period_s)
        self._side = np.zeros(layout.n)
        self._parts = layout.actuators
        self._is_fin = layout.is_fin
        self._has_fins = bool(layout.is_fin.any())
        self._count = 0

    def added(
        self, command: Array, tried: NDArray[np.bool_], direction: Array, stuck_at: Array
    ) -> Array:
        """The command (n, 3) with what is added to it.

        Args:
            command: of the allocator; NaN rows are left alone but for probes.
            tried: actuators (n,) that are probed, one at a time.
            direction: where the fins point (n,) [rad].
            stuck_at: forces (n,) at which thrusters are taken to be stuck [N]; NaN of all others.
        """
        result = command
        if self._min_force > 0.0 and self._has_fins:
            result = self._with_min_force(command)
        if self._probe_every_ticks == 0 or not tried.any():
            self._count = 0
            return result
        self._count += 1
        turn, tick = divmod(self._count, self._probe_every_ticks)
        if turn == 0 or tick >= self._probe_ticks:
            return result
        indices = np.flatnonzero(tried)
        k = int(indices[turn % len(indices)])
        result = result.copy()
        if math.isnan(stuck_at[k]):
            result[k] = self._probe_command(k, float(direction[k]))
        else:
            result[k] = (self._force_against(k, float(stuck_at[k])), 0.0, 0.0)
        return result

    def _force_against(self, index: int, stuck_at: float) -> float:
        """The force [N] by which a thruster is tried that is taken to be stuck at another one."""
        part = self._parts[index]
        low, high = part.lower[0], part.upper[0]
        size = max(abs(STUCK_FACTOR * stuck_at), STUCK_SHARE * max(high, -low))
        return min(max(math.copysign(size, STUCK_FACTOR * stuck_at), low), high)

    def _probe_command(self, index: int, direction: float) -> tuple[float, float, float]:
        """The command of one that is tried, which is or points at a direction [rad]."""
        part = self._parts[index]
        if self._is_fin[index]:
            return self._fin_command(index, 0.0, math.copysign(PROBE_FORCE_N, math.sin(direction)))
        row = [0.0, 0.0, 0.0]
        if part.KIND.force_number is not None:
            low = part.lower[part.KIND.force_number]
            high = part.upper[part.KIND.force_number]
            force = max(THRUSTER_SHARE * max(high, -low), 2.0 * getattr(part, "dead_band", 0.0))
            if part.KIND.sticks_at_angle:
                row[part.KIND.stuck_number] = direction
            row[part.KIND.force_number] = min(force, high) if high > 0.0 else max(-force, low)
        return row[0], row[1], row[2]

    def _with_min_force(self, command: Array) -> Array:
        """Fins that are commanded to push less than is needed to be known push more, each the other
        way than those before it, so that together they lift little; a side is kept until a fin is
        busy again."""
        known = np.isfinite(command[:, 0])
        force = self._plant.force(np.where(known[:, None], command, 0.0))
        ahead = force[:, 1]
        size = np.hypot(force[:, 1], force[:, 2])
        self._side[size > BUSY_FACTOR * self._min_force] = 0.0
        idle = np.flatnonzero(known & self._is_fin & (size < self._min_force))
        if not len(idle) or known.sum() < FINS_MIN:
            return command
        result = command.copy()
        for fin in idle.tolist():
            if self._side[fin] == 0.0:
                self._side[fin] = -1.0 if self._side.sum() > 0.0 else 1.0
            lift = float(self._side[fin]) * math.sqrt(self._min_force**2 - ahead[fin] ** 2)
            result[fin] = self._fin_command(fin, float(ahead[fin]), lift)
        return result

    def _fin_command(self, fin: int, ahead: float, up: float) -> tuple[float, float, float]:
        """What a fin has to do for a force [N] in its plane, about: by the thrust at zero direction
        0."""
        size = math.hypot(ahead, up)
        frequency = float(np.interp(size, self._thrust[:, fin], self._frequency[:, fin]))
        direction = math.atan2(up, ahead)
        if not self._turns_fully[fin]:
            direction = min(max(direction, float(self._lower[fin])), float(self._upper[fin]))
        return float(self._amplitude[fin]), frequency, direction
