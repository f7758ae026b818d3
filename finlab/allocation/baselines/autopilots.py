"""Methods `px4` and `ardusub`: the control allocation of two autopilots, for robots of thrusters.

`px4` is the pseudo-inverse of the effectiveness with PX4's normalisation of its columns, then
sequential desaturation (PX4, `ControlAllocationPseudoInverse.cpp` and
`ControlAllocationSequentialDesaturation.cpp`, 1bbd116).

`ardusub` has a sum of six factors times six demands for each thruster, whatever the geometry. Roll,
pitch and throttle are one group and yaw, forward and lateral the other; each is scaled down until
no output of its own exceeds the limits, then the two are added and clipped (ArduSub,
`AP_Motors6DOF`, frame VECTORED_6DOF). Factors are those of the frame of ArduSub that the thrusters
make; of any other robot they are those that its geometry suggests: shares of the strongest.

Both are posed at full strength: thrusters give the newton that are asked of them, each within its
own limits (PX4's thrust coefficient of each is its largest force), and lost thrusters are taken
out, as are those that hang at a force, which the others make up for.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from finlab.allocation.baselines.held import held_of
from finlab.allocation.method import LeastErrorMethod
from finlab.allocation.policy import AXES as WRENCH_AXES
from finlab.allocation.settings import Settings, choice
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.axes import Axis
from finlab.exchange.motor_factors import AXES, FRAMES
from finlab.exchange.motor_factors import SIGNS as SUB_SIGNS

ROLL, PITCH, YAW, SURGE, SWAY, HEAVE = range(6)
ROWS = np.array([3, 4, 5, 0, 1, 2])
"""Axis of the wrench for each row of PX4's matrix."""
SIGNS = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""From x forward, y left, z up to PX4's x forward, y right, z down."""
ROUNDS_OFF = float(np.sqrt(6.0 * np.finfo(np.float32).eps))
"""Share of the largest singular value that counts as 0: PX4 squares the matrix in single
precision."""
NEGLIGIBLE = 1e-3
"""Entries of the normalised mix below this are set to 0, and do not count as used."""
LEAST = 0.2
"""Entries of a column from which on a thruster takes part in desaturation."""
YAW_MARGIN = 0.15
"""Share of a thruster's range by which yaw may exceed it."""
PX4_ORDER: tuple[tuple[Axis, ...], ...] = (("Tx", "Ty"), ("Fz",), ("Tz",), ("Fx", "Fy"))
"""Groups of axes in the order in which PX4 means to keep them where not all can be had; surge and
sway are never reduced by plan, but cut off with the thrusters' limits."""


@dataclass(frozen=True)
class Px4Settings(Settings):
    """Settings of method `px4`."""

    desaturation: str = choice(
        "airmode 0",
        ("none", "airmode 0", "axes"),
        "what gives way at limits: nothing (plain pseudo-inverse), what PX4 does with MC_AIRMODE "
        "0, or each "
        "axis in turn, least important first, as in older versions",
    )


class Px4(LeastErrorMethod):
    """`u = mix c`, desaturated along columns of the mix, clipped; see `PX4_ORDER`."""

    name = "px4"
    settings_class = Px4Settings
    takes = "thrusters"
    settings: Px4Settings

    def prepare(self) -> None:
        lower = self.plant.lower[:, 0]
        upper = self.plant.upper[:, 0]
        held, self._kept = held_of(self.plant)
        self._most = np.where(held, 1.0, np.maximum(upper, -lower))
        self._low = lower / self._most
        self._high = upper / self._most
        effectiveness = (
            SIGNS[:, None] * (self.plant.effectiveness[:, 0].T * self._most * ~held)[ROWS]
        )
        self.mix, self.setpoint_scale = normalised(np.linalg.pinv(effectiveness, rcond=ROUNDS_OFF))
        self.setpoint_unit: Array = np.empty(6)
        """What a setpoint of 1 asks for along each axis of a wrench (6,) [N, N m]; NaN where
        nothing answers."""
        self.setpoint_unit[ROWS] = np.where(self.mix.any(axis=0), 1.0 / self.setpoint_scale, np.nan)

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        wanted = targets - self._kept
        part = (self.setpoint_scale * SIGNS * wanted[:, ROWS])[:, None, :] * self.mix
        u = part.sum(axis=-1)
        form = self.settings.desaturation
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

    def _desaturated(
        self, u: Array, axis: int, reduce_only: bool = False, margin: float = 0.0
    ) -> Array:
        """Outputs (N, n) moved along a column of the mix towards their limits: a whole step, then
        half of the next. With `reduce_only` they are moved down alone, in the direction of the
        axis."""
        column = self.mix[:, axis]
        high = self._high + margin * (self._high - self._low)
        first = _gain(u, column, self._low, high)
        moved = u + first[:, None] * column
        moved = moved + 0.5 * _gain(moved, column, self._low, high)[:, None] * column
        return np.where((first < 0.0)[:, None], u, moved) if reduce_only else moved


