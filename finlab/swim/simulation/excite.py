"""A swim from which a robot can be learned: every axis and actuator is varied, depth and attitude
are kept.

The controller holds the place softly and adds a sum of sines on each axis, each axis with periods
of its own. The allocator gives that wrench with forces that also push against each other, and draws
each fin's amplitude anew every few seconds, so that the law of each fin shows. No axis is shaken
farther than it may go. Where the robot leaves its bounds, the excitation fades until it is back.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.allocation.method import Method, Networks, Settings, number
from finlab.allocation.question import MethodQuestion
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.errors import DataError, FinlabError
from finlab.layout import Layout
from finlab.layout.effectiveness import layout_effectiveness
from finlab.physics import plant_of
from finlab.swim.control import Measurement, Setpoint
from finlab.swim.simulation.closed_loop import ClosedLoop
from finlab.swim.simulation.devices import SensorSettings
from finlab.swim.simulation.task import station
from finlab.swim.vehicle.fossen import complete_body, dynamics_of

LONGEST_S = 300.0
"""Longest swim [s]."""
SHORTEST_S = 30.0
"""Shortest one [s]: once through the slowest sine."""
EXCITATION_SHARES = (0.40, 0.35, 0.30, 0.15, 0.15, 0.15)
"""Amplitude of the excitation on each axis, as a share of what all actuators together could give at
most."""
PERIODS_S = (
    (31.0, 13.0, 7.0),
    (23.0, 11.0, 6.1),
    (17.0, 9.1, 5.3),
    (8.3, 4.9, 3.1),
    (12.1, 6.7, 4.1),
    (19.0, 9.7, 4.5),
)
"""Periods of the sines of each axis [s]; no two axes share one."""
INNER_SHARE = 0.3
"""Amplitude of the forces that cancel, as a share of the largest force of an actuator."""
REDRAW_S = 3.1
"""Time after which each fin has another amplitude [s]."""
TURN_RAD_S = 0.8
"""Fastest that a fin is turned [rad/s]: one that turns fast paddles, which hides what its beat
gives."""
BOUNDS = (1.5, 0.5, 0.35)
"""Horizontal distance [m], change of depth [m] and roll or pitch [rad] at which the excitation has
faded."""
BOUNDS_FACTOR_MAX = 3.0
"""Times these bounds at which the swim is given up."""
AXIS_BOUNDS = np.array([BOUNDS[0], BOUNDS[0], BOUNDS[1], BOUNDS[2], BOUNDS[2], 1.0])
"""Bounds of each axis [m, rad]; that of yaw is no more than a wish."""
EXCURSION_SHARE = 0.5
"""Share of them to which the sines of an axis take the robot at most."""
HOLDING_SHARE = 0.3
"""Share of what all actuators could give that holds the robot at a bound, where a loop may be so
fast."""
BANDWIDTH_MIN = np.array([0.25, 0.25, 0.4, 0.0, 0.0, 0.4])
"""Slowest loops that hold each axis [rad/s]."""
BANDWIDTH_MAX = np.array([1.0, 1.0, 1.0, 2.5, 2.5, 1.0])
"""Fastest ones [rad/s]."""
DAMPING_FACTOR = 1.6
"""Damping over inertia and bandwidth: a damping ratio of 0.8."""
DAMPING_MIN = np.array([0.2, 0.2, 0.6, 0.5, 0.5, 0.6])
"""Least damping of each axis, over its inertia [1/s]."""
AMPLITUDE_WEIGHT = 0.05
"""Of a fin's drawn amplitude beside its force, where a command is chosen."""
DEPTH_M = 1.5
"""Where the robot is held [m]."""
PERIOD_S = 0.1
"""Of the controller [s]."""


