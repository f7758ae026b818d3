"""Methods `px4` and `ardusub`: the control allocation of two autopilots, for robots of thrusters.

`px4` is the pseudo-inverse of the effectiveness with PX4's normalisation of its columns, then
sequential desaturation (PX4, `ControlAllocationPseudoInverse.cpp` and
`ControlAllocationSequentialDesaturation.cpp`, 00202eb, with its parameters MC_AIRMODE_LIM and
MC_AIRMODE_YAW): outputs beyond limits are moved back along one axis after the other. Thrust may
fall for the sake of roll and pitch; it may rise only as far as the airmode's limit allows.

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
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from finlab.allocation.baselines.fixed_actuators import fixed_actuators_of
from finlab.allocation.method import LeastErrorMethod, Settings, choice, number, switch
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.axes import AXES as WRENCH_AXES
from finlab.axes import Axis
from finlab.exchange.motor_factors import AXES, FRAMES
from finlab.exchange.motor_factors import SIGNS as SUB_SIGNS

ROLL, PITCH, YAW, SURGE, SWAY, HEAVE = range(6)
"""Columns of PX4's mix."""
ROWS = np.array([3, 4, 5, 0, 1, 2])
"""Axis of the wrench for each row of PX4's matrix."""
SIGNS = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""From x forward, y left, z up to PX4's x forward, y right, z down."""
ROUNDS_OFF = float(np.sqrt(6.0 * np.finfo(np.float32).eps))
"""Share of the largest singular value that counts as 0: PX4 squares the matrix in single
precision."""
NEGLIGIBLE = 1e-3
"""Entries of the normalised mix below this are set to 0, and do not count as used."""
LEAST_ENTRY = 0.2
"""Entries of a column from which on a thruster takes part in desaturation."""
YAW_MARGIN = 0.15
"""Share of a thruster's range by which yaw may exceed it."""
LEAST_FOLD_GAIN = 1e-3
"""How much less thrust outputs must need with yaw than without it for yaw to be mixed in first."""
PX4_ORDER: tuple[tuple[Axis, ...], ...] = (("Tx", "Ty"), ("Fz",), ("Tz",), ("Fx", "Fy"))
"""Groups of axes in the order in which PX4 means to keep them where not all can be had; surge and
sway are never reduced by plan, but cut off with the thrusters' limits."""


@dataclass(frozen=True)
class Px4Settings(Settings):
    """Settings of method `px4`."""

    desaturation: str = choice(
        "sequential",
        ("none", "sequential", "axes"),
        "what gives way at limits: nothing (plain pseudo-inverse), what PX4 does today, or each "
        "axis in turn, least important first, as in older versions",
    )
    airmode_limit: float = number(
        0.0,
        0.0,
        1.0,
        "thrust that `sequential` may add to keep roll and pitch, as a share of full thrust "
        "(PX4's MC_AIRMODE_LIM): 0 for none, 1 for any",
    )
    airmode_yaw: bool = switch(
        False, "whether yaw may spend that thrust, too (PX4's MC_AIRMODE_YAW)"
    )


