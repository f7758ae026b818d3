"""Pseudo-inverse of the forces, each turned into its cheapest command, and all methods that begin
there.

Methods `analytic` and `fixed_frequency` are that alone; the base of the others, `ModelBased`, has
it for their starts.
"""

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from finlab.actuators.response import Line, Plane, Response
from finlab.allocation.baselines.fixed_actuators import fixed_actuators_of
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.method import LeastErrorMethod, Settings, number
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.physics import Plant, plant_of
from finlab.physics.objective import Name, cost_meter

RCOND = 1e-3
"""Singular values below this share of the largest count as zero."""
SAME_DIRECTION = 1e-6
"""Singular values below this share of the largest count as zero where directions of the wrench are
told apart in which the actuators push at all."""
NO_FORCE = 1e-9
"""Stands for a largest force of 0 where something is divided by it [N]."""
SOLVED = 1e-5
"""Normalized error up to which an answer is exact."""
LIMIT = "processor time per target after which the best command so far is the answer"
"""What the setting `time_limit_s` of slow methods means."""
USUAL_SHARE = 0.1
"""What a robot is mostly asked for, as a share of its wrench scale."""


class GroupIndex(NamedTuple):
    """Where one actuator stands among the groups of a compiled robot."""

    actuator: int
    """Its index in the layout."""
    group: int
    """Index of its group."""
    in_group: int
    """Its index there."""


