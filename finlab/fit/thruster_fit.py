"""A thruster from its bench table, rising force and convex power over the command, and the file of
it.

Rows of one command are averaged, and neighbours where there are very many. How sure the force is,
the table's own rows tell (`finlab.physics.table_error`).
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import isotonic_regression, nnls

from finlab.actuators.fin.force_table_file import table_text
from finlab.actuators.thrust_model import COLUMNS, PowerTable
from finlab.arrays import Array
from finlab.errors import DataError, LayoutError
from finlab.fit.thruster_bench import BenchData

NO_FORCE = 0.002
"""Share of the largest force up to which a command counts as at rest, or ..."""
NEAR_REST, MANY = 0.05, 8
"""... the scatter of forces below this share of the largest one, where that many commands have
such."""
LEVEL = 0.05
"""Share of the largest value that is added to each value, whose inverse is its weight."""
NOT_CONVEX = 0.1
"""Share of a side's largest power by which a convex curve may miss the rows, root mean square."""
MOST = 250
"""Most commands of the table; of more, neighbours are averaged."""
DIGITS = (12, 6, 6)
"""Digits of commands, forces and powers."""
FALL = 0.12
"""Share of the largest force by which the force may lie off its rising mean."""


@dataclass(frozen=True)
class ThrusterFit:
    """A thruster as its bench shows it, by command, force [N] and power [W]."""

    table: PowerTable
    still: tuple[float, float] | None
    """Commands between which there is no force, as far as there are such rows."""
    dead_band: float
    """Least force beside a dead band [N]; 0 where none was seen."""
    torque_per_newton: float
    """Slope of torque over force [m]; 0 where no torque was measured."""
    notes: tuple[str, ...]
    """What was filled in or left aside, a sentence each."""

    @property
    def force(self) -> tuple[float, float]:
        """Least and most force [N]."""
        return self.table.rows[0][1], self.table.rows[-1][1]


def fit_thruster(bench: BenchData) -> ThrusterFit:
    """Returns the thruster that explains the rows. Raises DataError: the force falls with the
    command, is nowhere near 0, or takes a power that is not convex."""
    try:
        return _fitted(bench)
    except (DataError, LayoutError) as error:
        raise DataError(f"{bench.source}: {error}") from None


def _fitted(bench: BenchData) -> ThrusterFit:
    places = bench.command
    if len(np.unique(places)) > MOST:
        edges = np.linspace(places[0], places[-1], MOST)
        places = edges[np.searchsorted(edges, places)]
    _, where, count = np.unique(places, return_inverse=True, return_counts=True)
    command, force, power = (
        np.bincount(where, values) / count for values in (bench.command, bench.force, bench.power)
    )
    rising = isotonic_regression(force, weights=count).x
    side = _sides(command, force, rising, bench.unit)
    notes = list(bench.notes)
    idle = float(power[side == 0].min()) if (side == 0).any() else 0.0
    least = NO_FORCE * float(np.abs(force).max())
    thrust = np.where(side == 0, 0.0, side * np.maximum(side * rising, least))
    watts = np.full(len(thrust), idle)
    for sign, name in ((-1.0, "negative"), (1.0, "positive")):
        own = side == sign
        if own.any():
            watts[own] = _convex(np.abs(thrust[own]), power[own], idle)
        else:
            notes.append(f"no {name} forces were measured: the thruster pushes one way")
    columns = zip((command, thrust, watts), DIGITS, strict=True)
    rows = np.array([[float(f"{value:.{n}g}") for value in column] for column, n in columns]).T
    nearest = (*rows[rows[:, 1] < 0.0][-1:], *rows[rows[:, 1] > 0.0][:1])
    still = rows[rows[:, 1] == 0.0, 0]
    arm = (
        0.0
        if bench.torque is None
        else float(bench.torque @ bench.force / (bench.force @ bench.force))
    )
    return ThrusterFit(
        table=PowerTable(tuple(map(tuple, rows.tolist())), bench.unit),
        still=(float(still[0]), float(still[-1])) if len(still) else None,
        dead_band=min(abs(float(row[1])) for row in nearest) if len(still) > 1 else 0.0,
        torque_per_newton=arm,
        notes=tuple(notes),
    )


