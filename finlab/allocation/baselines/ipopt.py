"""Method `ipopt`: CasADi and IPOPT over the forces of the actuators; needs the extra `ipopt`.

The wrench is linear in the forces, but for the drag of foils, and what a force costs is known from
the compiled actuators: one or two variables for each remain. One start finds the least where no arc
is wider than half a turn but no full circle, and no fin is uneven. Dead bands are passed over.
"""

from dataclasses import dataclass
from functools import cached_property
from time import thread_time
from typing import Any, NamedTuple

import numpy as np

from finlab.actuators.response import Group, Line, Plane, power_of
from finlab.allocation.baselines.pseudo_inverse import (
    NO_FORCE,
    SOLVED,
    ModelBased,
    PseudoInverse,
    TimeLimitedSettings,
    pushed_axes,
)
from finlab.allocation.method import number
from finlab.arrays import Array
from finlab.assets import install_command
from finlab.axes import TURN
from finlab.errors import AllocationError

LEVELS = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, 65)) ** 4
"""Shares of the range of sizes at which a cost is looked up: dense at both ends, where costs
bend."""
DIRECTIONS = np.linspace(-1.0, 1.0, 97)
"""Places in an arc at which an uneven fin is looked up, from end to end."""
SMOOTH = 1e-4
"""Share of its largest force below which the size of a force is rounded off: it has slopes at rest,
too."""
REST = 1e-3
"""Share of its largest force up to which an actuator that cannot rest is taken for one that can."""
NARROW = 1e-6
"""Half of an arc [rad] below which an actuator pushes along one line."""


class ForceProgram:
    """Power over the forces of one robot in CasADi, the wrench as a constraint, the target as its
    parameter."""

    def __init__(
        self, casadi: Any, inverse: PseudoInverse, error_scale: Array, options: dict[str, Any]
    ) -> None:
        """Makes the program and its solver.

        Args:
            casadi: the module, which is an extra.
            inverse: gives starts, and commands of forces.
            error_scale: what wrenches (6,) are divided by [N, N m].
            options: of IPOPT.
        """
        self._inverse = inverse
        n = inverse.plant.n
        self._largest = np.maximum(inverse.largest, NO_FORCE)
        share = casadi.MX.sym("share", 2 * n)
        target = casadi.MX.sym("target", 6)
        wrench_per_share = inverse.effectiveness * np.repeat(self._largest, 2)
        wrench = casadi.DM(wrench_per_share) @ share + casadi.DM(inverse.wrench_offset)
        self._actuators: list[_LineProgram | _PlaneProgram | _FixedProgram] = []
        for response, index in zip(inverse.responses, inverse.group_indices, strict=True):
            i = index.actuator
            share_of_actuator = share[2 * i : 2 * i + 2]
            if inverse.is_fixed[i]:
                self._actuators.append(_FixedProgram())
            elif isinstance(response, Plane):
                self._actuators.append(_PlaneProgram(casadi, response, share_of_actuator))
            else:
                _, group = inverse.groups[index.group]
                largest = float(self._largest[i])
                line = _LineProgram(
                    casadi, response, share_of_actuator, largest, group, index.in_group
                )
                self._actuators.append(line)
                wrench += line.wrench_offset
        self.convex = all(actuator.convex for actuator in self._actuators)
        """Whether one start is enough, as far as actuators can rest."""

        constraints: list[_Constraint] = []
        for actuator in self._actuators:
            constraints += actuator.constraints
        # The wrench counts along the directions in which the actuators push at all.
        residual = (wrench - target) / casadi.DM(error_scale)
        axes = pushed_axes(wrench_per_share / error_scale[:, None])
        for along_axis in casadi.vertsplit(casadi.DM(axes) @ residual):
            constraints.append(_Constraint(along_axis, 0.0, 0.0))

        power: Any = sum(actuator.power for actuator in self._actuators)
        full_power = sum(actuator.full_power for actuator in self._actuators)
        program = {
            "x": share,
            "p": target,
            "f": power / max(full_power, 1e-300),
            "g": casadi.vertcat(*(constraint.value for constraint in constraints)),
        }
        self._solver = casadi.nlpsol("forces", "ipopt", program, options)
        ends = np.array([actuator.ends for actuator in self._actuators]).reshape(-1, 2)
        self._bounds = {
            "lbg": np.array([constraint.low for constraint in constraints]),
            "ubg": np.array([constraint.high for constraint in constraints]),
            "lbx": ends[:, 0],
            "ubx": ends[:, 1],
        }

    def command(self, target: Array, start: Array) -> Array:
        """Solves for one target from one start.

        Args:
            target: desired wrench (6,) [N, N m].
            start: forces (n, 2) [N].

        Returns:
            The command (n, 3) of the forces where IPOPT ends; of the start where these are not
            finite.
        """
        largest = self._largest[:, None]
        answer = self._solver(x0=(start / largest).ravel(), p=target, **self._bounds)
        force = np.array(answer["x"], np.float64).reshape(start.shape) * largest
        if not np.isfinite(force).all():
            force = start
        return np.asarray(self._inverse.command_of(force[None])[0])

    def starts(self, target: Array, n_random: int, seed: int) -> Array:
        """Returns forces (S, n, 2) [N] at which IPOPT begins: the pseudo-inverse's, and where one
        start is not enough, random ones.

        Args:
            target: desired wrench (6,) [N, N m].
            n_random: how many of these.
            seed: of the random ones.
        """
        first = self._inverse.force(target[None])
        if self.convex:
            return first
        rng = np.random.default_rng(seed)
        random_starts = np.array(
            [[actuator.random(rng) for actuator in self._actuators] for _ in range(n_random)]
        )
        return np.concatenate(
            [first, random_starts.reshape(-1, *first.shape[1:]) * self._largest[:, None]]
        )


