"""IPOPT in the space of forces: the least cost over the planar forces of the fins, by their compiled tables.

The wrench is linear in the forces, and what a force costs is known from the compiled fins: two variables for
each fin remain, and where no arc is wider than half a turn but no full circle, one start finds the least.
"""

from typing import Any

import numpy as np

from finlab.allocation.baselines.pseudo_inverse import PseudoInverse
from finlab.arrays import Array
from finlab.forces.envelopes import Envelopes
from finlab.forces.fin_envelope import COST, LEVELS, levels
from finlab.layout.angles import wrapped

SMOOTH = 1e-4
"""Share of its largest force below which the size of a force is rounded off: it has slopes at rest, too."""
REST = 1e-3
"""Share of its largest force up to which a fin that cannot rest is taken for one that can."""
NARROW = 1e-6
"""Half of an arc [rad] below which a fin pushes along one line."""


class ForceProgram:
    """`err_norm^2 + weight * cost` over the planar forces of one robot, the target as its parameter.

    Args:
        casadi: the module.
        inverse: the robot; where the search starts, and what turns forces into commands.
        sigma: per-axis standard deviation (6,) of the error.
        weight: of the cost.
        options: of IPOPT.
    """

    def __init__(
        self, casadi: Any, inverse: PseudoInverse, sigma: Array, weight: float, options: dict[str, Any]
    ) -> None:
        self._inverse, self._fins = inverse, inverse.fins
        n, half = len(self._fins.half), self._fins.half
        self.convex = bool(((half <= 0.5 * np.pi) | (half >= np.pi)).all())
        """Whether one start is enough, as far as fins can rest."""
        share, target = casadi.MX.sym("share", 2 * n), casadi.MX.sym("target", 6)
        self._most = np.repeat(np.maximum(self._fins.maximum, 1e-12), 2)
        residual = casadi.DM(inverse.effectiveness * self._most / sigma[:, None]) @ share
        residual -= target / casadi.DM(sigma)
        fins = [_Fin(casadi, self._fins, i, share[2 * i : 2 * i + 2]) for i in range(n)]
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
        answer = self._solver(x0=start.ravel() / self._most, p=target, **self._bounds)
        force = np.array(answer["x"], np.float64).ravel() * self._most
        kept = force.reshape(start.shape) if np.isfinite(force).all() else start
        command: Array = self._inverse.decoded(kept[None])[0]
        return command

    def starts(self, target: Array, n_random: int, seed: int) -> Array:
        """Planar forces (S, n, 2) [N]: the pseudo-inverse's, and where arcs are wide, random ones."""
        first = self._inverse.force(target[None])
        if self.convex:
            return first
        fins, rng = self._fins, np.random.default_rng(seed)
        angle = fins.middle + rng.uniform(-1.0, 1.0, (n_random, len(fins.half))) * fins.half
        size = rng.uniform(0.0, 1.0, angle.shape) * fins.maximum
        drawn = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
        return np.concatenate([first, drawn])


class _Fin:
    """One compiled fin in CasADi; `share` (2,) is its planar force over its largest."""

    def __init__(self, casadi: Any, fins: Envelopes, place: int, share: Any) -> None:
        self._casadi = casadi
        count, most = fins.largest.shape[1], max(float(fins.maximum[place]), 1e-12)
        middle, half = float(fins.middle[place]), float(fins.half[place])
        ahead = np.cos(middle) * share[0] + np.sin(middle) * share[1]
        aside = np.cos(middle) * share[1] - np.sin(middle) * share[0]
        size = casadi.sqrt(ahead * ahead + aside * aside + SMOOTH**2)
        largest, smallest = fins.largest[place] / most, fins.smallest[place] / most
        table = fins.table.reshape(-1, count, LEVELS, fins.table.shape[-1])[place, :, :, COST]
        spread = float(fins.domain[1, place])
        if count == 1 or spread < NARROW:
            high, low = float(largest[0]), float(smallest[0])
            self.cost = self._spline([levels()], table[0])((size - low) / max(high - low, 1e-9))
        else:
            along = wrapped(fins.domain[0, place] - middle) + spread * np.linspace(-1.0, 1.0, count)
            turn = casadi.atan2(aside, ahead + SMOOTH)  # at rest it has a slope, too
            high, low = (self._spline([along], values)(turn) for values in (largest, smallest))
            level = (size - low) / casadi.fmax(high - low, 1e-9)
            self.cost = self._spline([along, levels()], table)(casadi.vertcat(turn, level))
        self.limits: list[tuple[Any, float, float]] = [(size - high, -np.inf, 0.0)]
        """Values in CasADi, and between which two numbers they must lie."""
        if smallest.max() > REST:
            self.limits.append((size - low, 0.0, np.inf))
        if half < NARROW:
            self.limits += [(aside, 0.0, 0.0), (ahead, 0.0, np.inf)]
        elif half <= 0.5 * np.pi:
            sides = (ahead * np.sin(half) + sign * aside * np.cos(half) for sign in (-1.0, 1.0))
            self.limits += [(side, 0.0, np.inf) for side in sides]
        elif half < np.pi:
            self.limits.append((ahead - size * np.cos(half), 0.0, np.inf))

    def _spline(self, grid: list[Array], values: Array) -> Any:
        return self._casadi.interpolant(
            "spline", "bspline", [axis.tolist() for axis in grid], values.ravel(order="F")
        )
