"""Actuators that follow their commands, each as fast as its lag and rates allow.

Whoever has to know what the actuators do uses it: the simulated robot (`simulation/devices.py`),
the closed loop's account of the wrench that was given, the fault monitor, and the fit of a robot.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array
from finlab.axes import is_full_turn
from finlab.core import library
from finlab.core.shared_array import SharedArray
from finlab.layout import Actuator, Layout
from finlab.swim.vehicle.fin_motion import FinLag

NO_LAG_S = 1e-9
"""Time constant [s] of what follows at once: no division by 0."""
UNLIMITED_RATE = 1e12
"""Rate [per s] of what follows at once: no infinity less infinity."""


class FirstOrderLag:
    """m actuators that are no fins: lags of first order with a largest rate.

    Commands (m, 3) are those of the layout. Far from its command a value changes at its largest
    rate, and from an error of rate times time constant on it decays exponentially.
    """

    def __init__(self, actuators: Sequence[Actuator]) -> None:
        """Starts at rest: no force, angles as near to 0 as their arcs allow."""
        m = len(actuators)
        # Of each number of a command, in the order of `lag_numbers` in the core's
        # first_order_lag.c: largest rate, time constant, whether it is an angle, or on a circle.
        lags = np.zeros((m, 3, 4))
        lags[..., 0] = np.minimum(
            np.array([each.rates for each in actuators]).reshape(m, 3), UNLIMITED_RATE
        )
        lags[..., 1] = NO_LAG_S
        self.value = np.zeros((m, 3))
        """What they do now (m, 3); angles are counted on over the seam."""
        for i, each in enumerate(actuators):
            lags[i, each.KIND.lagging_number, 1] = getattr(each, "time_constant", NO_LAG_S)
            if not each.KIND.sticks_at_angle:
                continue
            low = each.lower[0]
            high = each.upper[0]
            lags[i, 0, 2] = 1.0
            lags[i, 0, 3] = is_full_turn(high - low)
            self.value[i, 0] = min(max(0.0, low), high)
        self._lags = SharedArray(lags)
        self._command = SharedArray(np.zeros((m, 3)))

    def step(self, command: Array, dt: float) -> None:
        """Follows a command over a step.

        Args:
            command: (m, 3); an actuator whose row is NaN stops at once and does not turn.
            dt: length of the step [s].
        """
        self.steps(command, dt, 1)

    def steps(self, command: Array, dt: float, count: int) -> Array:
        """Returns the values (K + 1, m, 3) at the beginning and after each of K steps.

        Args:
            command: as of `step`; it stays over all steps.
            dt: length of a step [s].
            count: how many, K.
        """
        self._command.array[:] = command
        values = np.empty((count + 1, *self.value.shape))
        values[0] = self.value
        library().fl_follow_lags(
            self._lags.address,
            self._command.address,
            self.value.size,
            dt,
            count,
            values.ctypes.data,
        )
        self.value = values[-1]
        return values


class ActuatorMotion:
    """What the actuators of one layout do if they follow as they should; commands are (n, 3)."""

    def __init__(self, layout: Layout, fins: FinLag | None = None) -> None:
        """Starts at rest.

        Args:
            layout: the robot.
            fins: follows the fins; by default without what happens within the beat.
        """
        self.fin_indices = np.flatnonzero(layout.is_fin)
        """Which actuators are fins."""
        self.other_indices = np.flatnonzero(~layout.is_fin)
        """Which are not."""
        self.fins = FinLag(layout) if fins is None else fins
        self.others = FirstOrderLag([layout.actuators[i] for i in self.other_indices])
        self._n = layout.n
        self._fins_work_alone = len(self.fin_indices) == layout.n
        self._others_work_alone = len(self.other_indices) == layout.n
        self._held_columns = np.array([part.KIND.stuck_number for part in layout.actuators])
        self._indices = np.arange(layout.n)
        self._others_work = np.ones(len(self.other_indices), bool)
        widths = (layout.upper - layout.lower)[self._indices, self._held_columns]
        self.angles: NDArray[np.bool_] = np.array(
            [part.KIND.sticks_at_angle for part in layout.actuators]
        )
        """Which actuators (n,) have an angle that stays where they stick."""
        self.turns_fully: NDArray[np.bool_] = self.angles & is_full_turn(widths)
        """Which actuators (n,) may come to any direction."""

    def step(self, command: Array, dt: float) -> None:
        """Follows a command over a step.

        Args:
            command: (n, 3); an actuator whose row is NaN stops at once.
            dt: length of the step [s].
        """
        of_fins, of_others = self.split(command)
        if len(of_fins):
            self.fins.step(of_fins, dt)
        if len(of_others):
            self.others.step(of_others, dt)

    def split(self, command: Array) -> tuple[Array, Array]:
        """Returns a command (n, 3) that is to be followed as those of the fins (n_fins, 3) and of
        the others (n - n_fins, 3), and remembers which of these work by it."""
        if self._fins_work_alone:
            return command, command[:0]
        of_others = command if self._others_work_alone else command[self.other_indices]
        self._others_work = np.isfinite(of_others[:, 0])
        of_fins = command[:0] if self._others_work_alone else command[self.fin_indices]
        return of_fins, of_others

    def joined(self, of_fins: AnyArray, of_others: AnyArray) -> AnyArray:
        """Returns the values (n, ...) of all actuators.

        Args:
            of_fins: those of the fins (n_fins, ...).
            of_others: those of the others (n - n_fins, ...).
        """
        if self._fins_work_alone:
            return of_fins
        if self._others_work_alone:
            return of_others
        result = np.empty((self._n, *of_others.shape[1:]), of_others.dtype)
        result[self.fin_indices] = of_fins
        result[self.other_indices] = of_others
        return result

    @property
    def command(self) -> Array:
        """What the actuators do now, as a command (n, 3); a copy."""
        if self._fins_work_alone:
            return self.fins.command
        return self.joined(self.fins.command, self.others.value.copy())

    @property
    def others_work(self) -> NDArray[np.bool_]:
        """Which of the others (n - n_fins,) have not stopped."""
        return self._others_work

    @property
    def pushes(self) -> NDArray[np.bool_]:
        """Which actuators (n,) may give a force: fins that beat, whatever the law says of others,
        and all others but those that have stopped."""
        if self._others_work_alone:
            return self._others_work
        amplitude, frequency, _ = self.fins.value
        return self.joined(amplitude * frequency > 0.0, self._others_work)

    @property
    def direction(self) -> Array:
        """Where each actuator (n,) would stay if it stuck: a fin's zero direction, another one's
        angle [rad], or a force [N]; a copy."""
        of_fins: Array = self.fins.value[2].copy()
        if self._fins_work_alone:
            return of_fins
        rows = np.arange(len(self.other_indices))
        of_others = self.others.value[rows, self._held_columns[self.other_indices]]
        direction: Array = self.joined(of_fins, of_others)
        return direction

    def held_part(self, command: Array) -> Array:
        """The parts (..., n) of commands (..., n, 3) that stay where an actuator sticks."""
        part: Array = command[..., self._indices, self._held_columns]
        return part

    def turned_to(self, command: Array, direction: Array) -> Array:
        """Returns commands of actuators that stick.

        Args:
            command: (..., n, 3).
            direction: (..., n) the held part of each, as `direction` gives it; NaN where it does
                not stick.
        """
        result = command.copy()
        held = np.where(np.isnan(direction), self.held_part(result), direction)
        result[..., self._indices, self._held_columns] = held
        return result