class _Constraint(NamedTuple):
    """A value that must lie between two numbers."""

    value: Any
    """In CasADi."""
    low: float
    """Least value."""
    high: float
    """Largest value."""


class _FixedProgram:
    """One actuator that has one command alone: what it gives is in the wrench offset, its variables
    are 0."""

    constraints: tuple[_Constraint, ...] = ()
    """See `_PlaneProgram`."""
    convex = True
    """See `_LineProgram`, as are all that follow."""
    power = 0.0
    full_power = 0.0
    ends = ((0.0, 0.0), (0.0, 0.0))

    def random(self, rng: np.random.Generator) -> Array:
        """Returns shares (2,) within the limits."""
        return np.zeros(2)


class _LineProgram:
    """One actuator of one direction in CasADi; `share` (2,) is its force over the largest one, and
    0."""

    constraints: tuple[_Constraint, ...] = ()
    """See `_PlaneProgram`."""

    def __init__(
        self, casadi: Any, line: Line, share: Any, largest: float, group: Group, in_group: int
    ) -> None:
        """Makes the power and the wrench offset.

        Args:
            casadi: the module.
            line: what the actuator offers.
            share: its variables (2,).
            largest: its largest force [N].
            group: of its kind, which knows what comes beside forces.
            in_group: its index there.
        """
        reverse = 0.0 if line.reverse is None else line.reverse.largest
        low = max(line.low, -reverse) / largest
        high = min(line.high, line.table.largest) / largest
        self.ends = [(low, high), (0.0, 0.0)]
        """Least and largest value of both variables."""
        both_ways = np.concatenate([-LEVELS * reverse, LEVELS * line.table.largest])
        grid = np.unique(both_ways) / largest
        if grid[0] == grid[-1]:
            grid = np.linspace(-1.0, 1.0, 5)
        power = power_of(line, largest * grid)
        self.power = _spline(casadi, grid, power)(share[0])
        """Power [W] in CasADi."""
        self.full_power = float(power.max())
        """Power [W] at full load."""
        force = np.zeros((len(grid), len(group.responses), 2))
        offset_at_rest = group.wrench_offset_of(force)
        force[:, in_group, 0] = largest * grid
        offset = group.wrench_offset_of(force) - offset_at_rest
        self.wrench_offset: Any = 0.0
        """Wrench (6,) in CasADi that comes on top, such as the drag of a foil."""
        if offset.any():
            self.wrench_offset = _spline(casadi, grid, offset.ravel())(share[0])
        self.convex = not offset.any()
        """Whether the wrench is linear in the force."""

    def random(self, rng: np.random.Generator) -> Array:
        """Returns shares (2,) within the limits."""
        return np.array([rng.uniform(*self.ends[0]), 0.0])