class ExcitingController:
    """Holds a place and heading softly, and shakes all six axes."""

    name = "excitation"
    axes: tuple[str, ...] = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
    free: tuple[str, ...] = ()
    period_s = PERIOD_S

    def __init__(self, layout: Layout, seed: int = 0) -> None:
        """Tunes the loops for a robot.

        Args:
            layout: the robot.
            seed: of the sines' phases.
        """
        # Each axis as far as all actuators could push it, were they all aimed at it.
        by_column = np.abs(layout_effectiveness(layout) * largest_forces(layout))
        first_columns = np.unique(_owners(layout), return_index=True)[1]
        by_actuator = np.add.reduceat(by_column**2, first_columns, axis=1) ** 0.5
        max_wrench = by_actuator.sum(axis=1)
        rng = np.random.default_rng(seed)
        self._phase = rng.uniform(0.0, 2 * math.pi, (6, len(PERIODS_S[0])))
        dynamics = dynamics_of(complete_body(layout))
        inertia = np.array(dynamics.inertia)
        # K = M omega_0^2 and D = 2 zeta M omega_0 hold each axis.
        omega_0 = np.sqrt(HOLDING_SHARE * max_wrench / (inertia * AXIS_BOUNDS))
        omega_0 = np.clip(omega_0, BANDWIDTH_MIN, BANDWIDTH_MAX)
        self._stiffness = inertia * omega_0**2
        self._damping = inertia * np.maximum(DAMPING_FACTOR * omega_0, DAMPING_MIN)
        # Motion per wrench at the sines' frequencies: 1 / |K - M omega^2 + i omega D|.
        omega = 2.0 * math.pi / np.array(PERIODS_S).T
        damping = 1j * omega * (self._damping + np.array(dynamics.linear_damping))
        compliance = 1.0 / np.abs(self._stiffness - inertia * omega**2 + damping)
        by_strength = np.array(EXCITATION_SHARES) * max_wrench
        by_excursion = EXCURSION_SHARE * AXIS_BOUNDS / compliance.mean(axis=0)
        self._amplitude = np.minimum(by_strength, by_excursion)

    def reset(self) -> None:
        """Nothing is remembered."""

    def wrench(self, measurement: Measurement, setpoint: Setpoint, delivered: Array) -> Array:
        """Returns the wrench (6,) that holds the place and shakes the robot [N, N m].

        Args:
            measurement: of now.
            setpoint: the place.
            delivered: not used.

        Raises:
            FinlabError: the robot left its bounds.
        """
        away = setpoint.position - np.array([*measurement.position[:2], -measurement.depth])
        c = math.cos(measurement.yaw)
        s = math.sin(measurement.yaw)
        error = np.array(
            [c * away[0] + s * away[1], c * away[1] - s * away[0], away[2], 0.0, 0.0, 0.0]
        )
        error[3:] = wrapped(-np.array([measurement.roll, measurement.pitch, measurement.yaw]))
        nu = np.concatenate([measurement.velocity, measurement.rates])
        tilt = max(abs(measurement.roll), abs(measurement.pitch))
        distance = math.hypot(away[0], away[1])
        bounds_factor = max(distance / BOUNDS[0], abs(away[2]) / BOUNDS[1], tilt / BOUNDS[2])
        if bounds_factor > BOUNDS_FACTOR_MAX:
            raise FinlabError(
                f"--excite: the robot left its bounds at {measurement.time:.1f} s, "
                f"{math.hypot(*away[:2]):.1f} m off, {abs(away[2]):.1f} m up or down, tilted by "
                f"{math.degrees(tilt):.0f} deg; check its body, above all center_of_buoyancy_m and "
                "buoyancy_n"
            )
        fade = min(1.0, max(0.0, 2.0 - 2.0 * bounds_factor))
        excitation = fade * self.excitation(measurement.time)
        return np.asarray(self._stiffness * error - self._damping * nu + excitation)

    def excitation(self, time: float) -> Array:
        """The sum of sines (6,) at a time [s], at most the amplitude of each axis."""
        angle = 2 * math.pi * time / np.array(PERIODS_S) + self._phase
        return np.asarray(self._amplitude * np.sin(angle).mean(axis=1))


@dataclass(frozen=True)
class ExcitingSettings(Settings):
    """Where its randomness comes from."""

    seed: int = number(0, 0, 2**63, "of the forces and amplitudes that are drawn")


