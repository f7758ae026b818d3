"""A fin model that is a table of forces, measured in a tank or computed by CFD.

The CSV file has the columns A [rad], f [Hz], phi [rad], Fx, Fy, Fz [N] under a header line, and P [W] where
the power is known; A is the half amplitude, phi the zero direction, forces and power are cycle means, forces
in the fin frame (x' shaft, y' horizontal thrust axis, z' up). A fin without P takes the power of a plate like
U-CAT's fin. Rows come in any order but must fill a grid: every amplitude with every frequency with every
zero direction. Spacing is free. Between the points a cubic Hermite polynomial is used along each axis, so
forces and their derivatives are continuous. When the zero directions cover the circle the table is periodic.
Amplitudes and frequencies beyond the table count as its edge.
"""

import csv
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.array_library import library_of
from finlab.errors import DataError
from finlab.layout.angles import TURN
from finlab.physics.blade import Blade
from finlab.physics.fin_law import Array, FinLaw, Values

COLUMNS = ("A", "f", "phi", "Fx", "Fy", "Fz")
"""Columns of a force table, by name; their order in the file is free."""
POWER_COLUMN = "P"
"""Column of the mean power [W], which may be left out."""
MAX_BYTES = 50_000_000
"""Largest table that is read [bytes]."""
NEIGHBOURS = (-1, 0, 1, 2)
"""Grid points that a value between points 0 and 1 depends on, along each axis."""


