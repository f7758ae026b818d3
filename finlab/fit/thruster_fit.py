"""A thruster from its bench table: force and power over the command, and how sure the force is.

Each side is a cubic regression spline over the command; leave-one-out errors choose the number of its knots
(PRESS, Allen 1974). Where rows hardly scatter about it they are kept as measured, else the spline stands for
them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import isotonic_regression, nnls

from finlab.arrays import Array
from finlab.errors import DataError, LayoutError
from finlab.fit.thruster_bench import Bench
from finlab.layout.thrust_model import PowerTable
from finlab.layout.uncertainty import Uncertainty

NO_FORCE = 0.002
"""Share of the largest force up to which a command counts as at rest, or ..."""
NEAR_REST, MANY = 0.05, 8
"""... the scatter of forces below this share of the largest one, where that many commands have such."""
KNOTS = (0, 1, 2, 3, 5, 8, 13, 21, 34)
"""Numbers of inner knots that are tried."""
LEVEL = 0.05
"""Share of a side's largest value that is added to each value, whose inverse is its weight."""
SCATTER, LEVERAGE = 0.015, 0.3
"""Scatter over the largest force from which on the spline stands for the rows, if it averages over enough of
them: if their mean leverage is less than this."""
NOT_CONVEX = 0.1
"""Share of a side's largest power by which a convex curve may miss the rows, root mean square."""
MOST_KEPT, FEW = 400, 60
"""Commands of a side beyond which the spline stands for them, too, and rows that stand for it."""
DIGITS = (12, 6, 6)
"""Digits of commands, forces and powers."""
FALL, FAR = 0.04, 6.0
"""Share of the largest force by which the force may lie off its rising mean, and how many times what
seven in ten rows keep to more."""


@dataclass(frozen=True)
class ThrusterFit:
    """A thruster as its bench shows it."""

    table: PowerTable
    """Command, force [N] and power [W]."""
    still: tuple[float, float] | None
    """Commands between which there is no force, as far as there are such rows."""
    dead_band: float
    """Least force beside a dead band [N]; 0 where none was seen."""
    torque_per_newton: float
    """Slope of torque over force [m]; 0 where no torque was measured."""
    uncertainty: Uncertainty | None
    """Standard deviation of the table's force; None where rows are too few to tell."""
    notes: tuple[str, ...]
    """What was filled in or left aside, a sentence each."""

    @property
    def force(self) -> tuple[float, float]:
        """Least and most force [N]."""
        return self.table.rows[0][1], self.table.rows[-1][1]


def fit_thruster(bench: Bench) -> ThrusterFit:
    """Returns the thruster that explains the rows.

    Raises:
        DataError: the force falls with the command, is nowhere near 0, or takes a power that is not convex.
    """
    try:
        return _fitted(bench)
    except (DataError, LayoutError) as error:
        raise DataError(f"{bench.source}: {error}") from None


def _fitted(bench: Bench) -> ThrusterFit:
    command, where, count = np.unique(bench.command, return_inverse=True, return_counts=True)
    force, power = (np.bincount(where, values) / count for values in (bench.force, bench.power))
    largest, notes = float(np.abs(force).max()), list(bench.notes)
    rising = isotonic_regression(force, weights=count).x
    side = _sides(command, force, rising, bench.unit)
    rest = side == 0
    idle = float(power[rest].min()) if rest.any() else 0.0
    curves = []
    for sign, name in ((-1.0, "negative"), (1.0, "positive")):
        own = side[where] == sign
        if own.any():
            curves.append(_Side(sign, bench.command[own], bench.force[own], bench.power[own], largest))
        else:
            notes.append(f"no {name} forces were measured: the thruster pushes one way")
    at_rest = np.stack([command[rest], 0.0 * command[rest], np.full(rest.sum(), idle)])
    rows = np.concatenate([at_rest, *(curve.rows(idle) for curve in curves)], axis=1).T
    rows = np.array([[float(f"{value:.{n}g}") for value, n in zip(row, DIGITS, strict=True)] for row in rows])
    rows = rows[np.argsort(rows[:, 0])]
    nearest = (*rows[rows[:, 1] < 0.0][-1:], *rows[rows[:, 1] > 0.0][:1])
    still = rows[rows[:, 1] == 0.0, 0]
    return ThrusterFit(
        table=PowerTable(tuple(map(tuple, rows.tolist())), bench.unit),
        still=(float(still[0]), float(still[-1])) if len(still) else None,
        dead_band=min(abs(float(row[1])) for row in nearest) if len(still) > 1 else 0.0,
        torque_per_newton=(
            0.0 if bench.torque is None else float(bench.torque @ bench.force / (bench.force @ bench.force))
        ),
        uncertainty=_deviation([curve.error for curve in curves]),
        notes=tuple(notes),
    )


