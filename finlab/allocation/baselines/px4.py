"""Method `px4`: the control allocation of the PX4 autopilot, for robots of thrusters.

Pseudo-inverse of the effectiveness with PX4's normalisation of its columns, then sequential desaturation
(PX4, `ControlAllocationPseudoInverse.cpp` and `ControlAllocationSequentialDesaturation.cpp`, 1bbd116). It is
posed at full strength: thrusters give what is asked of them in newton, each within its own limits, the
thrust coefficient of each is its largest force, and failed thrusters are taken out of the matrix.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from finlab.allocation.method import LeastErrorMethod
from finlab.allocation.settings import Settings, choice
from finlab.allocation.solution import Solution
from finlab.arrays import Array

ROLL, PITCH, YAW, SURGE, SWAY, HEAVE = range(6)
ROWS = np.array([3, 4, 5, 0, 1, 2])
"""Axis of the wrench for each row of PX4's matrix."""
SIGNS = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""From x forward, y left, z up to PX4's x forward, y right, z down."""
ROUNDS_OFF = float(np.sqrt(6.0 * np.finfo(np.float32).eps))
"""Singular values below this share of the largest count as 0: PX4 works in single precision, with the square
of the matrix."""
SMALL = 1e-3
"""Entries of the normalised mix below this are set to 0, and do not count as used."""
LEAST = 0.2
"""Entries of a column from which on a thruster takes part in desaturation."""
YAW_MARGIN = 0.15
"""Share of a thruster's range by which yaw may exceed it."""
ORDER = (("Tx", "Ty"), ("Fz",), ("Tz",), ("Fx", "Fy"))
"""Groups of axes in the order in which PX4 means to keep them where not all can be had; surge and sway are
never reduced by plan, but cut off with the thrusters' limits."""


@dataclass(frozen=True)
class Px4Settings(Settings):
    """Settings of method `px4`."""

    desaturation: str = choice(
        "airmode 0",
        ("none", "airmode 0", "axes"),
        "what gives way at limits: nothing (plain pseudo-inverse), what PX4 does with MC_AIRMODE 0, or each "
        "axis in turn, least important first, as in older versions",
    )


class Px4(LeastErrorMethod):
    """`u = mix c`, desaturated along columns of the mix, clipped; see the module."""

    name = "px4"
    settings_class = Px4Settings
    takes = "thrusters"
    order: ClassVar = ORDER
    settings: Px4Settings

    def prepare(self) -> None:
        lower, upper = self.plant.lower[:, 0], self.plant.upper[:, 0]
        self._most = np.maximum(upper, -lower)
        self._low, self._high = lower / self._most, upper / self._most
        effectiveness = SIGNS[:, None] * (self.plant.effectiveness[:, 0].T * self._most)[ROWS]
        self.mix, self.setpoint_scale = normalised(np.linalg.pinv(effectiveness, rcond=ROUNDS_OFF))

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        part = (self.setpoint_scale * SIGNS * targets[:, ROWS])[:, None, :] * self.mix
        u, form = part.sum(axis=-1), self.settings.desaturation
        if form == "axes":
            for axis in (SWAY, SURGE, YAW, HEAVE, PITCH, ROLL):
                u = self._desaturated(u, axis)
        elif form != "none":
            u = u - part[..., YAW]
            u = self._desaturated(u, HEAVE, reduce_only=True)
            u = self._desaturated(self._desaturated(u, ROLL), PITCH)
            u = self._desaturated(u + part[..., YAW], YAW, margin=YAW_MARGIN)
            u = self._desaturated(u, HEAVE, reduce_only=True)
        command = np.zeros((*u.shape, 3))
        command[..., 0] = np.clip(u, self._low, self._high) * self._most
        return Solution(self.plant.feasible(command))

    def _desaturated(self, u: Array, axis: int, reduce_only: bool = False, margin: float = 0.0) -> Array:
        """Outputs (N, n) moved along a column of the mix towards their limits: a whole step, then half of
        the next. With `reduce_only` they are moved down alone, in the direction of the axis."""
        column, high = self.mix[:, axis], self._high + margin * (self._high - self._low)
        first = _gain(u, column, self._low, high)
        moved = u + first[:, None] * column
        moved = moved + 0.5 * _gain(moved, column, self._low, high)[:, None] * column
        return np.where((first < 0.0)[:, None], u, moved) if reduce_only else moved


def normalised(mix: Array) -> tuple[Array, Array]:
    """A mix (n, 6) with its columns divided as PX4 does, and what they were divided by (6,), with which the
    setpoint is multiplied."""
    used = np.abs(mix) > SMALL
    tilt = [np.sqrt((mix[:, k] ** 2).sum() / max(used[:, k].sum() / 2.0, 1e-9)) for k in (ROLL, PITCH)]
    thrust = np.linalg.norm(mix[:, SURGE:], axis=1)
    thrust = thrust[thrust > 1e-9]
    scale = np.array([max(tilt)] * 2 + [mix[:, YAW].max()] + [thrust.mean() if len(thrust) else 1.0] * 3)
    scale = np.where(scale > 1e-9, scale, 1.0)
    found = mix / scale
    found[np.abs(found) < SMALL] = 0.0
    return found, scale


def _gain(u: Array, column: Array, low: Array, high: Array) -> Array:
    """How far (N,) outputs (N, n) have to move along a column (n,) so that their excesses on both sides are
    alike."""
    used = np.abs(column) >= LEAST
    over = (np.clip(u, low, high) - u)[:, used] / column[used]
    return np.asarray(over.min(axis=1, initial=0.0) + over.max(axis=1, initial=0.0))