def normalised(mix: Array) -> tuple[Array, Array]:
    """A mix (n, 6), columns divided as PX4 does since 1.14 (each of thrust by the mean of its own
    entries), and the divisors (6,), by which it multiplies setpoints."""
    used = np.abs(mix) > NEGLIGIBLE
    tilt = [
        np.sqrt((mix[:, k] ** 2).sum() / max(used[:, k].sum() / 2.0, 1e-9)) for k in (ROLL, PITCH)
    ]
    sizes = np.abs(mix[:, SURGE:])
    thrust = sizes.sum(axis=0) / np.maximum((sizes > np.finfo(np.float32).eps).sum(axis=0), 1)
    thrust = np.where(
        thrust > 0.0, thrust, thrust[-1]
    )  # of an axis that nothing drives: that of heave
    scale = np.array([max(tilt)] * 2 + [mix[:, YAW].max(), *thrust])
    scale = np.where(scale > 1e-9, scale, 1.0)
    result = mix / scale
    result[np.abs(result) < NEGLIGIBLE] = 0.0
    return result, scale


def _gain(u: Array, column: Array, low: Array, high: Array) -> Array:
    """How far (N,) outputs (N, n) move along a column (n,) until their excesses on both sides are
    alike."""
    used = np.abs(column) >= LEAST
    over = (np.clip(u, low, high) - u)[:, used] / column[used]
    return np.asarray(over.min(axis=1, initial=0.0) + over.max(axis=1, initial=0.0))


COLUMNS = np.array([WRENCH_AXES.index(axis) for axis in AXES])
"""Axis of the wrench for each column of factors."""
GROUPS = ((0, 1, 3), (2, 4, 5))
"""Columns that are scaled together: roll, pitch and throttle; yaw, forward and lateral."""
ARDUSUB_ORDER: tuple[tuple[Axis, ...], ...] = (("Tx", "Ty", "Fz"), ("Tz", "Fx", "Fy"))
"""The same as groups of axes; neither is meant to give way to the other."""
SMALL = 0.15
"""Share of the strongest thruster on an axis below which geometry suggests no factor, and of the
strongest force or torque below which a frame of ArduSub does not serve an axis."""
ALIKE = 0.3
"""By how much each factor of a frame may differ from what geometry suggests."""


class ArduSub(LeastErrorMethod):
    """Factors times demands, scaled by groups; see the module."""

    name = "ardusub"
    takes = "thrusters"

    def prepare(self) -> None:
        effectiveness = self.plant.effectiveness[:, 0, COLUMNS] * SUB_SIGNS
        held, self._kept = held_of(self.plant)
        self.factors = np.zeros(effectiveness.shape)
        """Factors (n, 6); 0 of those that hang at a force."""
        full = 1.0
        if not held.all():
            self.factors[~held] = frame_factors(effectiveness[~held])
            full = 0.5 * (self.plant.upper - self.plant.lower)[~held, 0].mean()
        actual = (effectiveness * self.factors).sum(axis=0)
        self.setpoint_unit: Array = np.empty(6)
        """What a setpoint of 1 asks for along each axis of a wrench (6,) [N, N m]; NaN where
        nothing answers; full output counts as the mean of both ways of all thrusters."""
        self.setpoint_unit[COLUMNS] = np.where(actual > 1e-9, full * actual, np.nan)
        # Newton per unit of the wrench; an axis that the factors do not serve is left out.
        self._per = np.divide(
            self.factors, actual, out=np.zeros_like(self.factors), where=actual > 1e-9
        )

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        lower = self.plant.lower[:, 0]
        upper = self.plant.upper[:, 0]
        force = np.zeros((len(targets), self.plant.n))
        for group in GROUPS:
            columns = list(group)
            wanted = SUB_SIGNS * (targets - self._kept)[:, COLUMNS]
            part = wanted[:, columns] @ self._per[:, columns].T
            room = np.where(part < 0.0, lower, upper)
            share = np.divide(
                room, part, out=np.full_like(part, np.inf), where=np.abs(part) > 1e-12
            )
            share[share <= 0.0] = (
                np.inf
            )  # a thruster that cannot reverse is clipped, and holds nobody back
            force += part * np.minimum(share.min(axis=1, keepdims=True), 1.0)
        command = np.zeros((*force.shape, 3))
        command[..., 0] = force
        return Solution(self.plant.feasible(command))


def frame_factors(effectiveness: Array) -> Array:
    """Factors (n, 6) for thrusters with these wrenches (n, 6) per newton, in ArduSub's columns and
    signs. A frame is known by its thrusters in any order, some mounted the other way round, some
    lost."""
    strongest = np.abs(effectiveness).max(axis=0)
    suggested: Array = effectiveness / np.maximum(strongest, 1e-9)
    suggested[np.abs(suggested) < SMALL] = 0.0
    forces, torques = (np.isin(COLUMNS, part) for part in ([0, 1, 2], [3, 4, 5]))
    most = np.where(forces, strongest[forces].max(), strongest[torques].max())
    served = np.where(strongest >= SMALL * most, suggested, 0.0)
    for frame in sorted(FRAMES.values(), key=len):
        if len(frame) < len(suggested):
            continue
        known = frame / np.maximum(np.abs(frame).max(axis=0), 1e-9)
        apart = np.abs(served - np.array([known, -known])[:, :, None])  # (2, frame, own, 6)
        distance = apart.max(axis=-1)
        row, own = linear_sum_assignment(distance.min(axis=0))
        if distance.min(axis=0)[row, own].max() <= ALIKE:
            sign = np.where(distance[0, row, own] <= distance[1, row, own], 1.0, -1.0)
            result: Array = np.empty_like(served)
            result[own] = sign[:, None] * frame[row]
            return result
    return suggested
