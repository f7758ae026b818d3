"""Pseudo-inverse of the forces, each turned into its cheapest command, and all methods that begin
there.

Methods `analytic` and `fixed_frequency` are that alone; the base of the others has it for their
starts.
"""

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from finlab.actuators.response import Line, Plane, Response
from finlab.allocation.baselines.held import held_of
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.method import LeastErrorMethod
from finlab.allocation.settings import Settings, number
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.physics import Plant, plant_of
from finlab.physics.objective import Name, cost_meter

RCOND = 1e-3
"""Singular values below this share of the largest count as zero."""
SAME_DIRECTION = 1e-6
"""The same where directions of the wrench are told apart in which the actuators push at all."""

_FULL = 0.0, np.pi
"""Middle and half of an arc [rad] that cuts nothing off."""


class PseudoInverse:
    """What does not depend on the target, of a robot in the flow that it has, rows scaled by
    `sigma` (6,). Forces are along each actuator's own two directions; the second one of a line is
    0."""

    def __init__(self, plant: Plant, sigma: Array) -> None:
        self.plant = plant
        compiled = Compiled(plant.layout, plant, sigma).at(plant.inflow(None))
        self.groups, self._core = compiled.groups, compiled.robot.core
        """What the actuators can do."""
        self.places = sorted(
            (int(i), k, j) for k, (own, _) in enumerate(self.groups) for j, i in enumerate(own)
        )
        """Of each actuator, in order: itself, its group, and its place there."""
        self.responses: list[Response] = compiled.robot.responses
        """What each offers."""
        self.held, kept = held_of(plant)
        """Which actuators (n,) have one command alone; forces asked of them count for nothing."""
        self.beside = compiled.wrench_offset + kept
        """Wrench (6,) [N, N m] of forces of 0, such as the drag of foils, and of what is held."""
        along = (
            compiled.robot.effectiveness
            * ~(compiled.robot.is_line[:, None] & [False, True])[..., None]
        )
        along[self.held] = 0.0
        self.effectiveness: Array = along.reshape(-1, 6).T
        """Wrench (6, 2 n) per newton along each actuator's directions."""
        self.largest = np.array([_largest(each) for each in self.responses])
        """The largest force (n,) of each in any direction [N]."""
        arcs = [
            (each.middle, each.half) if isinstance(each, Plane) else _FULL
            for each in self.responses
        ]
        self._middle, self._half = np.array(arcs).T
        most = np.repeat(np.maximum(self.largest, 1e-9), 2)
        scaled = self.effectiveness * most / sigma[:, None]
        self.inverse = (most[:, None] * np.linalg.pinv(scaled, rcond=RCOND) / sigma).T.copy()
        """Target (6,) times this (6, 2 n) gives each actuator's forces [N]."""

    def command(self, targets: Array) -> Array:
        """Commands (N, n, 3) for targets (N, 6)."""
        return self.decoded(self.force(targets))

    def force(self, targets: Array) -> Array:
        """Forces (N, n, 2) [N] for targets (N, 6), whatever the limits."""
        return ((targets - self.beside) @ self.inverse).reshape(len(targets), self.plant.n, 2)

    def decoded(self, force: Array) -> Array:
        """The cheapest commands (N, n, 3) for forces (N, n, 2) [N]; what an actuator cannot give is
        cut off."""
        angle = wrapped(np.arctan2(force[..., 1], force[..., 0]) - self._middle)
        held = np.clip(angle, -self._half, self._half)
        excess = np.minimum(np.abs(angle - held), 0.5 * np.pi)
        size = np.hypot(force[..., 0], force[..., 1]) * np.cos(excess)
        angle = self._middle + held
        inside = size[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return self.plant.feasible(self._core.commands(inside))


def _largest(response: Response) -> float:
    if isinstance(response, Line):
        reverse = 0.0 if response.reverse is None else response.reverse.largest
        return max(response.table.largest, reverse)
    return response.table.largest * (1.0 if response.gauge is None else float(response.gauge.max()))


def pushed_axes(effectiveness: Array) -> Array:
    """Directions (r, 6) of the wrench in which columns (6, k) push at all, each once."""
    axes, size, _ = np.linalg.svd(effectiveness)
    return np.asarray(axes[:, : int((size > SAME_DIRECTION * size[0]).sum())].T)


SOLVED = 1e-5
"""Normalized error up to which an answer is exact."""
LIMIT = "processor time per target after which the best command so far is the answer"
USUAL_SHARE = 0.1
"""What a robot is mostly asked for, as a share of its yardstick."""


class ModelBased(LeastErrorMethod):
    """A method that optimizes over the actuators' own laws and tables, those that score every
    method."""

    settings_class: ClassVar[type[Settings]] = Settings

    def prepare(self) -> None:
        self.aim: Name = getattr(self.settings, "objective", "power")
        """What is kept least."""
        if self.aim == "effort":
            self.layout.only("objective 'effort'")
        self.sigma = USUAL_SHARE * self.scale
        """What wrenches (6,) are divided by: what a robot is mostly asked for."""

    @cached_property
    def _inverse(self) -> PseudoInverse:
        """What answers by the pseudo-inverse, and where others start."""
        return PseudoInverse(self.plant, self.sigma)

    @abstractmethod
    def _commands(self, targets: Array, seed: int) -> Array:
        """Commands (N, n, 3) for targets (N, 6). Random starts are drawn once and shared by all
        targets, so that a target gets the same answer alone and among others."""

    def _best(self, target: Array, commands: Array, steps: int) -> Array:
        """Of commands (S, n, 3), each brought onto a target (6,) by some Levenberg-Marquardt steps,
        the cheapest one (n, 3) that meets it, else the one with the smallest error."""
        problem = CommandProblem.of(self.plant, self.sigma)
        ends = refine(problem, target[None] / self.sigma, commands, steps)
        missed = ends.error > SOLVED
        cost = np.where(missed, ends.error, cost_meter(self.aim, self.plant)(ends.command))
        return np.array(ends.command[np.lexsort((cost, missed))[0]])

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        return Solution(self.plant.feasible(self._commands(targets, seed)))


@dataclass(frozen=True)
class TimeLimitedSettings(Settings):
    """Settings of a slow method, which ends in time."""

    time_limit_s: float = number(0.6, 0.0, 3600.0, LIMIT, "s", above=True)


class Analytic(ModelBased):
    """Pseudo-inverse of the forces, rows scaled by sigma and columns by each actuator's largest
    force, which each gives by its cheapest command. What does not fit is clipped, the rest not
    redistributed."""

    name = "analytic"
    takes = "any actuator"

    def _commands(self, targets: Array, seed: int) -> Array:
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
        layout = self.layout
        fins = []
        for fin in layout.actuators:
            low, high = fin.value("frequency")
            wanted = self.settings.frequency
            held = min(max(wanted, low), high)
            fins.append(fin.with_value("frequency", (held, held)))
        plant = plant_of(replace(layout, actuators=tuple(fins))).counting(layout.commanded)
        return PseudoInverse(plant.at(self.plant.flow), self.sigma)

    def _commands(self, targets: Array, seed: int) -> Array:
        inverse = self._inverse
        lower = self.plant.lower
        force = inverse.force(targets)
        share = np.linalg.norm(force, axis=-1) / np.maximum(inverse.largest, 1e-9)
        force /= np.maximum(share.max(axis=1), 1.0)[:, None, None]
        command = inverse.decoded(force)
        least = command.copy()
        least[..., 0] = lower[:, 0]
        stops = np.linalg.norm(force, axis=-1) < np.linalg.norm(inverse.plant.force(least), axis=-1)
        command[..., :2] = np.where(stops[..., None], lower[:, :2], command[..., :2])
        return command
