"""How far commands may move at a wrench: the drives' rates times the time that has really passed.

An allocator is prepared for one length of a tick, `period_s`. A sender that is quicker than that
would move the drives further than their rates allow, so that the robot is prepared for a half, a
quarter, ... of the period, too. Time is an account: it is paid in as it passes and is spent by
ticks, so that over any while the commands move by at most rates x (while + `ACCOUNT_PERIODS` x
period), and a sender whose period jitters is not slowed down.
"""

from dataclasses import replace

import numpy as np

from finlab.allocation.rates import Rates
from finlab.arrays import Array
from finlab.deploy.deployed_robot import DeployedRobot
from finlab.physics.plant import plant_of

ACCOUNT_PERIODS = 1.5
"""Most time that is kept, over the period: a wrench that comes half a period early still has a
whole one."""
SHORTEST_TICK_S = 4e-4
"""Ticks are not made shorter than this [s]: an answer takes about as long."""


class Ticks:
    """One robot, prepared for ticks of several lengths."""

    def __init__(self, robot: DeployedRobot, period_s: float, calm: float | None) -> None:
        """Prepares the robot.

        Args:
            robot: as it was read.
            period_s: length of a tick [s].
            calm: what turning costs; the robot's own setting when None.

        Raises:
            AllocationError: the robot's method has no such setting.
        """
        self.period_s = period_s
        settings = {} if calm is None else {"calm": calm}
        layout = robot.layout
        self._has_rates = bool(np.isfinite(layout.rates).any())
        self._plant = plant_of(layout)
        lengths = [period_s]
        while self._has_rates and 0.5 * lengths[-1] >= SHORTEST_TICK_S:
            lengths.append(0.5 * lengths[-1])
        self._robots: list[tuple[float, DeployedRobot]] = []
        for length in lengths:
            allocator = robot.allocator
            named = dict(settings)
            if "period_s" in vars(allocator.settings):
                named["period_s"] = length
            if named:
                allocator = allocator.with_settings(**named)
            self._robots.append((length, replace(robot, allocator=allocator)))
        self._account_s = ACCOUNT_PERIODS * period_s
        self._at_s: float | None = None

    @property
    def whole(self) -> DeployedRobot:
        """The robot prepared for a whole period."""
        return self._robots[0][1]

    def spend(self, now_s: float) -> tuple[float, DeployedRobot]:
        """Takes the longest tick that there is time for.

        Args:
            now_s: now [s]; a clock that goes back pays nothing in.

        Returns:
            Its length [s], and the robot prepared for it.
        """
        if not self._has_rates:
            return self._robots[0]
        passed_s = 0.0 if self._at_s is None else max(now_s - self._at_s, 0.0)
        self._at_s = now_s
        self._account_s = min(self._account_s + passed_s, ACCOUNT_PERIODS * self.period_s)
        chosen = self._robots[-1]
        for candidate in self._robots:
            if candidate[0] <= self._account_s:
                chosen = candidate
                break
        self._account_s -= chosen[0]
        return chosen

    def towards(self, command: Array, last: Array | None, length_s: float) -> Array:
        """Returns the commands nearest to some that the drives can follow in a tick.

        Args:
            command: wanted commands (n, 3), NaN for lost actuators.
            last: commands (n, 3) that were sent last; None where there are none.
            length_s: length of the tick [s].
        """
        if last is None or not self._has_rates:
            return command
        box = Rates(self._plant, self._plant.layout.rates * length_s).box(last)
        return box.clip_feasible(command, self._plant)
