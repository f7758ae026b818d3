"""Fits a thruster to its bench: rising force and convex power over the command, and the file of it.

Rows of one command are averaged, and neighbours where there are very many. The uncertainty of the
force comes from the table's rows (`finlab.physics.table_error`).
"""

import json
from collections.abc import Sequence
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
"""Share of the largest force up to which a command gives no force, unless the noise is larger."""
SMALL_FORCE = 0.05
"""Share of the largest force below which forces show their noise."""
MIN_SMALL_FORCES = 8
"""Fewest such forces by which the noise is estimated."""
REST_NOISE = 0.06
"""Share of the largest force up to which the forces of one side are noise at rest."""
COARSE_STEP = 0.02
"""Share of the largest force above which the first force beside rest is one of the bench's steps,
and tells of no dead band."""
MISSED_POWER = 0.3
"""Share of a measured power by which the table may miss it without a note."""
MISSED_SHARE = 0.03
"""As `MISSED_POWER`, of the largest power."""
WEIGHT_FLOOR = 0.05
"""Share of the largest power that is added to each power, whose inverse is its weight."""
MAX_CONVEX_ERROR = 0.1
"""Share of a side's largest power by which a convex curve may miss the rows, root mean square."""
MAX_COMMANDS = 250
"""Most commands of the table; of more, neighbours are averaged."""
COMMAND_DIGITS = 12
"""Significant digits of commands in the table."""
VALUE_DIGITS = 6
"""Significant digits of forces and powers in the table."""
MAX_FALL = 0.12
"""Share of the largest force by which the force may lie off its rising mean."""


@dataclass(frozen=True)
class ThrusterFit:
    """A thruster by its bench: a table of command, force [N] and power [W]."""

    table: PowerTable
    idle_commands: tuple[float, float] | None
    """Least and greatest command without force; None where no row has one."""
    dead_band: float
    """Least force beside a dead band [N]; 0 where none was seen."""
    torque_per_newton: float
    """Slope of torque over force [m]; 0 where no torque was measured."""
    notes: tuple[str, ...]
    """Sentences on what was filled in or not used."""

    @property
    def force(self) -> tuple[float, float]:
        """Least and most force [N]."""
        return self.table.rows[0][1], self.table.rows[-1][1]


def fit_thruster(bench: BenchData) -> ThrusterFit:
    """Returns the thruster that explains the rows of a bench.

    Raises:
        DataError: the force falls with the command, is nowhere near 0, or takes a power that is not
            convex.
    """
    try:
        return _fit(bench)
    except (DataError, LayoutError) as error:
        raise DataError(f"{bench.source}: {error}") from None


def _fit(bench: BenchData) -> ThrusterFit:
    """As `fit_thruster`; the errors do not name the bench."""
    cells = bench.command
    if len(np.unique(cells)) > MAX_COMMANDS:
        edges = np.linspace(cells[0], cells[-1], MAX_COMMANDS)
        cells = edges[np.searchsorted(edges, cells)]
    _, cell, count = np.unique(cells, return_inverse=True, return_counts=True)
    command = np.bincount(cell, bench.command) / count
    force = np.bincount(cell, bench.force) / count
    power = np.bincount(cell, bench.power) / count
    rising = isotonic_regression(force, weights=count).x
    direction = _directions(command, force, rising, bench.unit)
    notes = list(bench.notes)
    direction = _one_way(command, rising, direction, bench.unit, notes)
    is_idle = direction == 0
    idle_power = float(power[is_idle].min()) if is_idle.any() else 0.0
    smallest_force = NO_FORCE * float(np.abs(force).max())
    magnitude = np.maximum(direction * rising, smallest_force)
    thrust = np.where(is_idle, 0.0, direction * magnitude)
    convex_power = np.full(len(thrust), idle_power)
    for sign, name in ((-1.0, "negative"), (1.0, "positive")):
        is_side = direction == sign
        if is_side.any():
            convex_power[is_side] = _convex(np.abs(thrust[is_side]), power[is_side], idle_power)
        else:
            notes.append(f"no {name} forces were measured: the thruster pushes one way")
    _note_missed_power(command, power, convex_power, bench.unit, notes)
    rows = tuple(
        zip(
            _rounded(command, COMMAND_DIGITS),
            _rounded(thrust, VALUE_DIGITS),
            _rounded(convex_power, VALUE_DIGITS),
            strict=True,
        )
    )
    idle_commands = [row_command for row_command, row_force, _ in rows if row_force == 0.0]
    dead_band = _dead_band(rows, bench.unit, notes) if len(idle_commands) > 1 else 0.0
    torque_per_newton = 0.0
    if bench.torque is not None:
        # The least-squares slope of torque over force, through the origin.
        torque_per_newton = float(bench.torque @ bench.force / (bench.force @ bench.force))
    return ThrusterFit(
        table=PowerTable(rows, bench.unit),
        idle_commands=(idle_commands[0], idle_commands[-1]) if idle_commands else None,
        dead_band=dead_band,
        torque_per_newton=torque_per_newton,
        notes=tuple(notes),
    )