class Px4(LeastErrorMethod):
    """`u = mix c`, desaturated along columns of the mix, clipped; see `PX4_ORDER`."""

    name = "px4"
    settings_class = Px4Settings
    takes = "thrusters"
    settings: Px4Settings

    def prepare(self) -> None:
        """Makes the mix of PX4's pseudo-inverse."""
        lower = self.plant.lower[:, 0]
        upper = self.plant.upper[:, 0]
        is_fixed, self._wrench_of_fixed = fixed_actuators_of(self.plant)
        self._largest = np.where(is_fixed, 1.0, np.maximum(upper, -lower))
        self._low = lower / self._largest
        self._high = upper / self._largest
        columns = self.plant.effectiveness[:, 0].T * self._largest * ~is_fixed
        effectiveness = SIGNS[:, None] * columns[ROWS]
        self.mix, self.setpoint_scale = normalised(np.linalg.pinv(effectiveness, rcond=ROUNDS_OFF))
        self.setpoint_unit: Array = np.empty(6)
        """What a setpoint of 1 asks for along each axis of a wrench (6,) [N, N m]; NaN where
        nothing answers."""
        self.setpoint_unit[ROWS] = np.where(self.mix.any(axis=0), 1.0 / self.setpoint_scale, np.nan)

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        """Mixes, desaturates and clips."""
        from_others = targets - self._wrench_of_fixed
        setpoint = self.setpoint_scale * SIGNS * from_others[:, ROWS]
        output_by_axis = setpoint[:, None, :] * self.mix
        u = output_by_axis.sum(axis=-1)
        desaturation = self.settings.desaturation
        if desaturation == "axes":
            for axis in (SWAY, SURGE, YAW, HEAVE, PITCH, ROLL):
                u = self._desaturated(u, axis)
        elif desaturation == "sequential":
            u = self._sequential(u, output_by_axis[..., YAW], setpoint[:, YAW])
        command = np.zeros((*u.shape, 3))
        command[..., 0] = np.clip(u, self._low, self._high) * self._largest
        return Solution(self.plant.feasible(command))

    def _sequential(self, u: Array, yaw: Array, yaw_setpoint: Array) -> Array:
        """Outputs (N, n) that PX4 finds: thrust gives way first, then roll and pitch; yaw is added
        last to what is left, or mixed in from the start, where it gives way before roll and pitch.

        Args:
            u: outputs of the mix (N, n).
            yaw: the part of yaw in them (N, n).
            yaw_setpoint: the setpoint of yaw (N,).
        """
        limit = self.settings.airmode_limit
        without_yaw = u - yaw
        is_mixed_in = self._yaw_is_mixed_in(u, without_yaw)
        moved = np.where(is_mixed_in[:, None], u, without_yaw)
        moved = self._desaturated(moved, HEAVE, rise=limit)
        with_less_yaw = self._with_less_yaw(moved, yaw_setpoint)
        moved = np.where(is_mixed_in[:, None], with_less_yaw, moved)
        if limit < 1.0:
            moved = self._desaturated(moved, ROLL)
            moved = self._desaturated(moved, PITCH)
        added = self._desaturated(moved + yaw, YAW, margin=YAW_MARGIN)
        added = self._desaturated(added, HEAVE, rise=0.0)
        return np.where(is_mixed_in[:, None], moved, added)

    def _yaw_is_mixed_in(self, u: Array, without_yaw: Array) -> NDArray[np.bool_]:
        """Whether yaw is part of the outputs (N,) from the start: where it may spend thrust, or
        where outputs with it need less thrust than without it."""
        if self.settings.airmode_limit == 0.0:
            return np.zeros(len(u), bool)
        if self.settings.airmode_yaw:
            return np.ones(len(u), bool)
        column = self.mix[:, HEAVE]
        needed = _shift_needed(u, column, self._low, self._high)
        needed_without = _shift_needed(without_yaw, column, self._low, self._high)
        return np.asarray(needed < needed_without - LEAST_FOLD_GAIN)

    def _with_less_yaw(self, u: Array, yaw_setpoint: Array) -> Array:
        """Outputs (N, n) moved along yaw towards their limits, as far as that takes from the
        setpoint (N,) of yaw, and never beyond 0."""
        column = self.mix[:, YAW]
        least = np.minimum(-yaw_setpoint, 0.0)
        most = np.maximum(-yaw_setpoint, 0.0)
        first_gain = np.clip(_gain(u, column, self._low, self._high), least, most)
        moved = u + first_gain[:, None] * column
        second_gain = 0.5 * _gain(moved, column, self._low, self._high)
        second_gain = np.clip(second_gain, least - first_gain, most - first_gain)
        return np.asarray(moved + second_gain[:, None] * column)

    def _desaturated(self, u: Array, axis: int, rise: float = 1.0, margin: float = 0.0) -> Array:
        """Outputs (N, n) moved along a column of the mix towards their limits: a whole step, then
        half of the next.

        Args:
            u: outputs (N, n).
            axis: the column.
            rise: how far both steps together may go against the axis, which for thrust, positive
                downwards, is up; 1 for any.
            margin: share of the outputs' range by which they may exceed it.
        """
        column = self.mix[:, axis]
        high = self._high + margin * (self._high - self._low)
        gain = _gain(u, column, self._low, high)
        first_gain = gain if rise >= 1.0 else np.maximum(gain, -rise)
        moved = u + first_gain[:, None] * column
        second_gain = 0.5 * _gain(moved, column, self._low, high)
        if 0.0 < rise < 1.0:
            rise_left = rise - np.maximum(-first_gain, 0.0)
            second_gain = np.maximum(second_gain, -rise_left)
        moved = moved + second_gain[:, None] * column
        if rise == 0.0:
            # PX4 leaves these outputs to the axes that come after.
            return np.where((gain < 0.0)[:, None], u, moved)
        return moved