class _Side:
    """One side of a thruster, as if it pushed forward: commands rise with the force."""

    def __init__(self, sign: float, command: Array, force: Array, power: Array, largest: float) -> None:
        """Takes the side, rows (n,) of it in any order, and the largest force of both sides [N]."""
        self._sign, self._command, self._power = sign, sign * command, power
        command, force = sign * command, sign * force
        places, where, count = np.unique(command, return_inverse=True, return_counts=True)
        size = np.bincount(where, force) / count
        self.error = np.empty((0, 2))
        """Force [N] and squared error of the curve (n, 2)."""
        if len(places) > 2:
            spline, fitted, leverage = _spline(command, force)
            fitted = np.maximum(fitted, 0.0)
            found = _deviation([np.stack([fitted, (force - fitted) ** 2 / (1.0 - leverage)], axis=1)])
            assert found is not None
            variance = (found.share * fitted) ** 2 + found.floor**2
            noisy = variance.max() > (SCATTER * largest) ** 2 and leverage.mean() < LEVERAGE
            if noisy or len(places) > MOST_KEPT:
                places = places if len(places) <= FEW else np.linspace(places[0], places[-1], FEW)
                size, variance = spline(places), variance * leverage
            else:
                variance = variance / count[where] + _bend(places, size)[where] ** 2 / 30.0
            self.error = np.stack([fitted, variance], axis=1)
        self._places, self._size = places, np.maximum(isotonic_regression(size).x, NO_FORCE * largest)

    def rows(self, idle: float) -> Array:
        """Returns command, force and power (3, K), from the power at rest [W] on."""
        size = np.interp(self._command, self._places, self._size)
        watts = _convex(size, self._power, self._size, idle)
        return np.stack([self._sign * self._places, self._sign * self._size, watts])


def _bend(x: Array, y: Array) -> Array:
    """Returns how far values (K,) lie off the chords between their neighbours (K,); the mean square of what a
    line between rows misses is a thirtieth of its square."""
    chord = y[:-2] + (y[2:] - y[:-2]) * (x[1:-1] - x[:-2]) / (x[2:] - x[:-2])
    return np.pad(y[1:-1] - chord, 1, mode="edge")


def _convex(size: Array, watts: Array, knots: Array, idle: float) -> Array:
    """Returns powers [W] at the knots (K,): the convex curve from `idle` at rest on that is nearest to powers
    (n,) of forces (n,) [N], relative to their size.

    Raises:
        DataError: no convex curve is near.
    """
    bends = np.concatenate([[0.0], np.unique(knots)[:-1]])
    weight = _weight(size, watts)
    rise, _ = nnls(np.maximum(size[:, None] - bends, 0.0) * weight[:, None], (watts - idle) * weight)
    missed = np.sqrt(np.mean((idle + np.maximum(size[:, None] - bends, 0.0) @ rise - watts) ** 2))
    if missed > NOT_CONVEX * watts.max():
        raise DataError(
            f"the power does not grow ever faster with the force: the nearest curve that does misses it by "
            f"{missed:.3g} W of {watts.max():.4g} W; are force and power of the same rows?"
        )
    return np.asarray(idle + np.maximum(knots[:, None] - bends, 0.0) @ rise)