def _one_way(command: Array, rising: Array, direction: Array, unit: str, notes: list[str]) -> Array:
    """The directions (k,), without a side that is no more than the noise of a load cell at rest.

    Args:
        command: commands (k,) in the bench's unit.
        rising: their forces, which never fall (k,) [N].
        direction: their directions (k,) by `_directions`.
        unit: the unit of the commands.
        notes: gets the rows that are left out.
    """
    size = np.abs(rising)
    largest = {sign: float(size[direction == sign].max(initial=0.0)) for sign in (-1.0, 1.0)}
    weak, strong = sorted(largest, key=lambda sign: largest[sign])
    noise = largest[weak]
    if not 0.0 < noise <= REST_NOISE * largest[strong]:
        return direction
    is_rest = size <= noise
    first = float(command[is_rest].min())
    last = float(command[is_rest].max())
    span = f"{first:g} to {last:g} {unit}".rstrip()
    share = 100.0 * noise / largest[strong]
    notes.append(
        f"forces of up to {noise:.3g} N at {span} are {share:.2g} % of the largest: they count as "
        "noise of the load cell at rest, and their rows as without force"
    )
    return np.where(is_rest, 0.0, direction)


def _dead_band(rows: Sequence[tuple[float, float, float]], unit: str, notes: list[str]) -> float:
    """The least force beside a dead band [N]; 0, with a note, where it is no more than a step of
    the bench.

    Args:
        rows: commands, forces [N] and powers of the table.
        unit: the unit of the commands.
        notes: gets the step.
    """
    pushing = [row for row in rows if row[1] != 0.0]
    command, force, _ = min(pushing, key=lambda row: abs(row[1]))
    largest = max(abs(row[1]) for row in pushing)
    if abs(force) <= COARSE_STEP * largest:
        return abs(force)
    where = f"{command:g} {unit}".rstrip()
    notes.append(
        f"the first force beside rest is {force:.4g} N at {where}, a coarse step: whether forces "
        "between 0 and that can be held is not measured, so no dead band is written, and they are "
        "interpolated; measure there in finer steps"
    )
    return 0.0


def _note_missed_power(
    command: Array, measured: Array, taken: Array, unit: str, notes: list[str]
) -> None:
    """Says where the table's power (k,) is far from the one that was measured (k,) [W]."""
    missed = np.abs(taken - measured)
    far = (missed > MISSED_POWER * measured) & (missed > MISSED_SHARE * measured.max())
    if far.any():
        k = int(np.argmax(np.where(far, missed, 0.0)))
        notes.append(
            f"{int(far.sum())} rows have another power in the table than was measured, as at "
            f"{command[k]:g} {unit}".rstrip()
            + f" {taken[k]:.3g} W for {measured[k]:.3g} W: the "
            "power over the force is the nearest convex curve"
        )


def _rounded(values: Array, digits: int) -> list[float]:
    """Values with so many significant digits."""
    return [float(f"{value:.{digits}g}") for value in values]