def normalised(mix: Array) -> tuple[Array, Array]:
    """Normalizes a mix as PX4 does since 1.14: columns of thrust by the means of their entries.

    Args:
        mix: outputs of n thrusters per unit of each axis (n, 6).

    Returns:
        The mix (n, 6) with divided columns, and the divisors (6,), by which PX4 multiplies
        setpoints.
    """
    is_used = np.abs(mix) > NEGLIGIBLE
    tilt = []
    for column in (ROLL, PITCH):
        half_count = max(is_used[:, column].sum() / 2.0, 1e-9)
        tilt.append(np.sqrt((mix[:, column] ** 2).sum() / half_count))
    sizes = np.abs(mix[:, SURGE:])
    is_driving = sizes > np.finfo(np.float32).eps
    thrust = sizes.sum(axis=0) / np.maximum(is_driving.sum(axis=0), 1)
    # Of an axis that nothing drives: that of heave.
    thrust = np.where(thrust > 0.0, thrust, thrust[-1])
    scale = np.array([max(tilt)] * 2 + [mix[:, YAW].max(), *thrust])
    scale = np.where(scale > 1e-9, scale, 1.0)
    result = mix / scale
    result[np.abs(result) < NEGLIGIBLE] = 0.0
    return result, scale


def _shifts(u: Array, column: Array, low: Array, high: Array) -> Array:
    """How far (N, k) each output of (N, n) has to move along a column (n,) to its limit, of those k
    that the column moves well."""
    takes_part = np.abs(column) >= LEAST_ENTRY
    excess = np.clip(u, low, high) - u
    return np.asarray(excess[:, takes_part] / column[takes_part])


def _gain(u: Array, column: Array, low: Array, high: Array) -> Array:
    """How far (N,) outputs (N, n) move along a column (n,) until their excesses on both sides are
    alike."""
    shift = _shifts(u, column, low, high)
    return np.asarray(shift.min(axis=1, initial=0.0) + shift.max(axis=1, initial=0.0))


def _shift_needed(u: Array, column: Array, low: Array, high: Array) -> Array:
    """Largest way (N,) along a column (n,) that one of the outputs (N, n) has to its limit."""
    return np.asarray(np.abs(_shifts(u, column, low, high)).max(axis=1, initial=0.0))


COLUMNS = np.array([WRENCH_AXES.index(axis) for axis in AXES])
"""Axis of the wrench for each column of factors."""
GROUPS = ((0, 1, 3), (2, 4, 5))
"""Columns that are scaled together: roll, pitch and throttle; yaw, forward and lateral."""
ARDUSUB_ORDER: tuple[tuple[Axis, ...], ...] = (("Tx", "Ty", "Fz"), ("Tz", "Fx", "Fy"))
"""The same as groups of axes; neither is meant to give way to the other."""
SMALL = 0.15
"""Share of the strongest thruster on an axis below which geometry suggests no factor, and of the
strongest force or torque below which a frame of ArduSub does not serve an axis."""
NOT_SERVED = 1e-9
"""Wrench per unit of output up to which an axis is not served by the factors."""
NO_PART = 1e-12
"""Force [N] below which a thruster has no part in a group."""
ALIKE = 0.3
"""By how much each factor of a frame may differ from what geometry suggests."""