class Exciting(Method):
    """Gives a wrench with forces that also push against each other, and with amplitudes drawn at
    random."""

    name = "excitation"
    settings_class = ExcitingSettings
    settings: ExcitingSettings

    def __init__(
        self, layout: Layout, settings: Settings, scale: Array, networks: Networks | None = None
    ) -> None:
        super().__init__(layout, settings, scale, networks)
        self._rng = np.random.default_rng(self.settings.seed)
        self._owner = _owners(layout)
        self._max_force = largest_forces(layout)
        # Each gives its share of what it can: the weighted pseudoinverse, and the null space N.
        weight = self._max_force / self._max_force.max()
        B = layout_effectiveness(layout) * weight
        self._force_by_wrench = weight[:, None] * np.linalg.pinv(B, rcond=1e-6)
        _, singular_values, V_T = np.linalg.svd(B)
        rank = int((singular_values > 1e-6 * singular_values[0]).sum())
        self._null_space = V_T[rank:] * self._max_force
        self._phase = self._rng.uniform(0.0, 2 * math.pi, (len(self._null_space), 2))
        self._tick = 0
        self._is_fin = layout.is_fin
        self._direction: Array | None = None
        if layout.n_fins:
            self._plant = plant_of(layout.fins_alone)
            self._largest = self._max_force[np.isin(self._owner, np.flatnonzero(self._is_fin))][::2]
            self._grid = self._plant.grid((13, 41, 1))
            self._amplitude = self._plant.upper[:, 0]

    def solve(self, question: MethodQuestion) -> Solution:
        """See `Method`; each target is a tick of the controller."""
        return Solution(np.stack([self._command(target) for target in question.targets]))

    def _command(self, target: Array) -> Array:
        """The next command (n, 3); each call is a tick of the controller."""
        time = self._tick * PERIOD_S
        k = np.arange(len(self._null_space))
        swing = np.sin(2 * math.pi * time / (14.3 + 3.7 * k) + self._phase[:, 0])
        swing += np.sin(2 * math.pi * time / (5.9 + 1.3 * k) + self._phase[:, 1])
        force = self._force_by_wrench @ target
        force = force + (INNER_SHARE * swing @ self._null_space if len(k) else 0.0)
        command = np.zeros((self.layout.n, 3))
        for i, part in enumerate(self.layout.actuators):
            command[i] = part.pushing(force[self._owner == i])
        command = self.plant.feasible(command)
        if self._is_fin.any():
            of_fins = force[np.isin(self._owner, np.flatnonzero(self._is_fin))].reshape(-1, 2)
            command[self._is_fin] = self._fin_commands(of_fins)
        self._tick += 1
        return command

    def _fin_commands(self, force: Array) -> Array:
        """Commands (n, 3) of the fins for forces (n, 2) [N] along zero and shaft x zero."""
        if self._tick % round(REDRAW_S / PERIOD_S) == 0:
            share = self._rng.uniform(0.2, 1.0, self._plant.n_fins)
            lower = self._plant.lower[:, 0]
            upper = self._plant.upper[:, 0]
            self._amplitude = lower + share * (upper - lower)
        size = np.hypot(*force.T)
        direction = np.arctan2(force[:, 1], force[:, 0])
        if self._direction is not None:
            max_turn = TURN_RAD_S * PERIOD_S
            turn = wrapped(direction - self._direction)
            turned = np.clip(turn, -max_turn, max_turn)
            direction = self._direction + turned
            # A fin that is still turning gives only its part along the force; across and against
            # it, nothing.
            size = size * np.maximum(np.cos(turn - turned), 0.0)
        self._direction = direction
        grid = self._grid.copy()
        grid[..., 2] = direction
        grid = self._plant.feasible(grid)
        force_size = np.linalg.norm(self._plant.forces(grid), axis=-1)
        force_error = np.abs(force_size - size) / self._largest
        amplitude_error = np.abs(grid[..., 0] - self._amplitude) / self._plant.upper[:, 0]
        best = np.argmin(force_error + AMPLITUDE_WEIGHT * amplitude_error, axis=0)
        return np.asarray(grid[best, np.arange(self._plant.n_fins)])


def _owners(layout: Layout) -> NDArray[np.intp]:
    """Which actuator each column of `layout_effectiveness` is of (m,)."""
    return np.repeat(np.arange(layout.n), [len(part.KIND.push_rows) for part in layout.actuators])


def largest_forces(layout: Layout) -> Array:
    """Returns the largest force [N] along each direction in which an actuator pushes (m,), at
    rest."""
    plant = plant_of(layout)
    size = np.linalg.norm(plant.forces(np.stack([plant.lower, plant.upper])), axis=-1).max(axis=0)
    return np.asarray(size[_owners(layout)])


def excitation(
    layout: Layout,
    duration_s: float = LONGEST_S,
    *,
    truth: Layout | None = None,
    sensors: SensorSettings | None = None,
    current: Sequence[float] = (0.0, 0.0, 0.0),
    plant: str = "finlab",
    seed: int = 0,
) -> ClosedLoop:
    """The swim, ready to be run. Raises DataError: the duration is too short to tell anything, or
    longer than five minutes; FinlabError: it has rudders, which give nothing on the spot.

    Args:
        layout: the robot.
        duration_s: how long [s].
        truth: the robot that really swims, where it is not as drawn.
        sensors: rates and noise; the defaults of `SensorSettings`.
        current: velocity (3,) of the water in the world [m/s].
        plant: what integrates its body, see `ClosedLoop`.
        seed: of the excitation and of the sensors' noise.
    """
    if layout.flow_driven:
        raise FinlabError(
            f"--excite: rudders of layout {layout.name} give nothing on the spot; let it swim a "
            "wide path, such as --trajectory circle --scale 25, and fit that log"
        )
    if not SHORTEST_S <= duration_s <= LONGEST_S:
        raise DataError(f"duration: expected {SHORTEST_S:g} to {LONGEST_S:g} s, got {duration_s:g}")
    return ClosedLoop(
        layout,
        Allocator(layout, Exciting, seed=seed),
        station(duration_s, DEPTH_M, "excitation"),
        ExcitingController(layout, seed),
        truth=truth,
        sensors=sensors,
        current=current,
        plant=plant,
        seed=seed,
    )