class TableLaw:
    """Interpolates forces and power on a grid of amplitude, frequency and zero direction; see `FinLaw`."""

    uniform = False
    """See `FinLaw`."""
    blade = Blade()
    """Whose power is taken where the table has none."""

    def __init__(self, axes: list[Array], values: Array, periodic: bool) -> None:
        """Takes the grid's axes [rad, Hz, rad], rising, two points or more each, and what was measured
        (a, f, d, 3 or 4): forces [N], and power [W] where it is known.

        A periodic grid's zero directions cover the circle, without the first one again at the end.
        """
        self.periodic = periodic
        self._axes = axes
        self._values = np.ascontiguousarray(values).reshape(-1, values.shape[-1])
        self._strides = (values.shape[1] * values.shape[2], values.shape[2], 1)

    @property
    def has_power(self) -> bool:
        """Whether the table says what power the fin takes."""
        return self._values.shape[1] > 3

    def force(self, command: Values) -> Values:
        """See `FinLaw`. Tensors are answered, too, but nothing is differentiated through the table."""
        xp = library_of(command)
        if xp is not np:
            values = self.force(command.detach().cpu().numpy())
            return xp.from_numpy(np.ascontiguousarray(values)).to(command)
        return self._interpolated(command)[..., :3].astype(command.dtype, copy=False)

    def force_and_slopes(self, command: Array) -> tuple[Array, Array]:
        """See `FinLaw`; exact derivatives of the interpolation."""
        force, slopes = self._with_slopes(command)
        return force[..., :3], slopes[..., :3]

    def power(self, command: Values, copper_loss: float = 0.0) -> Values:
        """See `FinLaw`. Measured power is told as it is, whatever the loss."""
        if not self.has_power:
            return self.blade.driving_power(command[..., 0], command[..., 1], copper_loss)
        return self._interpolated(command)[..., 3]

    def power_slopes(self, command: Array, copper_loss: float = 0.0) -> Array:
        """See `FinLaw`."""
        if self.has_power:
            return self._with_slopes(command)[1][..., 3]
        slopes = np.zeros(command.shape)
        by = self.blade.driving_slopes(command[..., 0], command[..., 1], copper_loss)
        slopes[..., 0], slopes[..., 1] = by
        return slopes

    def _interpolated(self, command: Array) -> Array:
        """All columns (..., 3 or 4)."""
        (by_a, by_f, by_d), grid = self._gathered(np.asarray(command, np.float64))
        turned = np.einsum("...k,...ijkc->...ijc", by_d[0], grid)
        values: Array = np.einsum("...i,...ic->...c", by_a[0], np.einsum("...j,...ijc->...ic", by_f[0], turned))
        return values

    def _with_slopes(self, command: Array) -> tuple[Array, Array]:
        """All columns (..., 3 or 4) and their derivatives (..., 3 commands, 3 or 4)."""
        (by_a, by_f, by_d), grid = self._gathered(command)
        # Value and slope along the last axis, then each along the one before: (2, ..., 4, 4, 3) and so on.
        turned = np.einsum("s...k,...ijkc->s...ijc", by_d, grid)
        value_f = np.einsum("s...j,...ijc->s...ic", by_f, turned[0])
        slope_d = np.einsum("...j,...ijc->...ic", by_f[0], turned[1])
        value, slope_a = np.einsum("s...i,...ic->s...c", by_a, value_f[0])
        slope_f = np.einsum("...i,...ic->...c", by_a[0], value_f[1])
        slope_d = np.einsum("...i,...ic->...c", by_a[0], slope_d)
        return value, np.stack([slope_a, slope_f, slope_d], axis=-2)

    def _gathered(self, command: Array) -> tuple[list[Array], Array]:
        """Per axis the weights of four neighbours and their slopes (2, ..., 4), and the forces of all 64
        neighbours (..., 4, 4, 4, 3 or 4)."""
        stencils = [self._stencil(axis, command[..., axis]) for axis in range(3)]
        (a, f, d), strides = (place for place, _ in stencils), self._strides
        flat = (
            a[..., :, None, None] * strides[0]
            + f[..., None, :, None] * strides[1]
            + d[..., None, None, :] * strides[2]
        )
        return [weight for _, weight in stencils], self._values[flat]

    def _stencil(self, axis: int, value: Array) -> tuple[NDArray[np.intp], Array]:
        """The four grid points (..., 4) around each value on one axis; their cubic Hermite weights and those
        weights' slopes (2, ..., 4)."""
        knots = self._axes[axis]
        n = len(knots)
        if axis == 2 and self.periodic:
            # n points and the first one again, one turn later.
            knots = np.append(knots, knots[0] + TURN)
            value = knots[0] + np.mod(value - knots[0], TURN)
        elif axis == 2:
            middle = (knots[0] + knots[-1]) / 2
            value = value - TURN * np.rint((value - middle) / TURN)  # whole turns: an end stays the end
        inside = (value >= knots[0]) & (value <= knots[-1])
        value = np.clip(value, knots[0], knots[-1])
        cell = np.clip(np.searchsorted(knots, value, side="right") - 1, 0, len(knots) - 2)
        x1, x2 = knots[cell], knots[cell + 1]
        place = cell[..., None] + np.array(NEIGHBOURS)
        if axis == 2 and self.periodic:
            gaps = np.diff(knots)
            x0, x3 = x1 - gaps[(cell - 1) % n], x2 + gaps[(cell + 1) % n]
            place = place % n
        else:
            # At an edge the missing neighbour is the edge itself, which makes its slope one-sided.
            place = np.clip(place, 0, n - 1)
            x0, x3 = knots[place[..., 0]], knots[place[..., 3]]
        width = x2 - x1
        t = (value - x1) / width
        # The slope at a knot is that of the line through its neighbours; these are the two knots' shares.
        early, late = width / (x2 - x0), width / (x3 - x1)
        weights = _hermite(t * (1 - t) ** 2 * early, t * t * (t - 1) * late, t * t * (3 - 2 * t))
        slopes = _hermite(
            (1 - t) * (1 - 3 * t) * early, t * (3 * t - 2) * late, 6 * t * (1 - t), constant=0.0
        ) * (inside / width)
        return place, np.moveaxis(np.stack([weights, slopes]), 1, -1)


def _hermite(early: Array, late: Array, rise: Array, constant: float = 1.0) -> Array:
    """Weights (4, ...) of the four neighbours, from the two slopes' shares and the rise in between."""
    return np.stack([-early, constant - rise - late, rise + early, late])


def read_table(path: str | os.PathLike[str]) -> TableLaw:
    """Returns the law in a CSV file.

    Raises:
        DataError: the file is missing, lacks a column, holds something that is not a finite number, or its
            rows do not fill a grid with at least two points per axis.
    """
    source = str(path)
    axes, forces = _grid(_read_rows(Path(path)), source)
    periodic, axes[2], forces = _close_circle(axes[2], forces, source)
    for name, axis in zip(COLUMNS, axes, strict=False):
        if len(axis) < 2:
            raise DataError(f"{source}: column {name} has one value, expected at least 2 to interpolate")
    return TableLaw(axes, forces, periodic)