class ArduSub(LeastErrorMethod):
    """Factors times demands, scaled by groups; see the module."""

    name = "ardusub"
    takes = "thrusters"

    def prepare(self) -> None:
        """Finds the factors of the frame that the thrusters make."""
        effectiveness = self.plant.effectiveness[:, 0, COLUMNS] * SUB_SIGNS
        is_fixed, self._wrench_of_fixed = fixed_actuators_of(self.plant)
        self.factors = np.zeros(effectiveness.shape)
        """Factors (n, 6); 0 of those that hang at a force."""
        full_output = 1.0
        if not is_fixed.all():
            self.factors[~is_fixed] = frame_factors(effectiveness[~is_fixed])
            full_output = 0.5 * (self.plant.upper - self.plant.lower)[~is_fixed, 0].mean()
        per_output = (effectiveness * self.factors).sum(axis=0)
        is_served = per_output > NOT_SERVED
        self.setpoint_unit: Array = np.empty(6)
        """What a setpoint of 1 asks for along each axis of a wrench (6,) [N, N m]; NaN where
        nothing answers; full output counts as the mean of both ways of all thrusters."""
        self.setpoint_unit[COLUMNS] = np.where(is_served, full_output * per_output, np.nan)
        # Newton per unit of the wrench; an axis that the factors do not serve is left out.
        self._force_per_wrench = np.divide(
            self.factors, per_output, out=np.zeros_like(self.factors), where=is_served
        )

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        """Multiplies, scales by groups and clips."""
        lower = self.plant.lower[:, 0]
        upper = self.plant.upper[:, 0]
        force = np.zeros((len(targets), self.plant.n))
        from_others = SUB_SIGNS * (targets - self._wrench_of_fixed)[:, COLUMNS]
        for group in GROUPS:
            columns = list(group)
            group_force = from_others[:, columns] @ self._force_per_wrench[:, columns].T
            limit = np.where(group_force < 0.0, lower, upper)
            share = np.divide(
                limit,
                group_force,
                out=np.full_like(group_force, np.inf),
                where=np.abs(group_force) > NO_PART,
            )
            # A thruster that cannot reverse is clipped, and scales nobody down.
            share[share <= 0.0] = np.inf
            force += group_force * np.minimum(share.min(axis=1, keepdims=True), 1.0)
        command = np.zeros((*force.shape, 3))
        command[..., 0] = force
        return Solution(self.plant.feasible(command))


def frame_factors(effectiveness: Array) -> Array:
    """Returns the factors of the frame of ArduSub that some thrusters make; of any other robot
    those that its geometry suggests.

    A frame is recognized with its thrusters in any order, some mounted the other way round, some
    lost: by the assignment of thrusters to its own that is nearest.

    Args:
        effectiveness: wrenches (n, 6) per newton, in ArduSub's columns and signs.

    Returns:
        Factors (n, 6).
    """
    strongest = np.abs(effectiveness).max(axis=0)
    suggested: Array = effectiveness / np.maximum(strongest, 1e-9)
    suggested[np.abs(suggested) < SMALL] = 0.0
    is_force = COLUMNS < 3
    strongest_of_kind = np.where(is_force, strongest[is_force].max(), strongest[~is_force].max())
    served = np.where(strongest >= SMALL * strongest_of_kind, suggested, 0.0)
    for frame in sorted(FRAMES.values(), key=len):
        if len(frame) < len(suggested):
            continue
        shares = frame / np.maximum(np.abs(frame).max(axis=0), 1e-9)
        both_ways = np.array([shares, -shares])[:, :, None]
        difference = np.abs(served - both_ways)  # (2, of the frame, of the robot, 6)
        distance = difference.max(axis=-1)
        nearer_way = distance.min(axis=0)
        of_frame, of_robot = linear_sum_assignment(nearer_way)
        if nearer_way[of_frame, of_robot].max() <= ALIKE:
            is_forward = distance[0, of_frame, of_robot] <= distance[1, of_frame, of_robot]
            sign = np.where(is_forward, 1.0, -1.0)
            factors: Array = np.empty_like(served)
            factors[of_robot] = sign[:, None] * frame[of_frame]
            return factors
    return suggested