class _PlaneProgram:
    """One actuator of two directions in CasADi; `share` (2,) is its force over the largest one."""

    def __init__(self, casadi: Any, plane: Plane, share: Any) -> None:
        """Makes the power and the constraints.

        Args:
            casadi: the module.
            plane: what the actuator offers.
            share: its variables (2,).
        """
        center = plane.sector_center
        half_angle = plane.sector_half_angle
        table = plane.table
        self._center = center
        self._half_angle = half_angle
        self.ends = [(-np.inf, np.inf)] * 2
        """See `_LineProgram`."""
        is_convex_sector = half_angle <= 0.5 * np.pi or half_angle >= np.pi
        self.convex = plane.gauge is None and is_convex_sector
        """Whether the set of forces has no gap, and no bulge."""

        # Along the centre of the sector and across it, over the largest force there.
        strongest = 1.0 if plane.gauge is None else float(plane.gauge.max())
        along = strongest * (np.cos(center) * share[0] + np.sin(center) * share[1])
        across = strongest * (np.cos(center) * share[1] - np.sin(center) * share[0])
        size = casadi.sqrt(along * along + across * across + SMOOTH**2)
        low = float(table.force[0]) / table.largest
        radius = 1.0
        if plane.gauge is not None:
            end = max(half_angle, NARROW)
            direction = casadi.atan2(across, along + SMOOTH)  # at rest it has a slope, too
            direction = casadi.fmin(casadi.fmax(direction, -end), end)
            count = len(plane.gauge)
            directions = end * DIRECTIONS
            circle = TURN / count * np.arange(count + 1)
            closed_gauge = np.append(plane.gauge, plane.gauge[0])
            gauge = np.interp((center + directions) % TURN, circle, closed_gauge)
            radius = _spline(casadi, directions, gauge)(direction)
        force = table.largest * (low + (1.0 - low) * LEVELS)
        power = power_of(plane, force)
        level = (size / radius - low) / max(1.0 - low, 1e-9)
        self.power = _spline(casadi, LEVELS, power)(level)
        """See `_LineProgram`."""
        self.full_power = float(power[-1])
        """See `_LineProgram`."""
        self.constraints: list[_Constraint] = [_Constraint(size - radius, -np.inf, 0.0)]
        """What keeps the force in its set: its size, and the sector."""
        if low > REST:
            self.constraints.append(_Constraint(size - low * radius, 0.0, np.inf))
        if half_angle < NARROW:
            self.constraints.append(_Constraint(across, 0.0, 0.0))
            self.constraints.append(_Constraint(along, 0.0, np.inf))
        elif half_angle <= 0.5 * np.pi:
            for sign in (-1.0, 1.0):
                inside = along * np.sin(half_angle) + sign * across * np.cos(half_angle)
                self.constraints.append(_Constraint(inside, 0.0, np.inf))
        elif half_angle < np.pi:
            inside = along - size * np.cos(half_angle)
            self.constraints.append(_Constraint(inside, 0.0, np.inf))

    def random(self, rng: np.random.Generator) -> Array:
        """Returns shares (2,) within the arc."""
        angle = self._center + rng.uniform(-1.0, 1.0) * self._half_angle
        return rng.uniform() * np.array([np.cos(angle), np.sin(angle)])


def _spline(casadi: Any, grid: Array, values: Array) -> Any:
    """A function in CasADi through values (K,) or (K * m,) at K points."""
    return casadi.interpolant("spline", "bspline", [grid.tolist()], values)


POLISH = 3
"""Levenberg-Marquardt steps onto the target from where IPOPT ends."""
APPROACH = 30
"""Levenberg-Marquardt steps from there where a few do not meet it: as near as they come."""
SOLVER_OPTIONS = {
    "print_time": False,
    "error_on_fail": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 200,
    "ipopt.tol": 1e-9,
}
"""Options of CasADi and IPOPT: silent, and an end that is not optimal is no error."""


@dataclass(frozen=True)
class IpoptSettings(TimeLimitedSettings):
    """Settings of method `ipopt`."""

    n_starts: int = number(
        8, 0, 10_000, "random starts per target, beside the pseudo-inverse's answer"
    )


class Ipopt(ModelBased):
    """IPOPT on power, with the wrench as a constraint; an `AllocationError` where CasADi is not
    installed.

    Where one start is not enough it is run from random ones, too. Each end is made exact by the
    laws; the cheapest that meets the target is the answer, else the nearest. After the time limit
    no start begins; each may take half as long.
    """

    name = "ipopt"
    takes = "any actuator"
    settings_class = IpoptSettings
    settings: IpoptSettings

    def prepare(self) -> None:
        """Imports CasADi, before anything is asked."""
        super().prepare()
        self._casadi = import_casadi()

    def _commands(self, targets: Array, seed: int) -> Array:
        """Solves for one target after the other."""
        answers = [self._answer(target, seed) for target in targets]
        return np.array(answers).reshape(len(targets), self.plant.n, 3)

    def _answer(self, target: Array, seed: int) -> Array:
        """The command (n, 3) for a target (6,): the cheapest that delivers it, else the nearest."""
        over = thread_time() + self.settings.time_limit_s
        ends = list[Array]()
        for start in self._program.starts(target, self.settings.n_starts, seed):
            if ends and thread_time() > over:
                break
            ends.append(self._program.command(target, start))
        best = self._best(target, np.array(ends), POLISH)
        if np.linalg.norm((self.plant.wrench(best) - target) / self.asked_scale) > SOLVED:
            best = self._best(target, np.array(ends), APPROACH)
        return best

    @cached_property
    def _program(self) -> ForceProgram:
        """The program of this robot, made when it is first asked."""
        options = SOLVER_OPTIONS | {"ipopt.max_cpu_time": 0.5 * self.settings.time_limit_s}
        return ForceProgram(self._casadi, self._inverse, self.asked_scale, options)


def import_casadi() -> Any:
    """Returns the module `casadi`. Raises AllocationError: it is not installed."""
    try:
        import casadi
    except ImportError as error:
        raise AllocationError(
            f"method ipopt needs CasADi, which is not installed; run: {install_command('ipopt')}"
        ) from error
    return casadi