def _spline(x: Array, y: Array) -> tuple[BSpline, Array, Array]:
    """Returns the regression spline of values (n,) over places (n,), its values there, and leverages (n,)."""
    places = np.unique(x)
    weight = _weight(x, y)
    degree, best, least = min(3, len(places) - 2), None, np.inf
    for count in KNOTS:
        if count and count + degree + 2 > len(places):
            break
        inner = np.quantile(places, np.linspace(0.0, 1.0, count + 2))
        knots = np.concatenate([np.full(degree, places[0]), inner, np.full(degree, places[-1])])
        basis = BSpline.design_matrix(x, knots, degree).toarray()
        q, r = np.linalg.qr(basis * weight[:, None])
        leverage = np.minimum((q**2).sum(axis=1), 1.0 - 1e-6)
        share = q.T @ (weight * y)
        left_out = (weight * y - q @ share) / (1.0 - leverage)
        if (left_out**2).mean() < least:
            least = float((left_out**2).mean())
            best = BSpline(knots, np.linalg.solve(r, share), degree), q @ share / weight, leverage
    assert best is not None
    return best


def _weight(x: Array, y: Array) -> Array:
    """Returns the inverse of what rising values (n,) over places (n,) are about, without their noise: that
    would make low ones count for more."""
    order = np.argsort(x, kind="stable")
    level = np.empty_like(y)
    level[order] = isotonic_regression(y[order]).x
    return np.asarray(1.0 / (np.maximum(level, 0.0) + LEVEL * level.max()))


def _deviation(parts: Sequence[Array]) -> Uncertainty | None:
    """Returns the standard deviation that grows with the force as squares (n, 2) over forces [N] tell; None
    where there are none."""
    size, square = np.concatenate(parts).T
    if not len(size):
        return None
    weight = 1.0 / (size + LEVEL * size.max()) ** 2
    share, floor = np.sqrt(
        nnls(np.stack([size**2, np.ones_like(size)], axis=1) * weight[:, None], square * weight)[0]
    )
    return Uncertainty(float(f"{share:.3g}"), float(f"{floor:.3g}"))


def _sides(command: Array, force: Array, rising: Array, unit: str) -> Array:
    """Returns the side of each command, -1, 0 at rest or 1 (k,), by forces and rising means (k,) [N].

    Raises:
        DataError: forces lie farther off their rising means than scatter explains, or none is near 0.
    """
    largest = float(np.abs(force).max())
    if force[-1] <= force[0]:
        raise DataError(
            f"the force falls with the command, from {force[0]:.4g} N at {command[0]:g} {unit} to "
            f"{force[-1]:.4g} N at {command[-1]:g}; give the forces, or the commands, the other sign"
        )
    near = np.abs(rising) < NEAR_REST * largest
    noise = float(np.sqrt(np.mean((force - rising)[near] ** 2))) if near.sum() >= MANY else 0.0
    side = np.where(np.abs(rising) <= max(NO_FORCE * largest, noise), 0.0, np.sign(rising))
    if side.min() * side.max() > 0.0:
        first = int(np.argmin(np.abs(force)))
        raise DataError(
            f"no force is near 0, the least is {force[first]:.4g} N at {command[first]:g} {unit}; add the "
            "command that stops the thruster"
        )
    level = np.maximum(np.abs(rising), LEVEL * largest)
    away = np.abs(force - rising)
    wrong = away - FALL * largest - FAR * np.quantile(away / level, 0.7) * level
    if wrong.max() > 0.0:
        k = int(np.argmax(wrong))
        raise DataError(
            f"the force falls with the command about {command[k]:g} {unit}: {force[k]:.4g} N there, expected "
            f"about {rising[k]:.4g} N by the rows beside it; leave out wrong rows, and what lies beyond the "
            "largest force"
        )
    return side