def write_table(
    path: str | os.PathLike[str], law: FinLaw, amplitude: Array, frequency: Array, zero_direction: Array
) -> None:
    """Writes the forces of a law on a grid of amplitude [rad], frequency [Hz] and zero direction [rad]."""
    axes = [np.asarray(axis, dtype=np.float64) for axis in (amplitude, frequency, zero_direction)]
    command = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    force: Any = law.force(command)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows([f"{value:.10g}" for value in row] for row in np.hstack([command, force + 0.0]))


def _read_rows(path: Path) -> NDArray[np.float64]:
    """Returns the table (rows, 6 or 7) in the order of `COLUMNS`, with the power behind."""
    try:
        if not path.is_file():
            raise DataError(f"{path}: no such file, expected a CSV table of fin forces")
        if path.stat().st_size > MAX_BYTES:
            raise DataError(f"{path}: is larger than {MAX_BYTES:,} bytes, too large for a force table")
        lines = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path}: cannot be read as CSV text: {error}") from None
    header = [cell.strip() for cell in lines[0]] if lines else []
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise DataError(
            f"{path}: column {missing[0]} is missing, expected a header with {', '.join(COLUMNS)}"
        )
    if len(set(header)) < len(header):
        raise DataError(f"{path}: a column name appears twice in the header")
    columns = [*COLUMNS, POWER_COLUMN] if POWER_COLUMN in header else COLUMNS
    order = [header.index(name) for name in columns]
    rows = []
    for line, cells in enumerate(lines[1:], start=2):
        if not any(cell.strip() for cell in cells):
            continue
        if len(cells) != len(header):
            raise DataError(f"{path}: line {line} has {len(cells)} values, the header has {len(header)}")
        try:
            row = [float(cells[i]) for i in order]
        except ValueError:
            raise DataError(f"{path}: line {line} holds something that is not a number") from None
        if not all(map(math.isfinite, row)):
            raise DataError(
                f"{path}: line {line} holds a value that is not finite; leave no gaps in the table"
            )
        rows.append(row)
    if not rows:
        raise DataError(f"{path}: has no rows below its header")
    return np.array(rows)


def _grid(rows: NDArray[np.float64], source: str) -> tuple[list[NDArray[np.float64]], NDArray[np.float64]]:
    """Returns the three axes and the values (n_A, n_f, n_phi, 3 or 4) of rows that fill a grid."""
    found = [np.unique(rows[:, i], return_inverse=True) for i in range(3)]
    axes = [values for values, _ in found]
    shape = tuple(len(axis) for axis in axes)
    place = np.ravel_multi_index(tuple(inverse.ravel() for _, inverse in found), shape)
    if len(np.unique(place)) < len(place):
        raise DataError(f"{source}: the same A, f, phi appears in two rows; keep one")
    if len(place) != math.prod(shape):
        raise DataError(
            f"{source}: {len(rows)} rows do not fill the grid of {shape[0]} amplitudes, {shape[1]} "
            f"frequencies and {shape[2]} zero directions, expected {math.prod(shape)}; "
            "write equal values with equal digits"
        )
    values = np.empty((math.prod(shape), rows.shape[1] - 3))
    values[place] = rows[:, 3:]
    return axes, values.reshape(*shape, -1)


def _close_circle(
    angle: NDArray[np.float64], forces: NDArray[np.float64], source: str
) -> tuple[bool, NDArray[np.float64], NDArray[np.float64]]:
    """Returns whether the zero directions cover the circle, and the grid without a repeated end point."""
    span = angle[-1] - angle[0]
    if span > TURN + 1e-3:
        raise DataError(f"{source}: zero directions span {span:.4g} rad, expected at most one turn (6.283)")
    if abs(span - TURN) <= 1e-3:
        scale = np.abs(forces).max()
        if not np.allclose(forces[:, :, 0], forces[:, :, -1], rtol=0.0, atol=0.05 * scale + 1e-12):
            raise DataError(
                f"{source}: forces at phi = {angle[0]:.4g} and one turn later differ; they are the same"
            )
        return True, angle[:-1], forces[:, :, :-1]
    # A full circle given without its end point leaves a last gap like the others.
    closes = len(angle) > 2 and TURN - span <= 1.5 * np.diff(angle).max()
    return bool(closes), angle, forces