def _convex(size: Array, watts: Array, idle: float) -> Array:
    """The powers (k,) [W] of the convex curve from `idle` at rest on that is nearest to powers (k,)
    of forces (k,) [N], relative to their size. Raises DataError: no convex curve is near."""
    bends = np.concatenate([[0.0], np.unique(size)[:-1]])
    beyond = np.maximum(size[:, None] - bends, 0.0)
    order = np.argsort(size, kind="stable")
    level = np.empty_like(watts)
    level[order] = isotonic_regression(watts[order]).x
    weight = 1.0 / (np.maximum(level, 0.0) + LEVEL * level.max())
    rise, _ = nnls(beyond * weight[:, None], (watts - idle) * weight)
    curve = idle + beyond @ rise
    missed = np.sqrt(np.mean((curve - watts) ** 2))
    if missed > NOT_CONVEX * watts.max():
        why = (
            f"misses it by {missed:.3g} W of {watts.max():.4g} W; are force and power of the same "
            "rows?"
        )
        raise DataError(
            f"the power does not grow ever faster with the force: the nearest such curve {why}"
        )
    return np.asarray(curve)


def _sides(command: Array, force: Array, rising: Array, unit: str) -> Array:
    """The side of each command, -1, 0 at rest or 1 (k,), by forces and rising means (k,) [N].
    Raises DataError: forces lie far off their rising means, or none is near 0."""
    largest = float(np.abs(force).max())
    if force[-1] <= force[0]:
        raise DataError(
            f"the force falls with the command, from {force[0]:.4g} N at {command[0]:g} {unit} to "
            f"{force[-1]:.4g} N at {command[-1]:g}; give the forces, or the commands, the other "
            "sign"
        )
    near = np.abs(rising) < NEAR_REST * largest
    noise = float(np.sqrt(np.mean((force - rising)[near] ** 2))) if near.sum() >= MANY else 0.0
    side = np.where(np.abs(rising) <= max(NO_FORCE * largest, noise), 0.0, np.sign(rising))
    if side.min() * side.max() > 0.0:
        first = int(np.argmin(np.abs(force)))
        raise DataError(
            f"no force is near 0, the least is {force[first]:.4g} N at {command[first]:g} {unit}; "
            "add the "
            "command that stops the thruster"
        )
    away = np.abs(force - rising)
    if away.max() > FALL * largest:
        k = int(np.argmax(away))
        raise DataError(
            f"the force falls with the command about {command[k]:g} {unit}: {force[k]:.4g} N "
            "there, expected "
            f"about {rising[k]:.4g} N by the rows beside it; leave out wrong rows, and what lies "
            "beyond the "
            "largest force"
        )
    return side


def layout_lines(fit: ThrusterFit, path: Path) -> tuple[str, ...]:
    """Returns the keys of a thruster in a layout beside a table at a path."""
    least, most = fit.force
    torque = fit.torque_per_newton
    unit = f", unit: {fit.table.unit}" if fit.table.unit else ""
    name = json.dumps(path.name, ensure_ascii=False)  # text to YAML, whatever it is made of
    return (
        f"force_n: [{least:g}, {most:g}]",
        *([f"dead_band_n: {fit.dead_band:g}"] if fit.dead_band > 0.0 else []),
        *([f"torque_per_newton_m: {torque:.4g}"] if torque != 0.0 else []),
        f"model: {{type: table, path: {name}{unit}}}",
    )


def thruster_csv(fit: ThrusterFit, path: Path) -> str:
    """Returns the file's text: lines that begin with # and say what the fit found, a header, the
    rows."""
    return table_text((*summary(fit), *layout_lines(fit, path)), COLUMNS, fit.table.rows, 12)


def summary(fit: ThrusterFit) -> tuple[str, ...]:
    """Returns what was found, a line each."""
    unit = f" {fit.table.unit}" if fit.table.unit else ""
    least, most = fit.force
    still = f"; none from {fit.still[0]:g} to {fit.still[1]:g}{unit}" if fit.still else ""
    return (f"force {least:.4g} to {most:.4g} N{still}", *fit.notes)
