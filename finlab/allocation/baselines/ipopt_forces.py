"""IPOPT in the space of forces: the least power over the planar forces of the fins, as they are compiled.

The wrench is linear in the forces, and what a force costs is known from the compiled fins: two variables for
each fin remain, and where no arc is wider than half a turn but no full circle, one start finds the least.
"""

from typing import Any

import numpy as np

from finlab.actuators.response import Plane
from finlab.allocation.baselines.pseudo_inverse import PseudoInverse
from finlab.allocation.dual.answers import Answers
from finlab.arrays import Array
from finlab.layout.angles import TURN

LEVELS = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, 65)) ** 4
"""Shares of the range of sizes at which a cost is looked up: dense at both ends, where costs bend."""
DIRECTIONS = np.linspace(-1.0, 1.0, 97)
"""Places in an arc at which an uneven fin is looked up, from end to end."""
SMOOTH = 1e-4
"""Share of its largest force below which the size of a force is rounded off: it has slopes at rest, too."""
REST = 1e-3
"""Share of its largest force up to which a fin that cannot rest is taken for one that can."""
NARROW = 1e-6
"""Half of an arc [rad] below which a fin pushes along one line."""


class ForceProgram:
    """`err_norm^2 + weight * power` over the planar forces of one robot, the target as its parameter.

    Args:
        casadi: the module.
        inverse: the robot; where the search starts, and what turns forces into commands.
        sigma: per-axis standard deviation (6,) of the error.
        weight: of the power.
        options: of IPOPT.
    """

    def __init__(
        self, casadi: Any, inverse: PseudoInverse, sigma: Array, weight: float, options: dict[str, Any]
    ) -> None:
        self._inverse, planes = inverse, inverse.fins.planes
        n, self._half = len(planes), np.array([plane.half for plane in planes])
        self._middle = np.array([plane.middle for plane in planes])
        self.convex = bool(((self._half <= 0.5 * np.pi) | (self._half >= np.pi)).all())
        """Whether one start is enough, as far as fins can rest."""
        share, target = casadi.MX.sym("share", 2 * n), casadi.MX.sym("target", 6)
        self._largest = np.array([plane.table.largest for plane in planes])
        most = np.repeat(self._largest, 2)
        residual = casadi.DM(inverse.effectiveness * most / sigma[:, None]) @ share
        residual -= target / casadi.DM(sigma)
        fins = [_Fin(casadi, plane, share[2 * i : 2 * i + 2]) for i, plane in enumerate(planes)]
        program = {
            "x": share,
            "p": target,
            "f": casadi.sumsqr(residual) + weight * sum(fin.cost for fin in fins),
            "g": casadi.vertcat(*(value for fin in fins for value, _, _ in fin.limits)),
        }
        self._solver = casadi.nlpsol("forces", "ipopt", program, options)
        ends = np.array([(low, high) for fin in fins for _, low, high in fin.limits])
        self._bounds = {"lbg": ends[:, 0], "ubg": ends[:, 1]}

    def command(self, target: Array, start: Array) -> Array:
        """The command (n, 3) for a target (6,) where IPOPT ends from planar forces (n, 2) [N]."""
        most = np.repeat(self._largest, 2)
        answer = self._solver(x0=start.ravel() / most, p=target, **self._bounds)
        force = np.array(answer["x"], np.float64).ravel() * most
        kept = force.reshape(start.shape) if np.isfinite(force).all() else start
        command: Array = self._inverse.decoded(kept[None])[0]
        return command

    def starts(self, target: Array, n_random: int, seed: int) -> Array:
        """Planar forces (S, n, 2) [N]: the pseudo-inverse's, and where arcs are wide, random ones."""
        first = self._inverse.force(target[None])
        if self.convex:
            return first
        rng = np.random.default_rng(seed)
        angle = self._middle + rng.uniform(-1.0, 1.0, (n_random, len(self._half))) * self._half
        size = rng.uniform(0.0, 1.0, angle.shape) * self._largest
        drawn = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
        return np.concatenate([first, drawn])


class _Fin:
    """One compiled fin in CasADi; `share` (2,) is its planar force over the largest one of its table."""

    def __init__(self, casadi: Any, plane: Plane, share: Any) -> None:
        self._casadi = casadi
        middle, half, table = plane.middle, plane.half, plane.table
        ahead = np.cos(middle) * share[0] + np.sin(middle) * share[1]
        aside = np.cos(middle) * share[1] - np.sin(middle) * share[0]
        size = casadi.sqrt(ahead * ahead + aside * aside + SMOOTH**2)
        low, high = float(table.force[0]) / table.largest, 1.0
        if plane.gauge is not None:
            end = max(half, NARROW)
            turn = casadi.atan2(aside, ahead + SMOOTH)  # at rest it has a slope, too
            turn = casadi.fmin(casadi.fmax(turn, -end), end)
            count, along = len(plane.gauge), end * DIRECTIONS
            known = np.append(plane.gauge, plane.gauge[0])
            gauge = np.interp((middle + along) % TURN, TURN / count * np.arange(count + 1), known)
            high = self._spline(along, gauge)(turn)
        force = table.largest * (low + (1.0 - low) * LEVELS)
        cost = self._spline(LEVELS, Answers([], [plane]).cost(force[None])[0])
        self.cost = cost((size / high - low) / max(1.0 - low, 1e-9))
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

    def _spline(self, grid: Array, values: Array) -> Any:
        return self._casadi.interpolant("spline", "bspline", [grid.tolist()], values)
