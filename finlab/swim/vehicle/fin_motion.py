"""Fins that follow their commands, from beat to beat and within the beat, and their power.

Amplitude, frequency and zero direction each follow their command through the filters of
`finlab.layout.Servo`, exactly for a command that stays over the step. A fin that is given another
frequency goes on from where it is in its beat.
"""

import math
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import is_full_turn
from finlab.core import library
from finlab.core.shared_array import SharedArray
from finlab.layout import Layout
from finlab.physics import plant_of

TURN_SHARE_MIN = 0.1
"""Share of its speed that a servo turns its fin with, however fast that flaps."""

COPPER_LOSS = 0.5
"""Heat in the windings of a fin's motor [W/(N m)^2]: `copper_loss` of a robot that swims in
simulation. Our choice, as nothing is published of U-CAT's drives: a motor of 60 W whose windings
take 730 W/(N m)^2 at its own shaft (7 rpm per mN m) behind a gear of 50 : 1 at 80 %, with which its
fin turns twice a second."""


# Columns of a fin's numbers, in the order of `fin_numbers` in the core's fin_motion.c.
LAGS = slice(0, 12)
TURNS_FULLY = 12
SPEED_LIMIT = 13
TURN_SPEED_MIN = 14
INERTIA = 15
DRAG = 16
OWN_INERTIA = 17
COPPER = 18
N_FIN_NUMBERS = 19
# Columns of what a fin does, in the order of `fin_state` there.
VALUE = slice(0, 3)
RATE = slice(3, 6)
PHASE = 6
N_STATE_NUMBERS = 7


class LagStep(NamedTuple):
    """The exact step of critically damped filters, x'' = -2 p x' - p^2 e, towards constant targets.

    With the error e = x - target, the double pole p and the length h of the step, its transition
    matrix is

        (e, x') <- exp(-p h) [[1 + p h, h], [-p^2 h, 1 - p h]] (e, x')
    """

    error_by_error: Array
    error_by_rate: Array
    """[s]."""
    rate_by_error: Array
    """[1/s]."""
    rate_by_rate: Array

    @classmethod
    def of(cls, pole: Array, dt: float) -> "LagStep":
        """Returns the step of filters.

        Args:
            pole: p [rad/s], of any shape.
            dt: h, length of the step [s].
        """
        decay = np.exp(-pole * dt)
        return cls(
            error_by_error=(1.0 + pole * dt) * decay,
            error_by_rate=dt * decay,
            rate_by_error=-(pole**2) * dt * decay,
            rate_by_rate=(1.0 - pole * dt) * decay,
        )


class FinLag:
    """What the n fins of one layout do if they follow as they should: enough for whoever watches
    ten times a second. `FinMotion` adds what happens within the beat.

    The core moves the fins (finlab/core/src/fin_motion.c): the filters of `LagStep`, with A f
    bounded by the servo's speed before the filter and behind it.
    """

    def __init__(self, layout: Layout) -> None:
        """Starts at rest: no amplitude, no frequency, zero directions at the middle of their
        arcs."""
        n = layout.n_fins
        lower, upper = np.array([fin.limits.zero_direction for fin in layout.fins]).reshape(-1, 2).T
        self._poles = layout.servo_poles.reshape(-1, 3)
        speed_limit = np.asarray(layout.speed_limit)
        self._fins = SharedArray(np.zeros((n, N_FIN_NUMBERS)))
        self._fins.array[:, TURNS_FULLY] = is_full_turn(upper - lower)
        self._fins.array[:, SPEED_LIMIT] = speed_limit
        self._fins.array[:, TURN_SPEED_MIN] = TURN_SHARE_MIN * speed_limit
        self._state = SharedArray(np.zeros((n, N_STATE_NUMBERS)))
        self.value[2] = 0.5 * (lower + upper)
        self._command = SharedArray(np.zeros((n, 3)))
        self._dt = math.nan

    @property
    def value(self) -> Array:
        """Half amplitude [rad], frequency [Hz] and zero direction [rad], counted on over the seam
        (3, n); a view."""
        return self._state.array[:, VALUE].T

    @property
    def rate(self) -> Array:
        """The same per second (3, n); a view."""
        return self._state.array[:, RATE].T

    @property
    def command(self) -> Array:
        """What the fins do now, as a command (n, 3) [rad, Hz, rad]; a copy."""
        return self._state.array[:, VALUE].copy()

    def step(self, command: Array, dt: float) -> None:
        """Follows a command over a step.

        Args:
            command: (n, 3) [rad, Hz, rad]; a fin whose row is NaN stops at once and hangs still.
            dt: length of the step [s].
        """
        self._take(command, dt)
        library().fl_follow_fins(
            self._fins.address, self._command.address, len(command), self._state.address
        )

    def _take(self, command: Array, dt: float) -> None:
        """Copies a command to where the core reads it, and sees that the filters' step fits."""
        self._command.array[:] = command
        if dt != self._dt:
            self._dt = dt
            lag = np.stack(LagStep.of(self._poles, dt), axis=-1)
            self._fins.array[:, LAGS] = lag.reshape(len(lag), -1)