def _convex(size: Array, watts: Array, idle: float) -> Array:
    """The nearest convex curve of power over force, by non-negative least squares.

    The curve is P(F) = P_idle + sum_j a_j max(F - F_j, 0) with slopes a_j >= 0, whose kinks F_j are
    at 0 and at the forces.

    Args:
        size: sizes of the forces (k,) [N].
        watts: powers (k,) [W].
        idle: power at rest [W].

    Returns:
        Powers of the curve (k,) [W].

    Raises:
        DataError: no convex curve is near.
    """
    kinks = np.concatenate([[0.0], np.unique(size)[:-1]])
    hinges = np.maximum(size[:, None] - kinks, 0.0)
    order = np.argsort(size, kind="stable")
    rising = np.empty_like(watts)
    rising[order] = isotonic_regression(watts[order]).x
    weight = 1.0 / (np.maximum(rising, 0.0) + WEIGHT_FLOOR * rising.max())
    slopes, _ = nnls(hinges * weight[:, None], (watts - idle) * weight)
    curve = idle + hinges @ slopes
    error = np.sqrt(np.mean((curve - watts) ** 2))
    if error > MAX_CONVEX_ERROR * watts.max():
        reason = (
            f"misses it by {error:.3g} W of {watts.max():.4g} W; are force and power of the same "
            "rows?"
        )
        raise DataError(
            f"the power does not grow ever faster with the force: the nearest such curve {reason}"
        )
    return np.asarray(curve)


def _directions(command: Array, force: Array, rising: Array, unit: str) -> Array:
    """The direction in which each command pushes, (k,): -1, 0 without force, or 1.

    Args:
        command: commands (k,) in the bench's unit.
        force: their mean forces (k,) [N].
        rising: the nearest forces that never fall with the command (k,) [N].
        unit: the unit of the commands.

    Raises:
        DataError: forces lie far off the rising ones, or none is near 0.
    """
    largest = float(np.abs(force).max())
    if force[-1] <= force[0]:
        raise DataError(
            f"the force falls with the command, from {force[0]:.4g} N at {command[0]:g} {unit} to "
            f"{force[-1]:.4g} N at {command[-1]:g}; give the forces, or the commands, the other "
            "sign"
        )
    is_small = np.abs(rising) < SMALL_FORCE * largest
    noise = (
        float(np.sqrt(np.mean((force - rising)[is_small] ** 2)))
        if is_small.sum() >= MIN_SMALL_FORCES
        else 0.0
    )
    direction = np.where(np.abs(rising) <= max(NO_FORCE * largest, noise), 0.0, np.sign(rising))
    if direction.min() * direction.max() > 0.0:
        smallest = int(np.argmin(np.abs(force)))
        raise DataError(
            f"no force is near 0, the least is {force[smallest]:.4g} N at "
            f"{command[smallest]:g} {unit}; add the command that stops the thruster"
        )
    deviation = np.abs(force - rising)
    if deviation.max() > MAX_FALL * largest:
        k = int(np.argmax(deviation))
        raise DataError(
            f"the force falls with the command about {command[k]:g} {unit}: {force[k]:.4g} N "
            f"there, expected about {rising[k]:.4g} N by the rows beside it; leave out wrong rows, "
            "and what lies beyond the largest force"
        )
    return direction


def layout_lines(fit: ThrusterFit, path: Path) -> tuple[str, ...]:
    """Returns the keys of a thruster in a layout beside a table at a path."""
    low, high = fit.force
    torque = fit.torque_per_newton
    unit = f", unit: {fit.table.unit}" if fit.table.unit else ""
    name = json.dumps(path.name, ensure_ascii=False)  # text to YAML, whatever it is made of
    lines = [f"force_n: [{low:g}, {high:g}]"]
    if fit.dead_band > 0.0:
        lines.append(f"dead_band_n: {fit.dead_band:g}")
    if torque != 0.0:
        lines.append(f"torque_per_newton_m: {torque:.4g}")
    lines.append(f"model: {{type: table, path: {name}{unit}}}")
    return tuple(lines)


def thruster_csv(fit: ThrusterFit, path: Path) -> str:
    """Returns the text of a table: comments with the fit's summary, a header, and the rows.

    Args:
        fit: the thruster.
        path: the file that it is written to, which the comments name.
    """
    return table_text((*summary(fit), *layout_lines(fit, path)), COLUMNS, fit.table.rows, 12)


def summary(fit: ThrusterFit) -> tuple[str, ...]:
    """Returns the results of a fit, a line each."""
    unit = f" {fit.table.unit}" if fit.table.unit else ""
    low, high = fit.force
    idle = ""
    if fit.idle_commands:
        first, last = fit.idle_commands
        idle = f"; none from {first:g} to {last:g}{unit}"
    return (f"force {low:.4g} to {high:.4g} N{idle}", *fit.notes)
