"""Method `ipopt`: CasADi and IPOPT over the forces of the actuators; needs the extra `ipopt`.

The wrench is linear in the forces, but for the drag of foils, and what a force costs is known from
the compiled actuators: one or two variables for each remain. One start finds the least where no arc
is wider than half a turn but no full circle, and no fin is uneven. Dead bands are passed over.
"""

from dataclasses import dataclass
from functools import cached_property
from time import thread_time
from typing import Any

import numpy as np

from finlab.actuators.response import Group, Line, Plane, power_of
from finlab.allocation.baselines.pseudo_inverse import (
    SOLVED,
    ModelBased,
    PseudoInverse,
    TimeLimitedSettings,
    pushed_axes,
)
from finlab.allocation.settings import number
from finlab.arrays import Array
from finlab.assets import install
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
        self, casadi: Any, inverse: PseudoInverse, sigma: Array, options: dict[str, Any]
    ) -> None:
        """Makes the program and its solver.

        Args:
            casadi: the module, which is an extra.
            inverse: gives starts, and commands of forces.
            sigma: what wrenches (6,) are divided by [N, N m].
            options: of IPOPT.
        """
        self._inverse = inverse
        n = inverse.plant.n
        self._largest = np.maximum(inverse.largest, 1e-9)
        share = casadi.MX.sym("share", 2 * n)
        target = casadi.MX.sym("target", 6)
        per = np.repeat(self._largest, 2)
        wrench = casadi.DM(inverse.effectiveness * per) @ share + casadi.DM(inverse.wrench_offset)
        self._parts: list[_Line | _Plane | _Fixed] = []
        for response, index in zip(inverse.responses, inverse.group_indices, strict=True):
            i = index.actuator
            share_of_actuator = share[2 * i : 2 * i + 2]
            if inverse.is_fixed[i]:
                self._parts.append(_Fixed())
            elif isinstance(response, Plane):
                self._parts.append(_Plane(casadi, response, share_of_actuator))
            else:
                _, group = inverse.groups[index.group]
                largest = float(self._largest[i])
                line = _Line(casadi, response, share_of_actuator, largest, group, index.in_group)
                self._parts.append(line)
                wrench += line.wrench_offset
        self.convex = all(part.convex for part in self._parts)
        """Whether one start is enough, as far as actuators can rest."""
        cost: Any = sum(part.cost for part in self._parts)
        limits = [limit for part in self._parts for limit in part.limits]
        residual = (wrench - target) / casadi.DM(sigma)
        pushed = casadi.DM(pushed_axes(inverse.effectiveness * per / sigma[:, None])) @ residual
        limits += [(axis, 0.0, 0.0) for axis in casadi.vertsplit(pushed)]
        objective = cost / max(sum(part.full_cost for part in self._parts), 1e-300)
        conditions = casadi.vertcat(*(value for value, _, _ in limits))
        program = {"x": share, "p": target, "f": objective, "g": conditions}
        self._solver = casadi.nlpsol("forces", "ipopt", program, options)
        between = np.array([(low, high) for _, low, high in limits]).reshape(-1, 2).T
        ends = np.array([part.ends for part in self._parts]).reshape(-1, 2).T
        self._bounds = dict(zip(("lbg", "ubg", "lbx", "ubx"), (*between, *ends), strict=True))

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
            [[part.random(rng) for part in self._parts] for _ in range(n_random)]
        )
        return np.concatenate(
            [first, random_starts.reshape(-1, *first.shape[1:]) * self._largest[:, None]]
        )


class _Fixed:
    """One actuator that has one command alone: what it gives is beside the forces, its variables
    are 0."""

    limits = ()
    convex = True
    cost = full_cost = 0.0
    """See `_Line`."""
    ends = ((0.0, 0.0), (0.0, 0.0))
    """See `_Line`."""

    def random(self, rng: np.random.Generator) -> Array:
        """Shares (2,) within the limits."""
        return np.zeros(2)