class PseudoInverse:
    """What does not depend on the target, of n actuators in the flow that they are in.

    Forces (n, 2) [N] are along each actuator's own two directions; the second one of a line is 0.
    """

    def __init__(self, plant: Plant, error_scale: Array) -> None:
        """Inverts the effectiveness, columns scaled by the largest forces.

        Args:
            plant: of the robot, in its flow.
            error_scale: what rows (6,) are divided by [N, N m].
        """
        self.plant = plant
        compiled = Compiled(plant.layout, plant, error_scale).at(plant.inflow(None))
        self._core = compiled.core
        self.groups = compiled.groups
        """What the actuators can do, by kind."""
        indices = [
            GroupIndex(int(actuator), group, in_group)
            for group, (actuators, _) in enumerate(self.groups)
            for in_group, actuator in enumerate(actuators)
        ]
        self.group_indices = sorted(indices)
        """Of each actuator, in the order of the layout."""
        self.responses: list[Response] = compiled.responses
        """What each offers."""
        self.is_fixed, wrench_of_fixed = fixed_actuators_of(plant)
        """Which actuators (n,) have one command alone; forces asked of them count for nothing."""
        self.wrench_offset = compiled.wrench_offset + wrench_of_fixed
        """Wrench (6,) [N, N m] of forces of 0, such as the drag of foils, and of what is fixed."""
        is_second_of_line = compiled.is_line[:, None] & [False, True]
        effectiveness = compiled.effectiveness * ~is_second_of_line[..., None]
        effectiveness[self.is_fixed] = 0.0
        self.effectiveness: Array = effectiveness.reshape(-1, 6).T
        """Wrench (6, 2 n) per newton along each actuator's directions."""
        self.largest = np.array([_largest_force(response) for response in self.responses])
        """The largest force (n,) of each in any direction [N]."""
        self._sector_center = np.zeros(plant.n)
        self._sector_half_angle = np.full(plant.n, np.pi)
        for i, response in enumerate(self.responses):
            if isinstance(response, Plane):
                self._sector_center[i] = response.sector_center
                self._sector_half_angle[i] = response.sector_half_angle
        column_scale = np.repeat(np.maximum(self.largest, NO_FORCE), 2)
        scaled = self.effectiveness * column_scale / error_scale[:, None]
        scaled_inverse = np.linalg.pinv(scaled, rcond=RCOND)
        self.inverse = (column_scale[:, None] * scaled_inverse / error_scale).T.copy()
        """Target (6,) times this (6, 2 n) gives each actuator's forces [N]."""

    def command(self, targets: Array) -> Array:
        """Returns commands (N, n, 3) for targets (N, 6) [N, N m]."""
        return self.command_of(self.force(targets))

    def force(self, targets: Array) -> Array:
        """Returns forces (N, n, 2) [N] for targets (N, 6) [N, N m], whatever the limits."""
        force = (targets - self.wrench_offset) @ self.inverse
        return force.reshape(len(targets), self.plant.n, 2)

    def command_of(self, force: Array) -> Array:
        """Returns the cheapest commands (N, n, 3) for forces (N, n, 2) [N]; of what lies beyond a
        sector its projection on the nearer end, of what is too large the largest."""
        direction = np.arctan2(force[..., 1], force[..., 0])
        from_center = wrapped(direction - self._sector_center)
        within = np.clip(from_center, -self._sector_half_angle, self._sector_half_angle)
        excess = np.minimum(np.abs(from_center - within), 0.5 * np.pi)
        size = np.hypot(force[..., 0], force[..., 1]) * np.cos(excess)
        angle = self._sector_center + within
        inside = size[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return self.plant.feasible(self._core.commands(inside))


def _largest_force(response: Response) -> float:
    """The largest force [N] in any direction."""
    if isinstance(response, Line):
        reverse = 0.0 if response.reverse is None else response.reverse.largest
        return max(response.table.largest, reverse)
    largest_radius = 1.0 if response.gauge is None else float(response.gauge.max())
    return response.table.largest * largest_radius


def pushed_axes(effectiveness: Array) -> Array:
    """Returns the directions (r, 6) of the wrench, orthonormal, in which columns (6, k) push."""
    axes, size, _ = np.linalg.svd(effectiveness)
    rank = int((size > SAME_DIRECTION * size[0]).sum())
    return np.asarray(axes[:, :rank].T)


class ModelBased(LeastErrorMethod):
    """Base of methods that optimize over the actuators' own laws and tables, those that score every
    method."""

    settings_class: ClassVar[type[Settings]] = Settings

    def prepare(self) -> None:
        """Reads what is kept least."""
        self.objective: Name = getattr(self.settings, "objective", "power")
        """What is kept least."""
        if self.objective == "effort":
            self.layout.require_kind("objective 'effort'")
        self.asked_scale = USUAL_SHARE * self.scale
        """What wrenches (6,) are divided by: what a robot is mostly asked for."""

    @cached_property
    def _inverse(self) -> PseudoInverse:
        """What answers by the pseudo-inverse, and where others start."""
        return PseudoInverse(self.plant, self.asked_scale)

    @abstractmethod
    def _commands(self, targets: Array, seed: int) -> Array:
        """Returns commands (N, n, 3) for targets (N, 6) [N, N m]. Random starts are drawn once and
        shared by all targets, so that a target gets the same answer alone and among others."""

    def _best(self, target: Array, commands: Array, steps: int) -> Array:
        """Chooses among commands that are first made exact.

        Args:
            target: desired wrench (6,) [N, N m].
            commands: (S, n, 3) at which Levenberg-Marquardt steps begin.
            steps: how many are taken from each.

        Returns:
            The cheapest command (n, 3) that meets the target, else the one with the smallest error.
        """
        problem = CommandProblem.of(self.plant, self.asked_scale)
        refined = refine(problem, target[None] / self.asked_scale, commands, steps)
        is_missed = refined.error > SOLVED
        cost = cost_meter(self.objective, self.plant)(refined.command)
        merit = np.where(is_missed, refined.error, cost)
        best_first = np.lexsort((merit, is_missed))
        return np.array(refined.command[best_first[0]])

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        """Solves for targets, whatever the command before."""
        return Solution(self.plant.feasible(self._commands(targets, seed)))


@dataclass(frozen=True)
class TimeLimitedSettings(Settings):
    """Settings of a slow method, which ends in time."""

    time_limit_s: float = number(0.6, 0.0, 3600.0, LIMIT, "s", above=True)


class Analytic(ModelBased):
    """Pseudo-inverse of the forces, rows scaled by `asked_scale` and columns by each actuator's
    largest force, which each gives by its cheapest command. What does not fit is clipped, the rest
    not redistributed."""

    name = "analytic"
    takes = "any actuator"

    def _commands(self, targets: Array, seed: int) -> Array:
        """Returns the pseudo-inverse's commands."""
        return self._inverse.command(targets)


@dataclass(frozen=True)
class FixedFrequencySettings(Settings):
    """Settings of method `fixed_frequency`."""

    frequency: float = number(
        2.1,
        0.01,
        100.0,
        "at which all fins beat, within the limits of each; U-CAT's are 1.1 and 2.1",
        "Hz",
    )


class FixedFrequency(ModelBased):
    """U-CAT's on-board law: all fins beat at one frequency; force sets the amplitude, its direction
    the zero direction.

    With the law `drag` of a fin, `A = 1/2 arccos(1 - F / (2 rho Cd S rc^2 (2 pi f)^2))`; other laws
    are inverted in the same way. Where a fin is asked for more than it can give, all forces are
    scaled down together, as on board all amplitudes are. A fin of less force than that of its least
    amplitude stops: it takes its least amplitude and frequency. Forces are those of the
    pseudo-inverse, which on U-CAT's layout replaces the on-board rules made for it.
    """

    name = "fixed_frequency"
    settings_class = FixedFrequencySettings
    settings: FixedFrequencySettings

    @cached_property
    def _inverse(self) -> PseudoInverse:
        """The pseudo-inverse of the robot whose fins all beat at the frequency."""
        layout = self.layout
        fins = []
        for fin in layout.actuators:
            low, high = fin.value("frequency")
            frequency = min(max(self.settings.frequency, low), high)
            fins.append(fin.with_value("frequency", (frequency, frequency)))
        plant = plant_of(replace(layout, actuators=tuple(fins))).counting(layout.commanded)
        return PseudoInverse(plant.at(self.plant.flow), self.asked_scale)

    def _commands(self, targets: Array, seed: int) -> Array:
        """Scales the pseudo-inverse's forces down together, and stops fins that give too little."""
        inverse = self._inverse
        lower = self.plant.lower
        force = inverse.force(targets)
        used_share = np.linalg.norm(force, axis=-1) / np.maximum(inverse.largest, NO_FORCE)
        force /= np.maximum(used_share.max(axis=1), 1.0)[:, None, None]
        command = inverse.command_of(force)
        at_least_amplitude = command.copy()
        at_least_amplitude[..., 0] = lower[:, 0]
        least_force = np.linalg.norm(inverse.plant.force(at_least_amplitude), axis=-1)
        stops = np.linalg.norm(force, axis=-1) < least_force
        command[..., :2] = np.where(stops[..., None], lower[:, :2], command[..., :2])
        return command