class FinSteps(NamedTuple):
    """What n fins did in K steps much shorter than a beat."""

    mean_command: Array
    """Their command (K, n, 3) [rad, Hz, rad] as a mean over each step, zero directions wrapped."""
    beats: Array
    """1 where a fin (K, n) beats by that, 0 where it does not."""
    angle: Array
    """Angles (K, n) at the end of each step [rad]: theta = A sin(phase) + zero direction (the
    paper's Eq. 1)."""
    phase: Array
    """Phases of the flapping (K, n) at the end of each step [rad]."""
    speed: Array
    """Angular speeds (K, n) [rad/s]."""
    acceleration: Array
    """Angular accelerations (K, n) [rad/s^2]; those by changes of the command are means over a
    step."""
    inertial_power: Array
    """|I alpha omega| (K, n) [W], the paper's: what turns the fin's own inertia, braking counted
    like driving."""
    driving_power: Array
    """max(tau omega, 0) (K, n) [W], inertia, carried water and drag together, nothing won back by
    braking, and the heat in the motor's windings, copper_loss tau^2: what a battery gives, but for
    the electronics. The torque is that of a rigid plate in still water."""


class FinMotion(FinLag):
    """Angles of the fins of one layout over time, in steps much shorter than a beat."""

    def __init__(self, layout: Layout, copper_loss: float = COPPER_LOSS) -> None:
        """Starts at rest, as `FinLag`.

        Args:
            layout: the robot.
            copper_loss: heat in a motor's windings [W/(N m)^2].
        """
        super().__init__(layout)
        if layout.n_fins:
            blade = plant_of(layout.fins_alone).blade
            self._fins.array[:, INERTIA] = blade.inertia
            self._fins.array[:, DRAG] = blade.drag
            self._fins.array[:, OWN_INERTIA] = blade.own_inertia
            self._fins.array[:, COPPER] = copper_loss

    @property
    def phase(self) -> Array:
        """Phases of the flapping (n,) [rad]; a view."""
        return self._state.array[:, PHASE]

    @property
    def angle(self) -> Array:
        """The fins' angles (n,) now [rad], as in `FinSteps`."""
        amplitude, _, zero_direction = self.value
        return np.asarray(amplitude * np.sin(self.phase) + zero_direction)

    def step(self, command: Array, dt: float) -> None:
        """Follows a command as `FinLag`, within the beat."""
        self.steps(command, dt, 1)

    def steps(self, command: Array, dt: float, count: int) -> FinSteps:
        """Follows a command over several steps.

        Args:
            command: as of `step`.
            dt: length of a step [s].
            count: how many, K.
        """
        self._take(command, dt)
        n = len(command)
        moves = np.empty((count, n, 10))
        library().fl_move_fins(
            self._fins.address,
            self._command.address,
            n,
            dt,
            count,
            self._state.address,
            moves.ctypes.data,
        )
        return FinSteps(
            mean_command=moves[..., :3],
            beats=moves[..., 3],
            angle=moves[..., 4],
            phase=moves[..., 5],
            speed=moves[..., 6],
            acceleration=moves[..., 7],
            inertial_power=moves[..., 8],
            driving_power=moves[..., 9],
        )