class _Line:
    """One actuator of one direction in CasADi; `share` (2,) is its force over the largest one, and
    0."""

    limits = ()

    def __init__(
        self, casadi: Any, line: Line, share: Any, most: float, group: Group, place: int
    ) -> None:
        reverse = 0.0 if line.reverse is None else line.reverse.largest
        low = max(line.low, -reverse) / most
        high = min(line.high, line.table.largest) / most
        self.ends = [(low, high), (0.0, 0.0)]
        """Least and largest value of both variables."""
        grid = np.unique(np.concatenate([-LEVELS * reverse, LEVELS * line.table.largest])) / most
        if grid[0] == grid[-1]:
            grid = np.linspace(-1.0, 1.0, 5)
        cost = power_of(line, most * grid)
        self.cost, self.full_cost = _spline(casadi, grid, cost)(share[0]), float(cost.max())
        """Power [W] in CasADi, and at full load."""
        force = np.zeros((len(grid), len(group.responses), 2))
        at_rest = group.beside_of(force)
        force[:, place, 0] = most * grid
        extra = group.beside_of(force) - at_rest
        self.wrench_offset: Any = 0.0
        """Wrench (6,) in CasADi that comes on top, such as the drag of a foil."""
        if extra.any():
            self.wrench_offset = _spline(casadi, grid, extra.ravel())(share[0])
        self.convex = not extra.any()
        """Whether the wrench is linear in the force."""

    def random(self, rng: np.random.Generator) -> Array:
        """Shares (2,) within the limits."""
        return np.array([rng.uniform(*self.ends[0]), 0.0])


class _Plane:
    """One actuator of two directions in CasADi; `share` (2,) is its force over the largest one."""

    def __init__(self, casadi: Any, plane: Plane, share: Any) -> None:
        middle = plane.middle
        half = plane.half
        table = plane.table
        self._middle = middle
        self._half = half
        self.ends = [(-np.inf, np.inf)] * 2
        """See `_Line`."""
        self.convex = plane.gauge is None and (half <= 0.5 * np.pi or half >= np.pi)
        """Whether the set of forces has no gap, and no bulge."""
        strongest = 1.0 if plane.gauge is None else float(plane.gauge.max())
        ahead = strongest * (np.cos(middle) * share[0] + np.sin(middle) * share[1])
        aside = strongest * (np.cos(middle) * share[1] - np.sin(middle) * share[0])
        size = casadi.sqrt(ahead * ahead + aside * aside + SMOOTH**2)
        low = float(table.force[0]) / table.largest
        high = 1.0
        if plane.gauge is not None:
            end = max(half, NARROW)
            turn = casadi.atan2(aside, ahead + SMOOTH)  # at rest it has a slope, too
            turn = casadi.fmin(casadi.fmax(turn, -end), end)
            count = len(plane.gauge)
            along = end * DIRECTIONS
            known = np.append(plane.gauge, plane.gauge[0])
            gauge = np.interp((middle + along) % TURN, TURN / count * np.arange(count + 1), known)
            high = _spline(casadi, along, gauge)(turn)
        force = table.largest * (low + (1.0 - low) * LEVELS)
        watts = power_of(plane, force)
        cost = _spline(casadi, LEVELS, watts)
        self.cost, self.full_cost = (
            cost((size / high - low) / max(1.0 - low, 1e-9)),
            float(watts[-1]),
        )
        """See `_Line`."""
        self.limits: list[tuple[Any, float, float]] = [(size - high, -np.inf, 0.0)]
        """Values in CasADi, and between which two numbers they must lie."""
        if low > REST:
            self.limits.append((size - low * high, 0.0, np.inf))
        if half < NARROW:
            self.limits += [(aside, 0.0, 0.0), (ahead, 0.0, np.inf)]
        elif half <= 0.5 * np.pi:
            sides = (ahead * np.sin(half) + sign * aside * np.cos(half) for sign in (-1.0, 1.0))
            self.limits += [(side, 0.0, np.inf) for side in sides]
        elif half < np.pi:
            self.limits.append((ahead - size * np.cos(half), 0.0, np.inf))

    def random(self, rng: np.random.Generator) -> Array:
        """Shares (2,) within the arc."""
        angle = self._middle + rng.uniform(-1.0, 1.0) * self._half
        return rng.uniform() * np.array([np.cos(angle), np.sin(angle)])


def _spline(casadi: Any, grid: Array, values: Array) -> Any:
    """A function through values (K,) or (K * m,) at K points."""
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
        if np.linalg.norm((self.plant.wrench(best) - target) / self.sigma) > SOLVED:
            best = self._best(target, np.array(ends), APPROACH)
        return best

    @cached_property
    def _program(self) -> ForceProgram:
        """The program of this robot, made when it is first asked."""
        options = SOLVER_OPTIONS | {"ipopt.max_cpu_time": 0.5 * self.settings.time_limit_s}
        return ForceProgram(self._casadi, self._inverse, self.sigma, options)


def import_casadi() -> Any:
    """Returns the module `casadi`. Raises AllocationError: it is not installed."""
    try:
        import casadi
    except ImportError as error:
        raise AllocationError(
            f"method ipopt needs CasADi, which is not installed; run: {install('ipopt')}"
        ) from error
    return casadi
