"""A short test motion in the null space: changes of forces that leave the wrench as it is.

Where all thrusters give what they are told, nobody feels it; what a suspect does not give of it is
a wrench, and tells how much it gives. That is an auxiliary input of active fault diagnosis (S. L.
Campbell and R. Nikoukhah, Auxiliary Signal Design for Failure Detection, 2004) that hardly disturbs
the task: no more than by the force that the suspect fails to give.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.axes import mask_of
from finlab.layout import Layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.swim.control.contract import LEVER_M

TEST_SHARE = 0.1
"""Largest force of the suspect in a test, as a share of its largest."""
PERIOD_S = 1.6
"""Of the motion [s]: long beside lags of thrusters, short beside motions of robots."""
PART_MIN = 0.05
"""Least share of the suspect in a direction of the null space."""
OTHER_AXES = 0.01
"""What a squared force counts for, over a squared wrench along an axis that is not kept."""
SINGULAR = 1e-6
"""Singular values below this share of the largest are 0."""


class NullSpaceMotion:
    """Makes the test motions of one robot. Thrusters with a fixed axis take part: their forces, and
    no other actuator's, are linear in the command."""

    def __init__(self, layout: Layout) -> None:
        """Prepares for a robot."""
        scale = np.array([1.0, 1.0, 1.0, 1 / LEVER_M, 1 / LEVER_M, 1 / LEVER_M])
        self._effectiveness = (own_effectiveness(layout)[:, 0] * scale).T
        """Wrenches (6, n) of 1 N of each thruster, torques as forces at a lever."""
        self._is_thruster = np.array([part.type == "thruster" for part in layout.actuators])
        self._largest = np.abs(np.stack([layout.lower, layout.upper])[..., 0]).max(axis=0)
        self._suspect = -1
        self._phase_s = 0.0
        self._amplitude = 0.0
        self._direction = np.zeros(layout.n)

    @property
    def is_under_way(self) -> bool:
        """Whether a motion has begun and not ended."""
        return self._suspect >= 0

    def begin(
        self,
        command: Array,
        suspect: int,
        works: NDArray[np.bool_],
        axes: Sequence[str],
        most_n: float | None,
    ) -> None:
        """Begins a motion, where there is one for the suspect.

        Args:
            command: (n, 3), of the allocator.
            suspect: index of the actuator to test.
            works: actuators (n,) that are whole, as far as is known.
            axes: those along which the wrench stays as it is.
            most_n: largest force that the suspect may be told more or less [N]; None for
                `TEST_SHARE` of its largest.
        """
        takes_part = works & self._is_thruster & np.isfinite(command[:, 0])
        direction = self._direction_of(suspect, takes_part, mask_of(axes))
        if direction is None:
            return
        self._direction = direction
        amplitude = TEST_SHARE * float(self._largest[suspect]) if most_n is None else most_n
        # At first the way in which the suspect pushes: there is more to be seen of a larger force.
        self._amplitude = math.copysign(amplitude, float(command[suspect, 0]))
        self._suspect = suspect
        self._phase_s = 0.0

    def added(
        self, command: Array, lower: Array, upper: Array, works: NDArray[np.bool_], period_s: float
    ) -> Array:
        """Returns a command with the next step of the motion, which goes on for a whole period, or
        until it is back within the limits.

        Args:
            command: (n, 3), of the allocator.
            lower: least forces (n,) that may be told [N].
            upper: largest (n,) [N].
            works: actuators (n,) that are whole, as far as is known.
            period_s: time between calls [s].
        """
        self._phase_s += period_s
        if not works[self._direction != 0.0].all():
            # One of them has been named meanwhile; the others go back.
            self._direction[~works] = 0.0
            self._phase_s = PERIOD_S
        moves = self._direction != 0.0
        is_over = self._phase_s >= PERIOD_S - 0.5 * period_s
        change = 0.0
        if not is_over:
            change = self._amplitude * math.sin(2.0 * math.pi * self._phase_s / PERIOD_S)
        along = self._direction[moves]
        force = command[moves, 0]
        ends = np.stack([lower[moves] - force, upper[moves] - force]) / along
        least = float(ends.min(axis=0).max(initial=-math.inf))
        most = float(ends.max(axis=0).min(initial=math.inf))
        # Where the task itself takes more than the limits leave, nothing is added.
        change = min(max(change, least), most) if least <= most else 0.0
        if is_over and change == 0.0:
            self._suspect = -1
            return command
        result = command.copy()
        result[moves, 0] += change * along
        return result

    def _direction_of(
        self, suspect: int, takes_part: NDArray[np.bool_], kept: NDArray[np.bool_]
    ) -> Array | None:
        """The change (n,) of forces with 1 N of the suspect, no wrench along the axes that are
        kept, and as little as can be of other wrenches and of forces; None where there is none."""
        if not takes_part[suspect]:
            return None
        members = np.flatnonzero(takes_part)
        B_kept = self._effectiveness[kept][:, members]
        B_other = self._effectiveness[~kept][:, members]
        _, singular_values, V_T = np.linalg.svd(B_kept)
        rank = int((singular_values > SINGULAR * max(float(singular_values[0]), 1e-12)).sum())
        N = V_T[rank:].T
        of_suspect = N[int(np.flatnonzero(members == suspect)[0])]
        if float(of_suspect @ of_suspect) < PART_MIN:
            return None
        # Forces N z with the least z^T Q z of those with of_suspect^T z = 1.
        B_N = B_other @ N
        Q = B_N.T @ B_N + OTHER_AXES * np.eye(N.shape[1])
        z = np.linalg.solve(Q, of_suspect)
        force = N @ z / float(of_suspect @ z)
        direction = np.zeros(len(takes_part))
        direction[members] = np.where(np.abs(force) < 1e-9, 0.0, force)
        return direction
