"""A fin model that is a table of forces, measured in a tank or computed by CFD.

The CSV file has the columns A [rad], f [Hz], phi [rad], Fx, Fy, Fz [N] under a header line; A is the half
amplitude, phi the zero direction, forces are cycle means in the fin frame (x' shaft, y' horizontal thrust
axis, z' up). Rows come in any order but must fill a grid: every amplitude with every frequency with every
zero direction. Spacing is free. Between the points a cubic Hermite polynomial is used along each axis, so
forces and their derivatives are continuous. When the zero directions cover the circle the table is periodic.
Amplitudes and frequencies beyond the table count as its edge.
"""

import csv
import itertools
import math
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from finlab.errors import DataError
from finlab.physics.fin_model import FinModel

COLUMNS = ("A", "f", "phi", "Fx", "Fy", "Fz")
"""Columns of a force table, by name; their order in the file is free."""
MAX_BYTES = 50_000_000
"""Largest table that is read [bytes]."""


class TableFinModel:
    """Interpolates a table of forces, differentiably."""

    name = "table"

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Reads and checks the table at `path`.

        Raises:
            DataError: the file is missing, lacks a column, holds something that is not a finite number,
                or its rows do not fill a grid with at least two points per axis.
        """
        self.path = str(path)
        rows = _read_rows(Path(path))
        axes, forces = _grid(rows, self.path)
        self.periodic, axes[2], forces = _close_circle(axes[2], forces, self.path)
        for name, axis in zip(COLUMNS, axes, strict=False):
            if len(axis) < 2:
                raise DataError(
                    f"{self.path}: column {name} has one value, expected at least 2 to interpolate"
                )
        self._axes = [torch.from_numpy(axis) for axis in axes]
        self._forces = torch.from_numpy(forces).reshape(-1, 3)
        self._strides = (forces.shape[1] * forces.shape[2], forces.shape[2], 1)

    def force(self, command: Tensor) -> Tensor:
        """Returns the mean force (..., 3) [N] in the fin frame of command (..., 3) [rad, Hz, rad]."""
        corners = [self._stencil(axis, command[..., axis]) for axis in range(3)]
        table = self._forces.to(command)
        total = torch.zeros_like(command)
        # 4 x 4 x 4 neighbours, each weighted by the product of three one-dimensional weights.
        for steps in itertools.product(range(4), repeat=3):
            weight = torch.ones_like(command[..., 0])
            place = torch.zeros_like(corners[0].place[0])
            for axis, step in enumerate(steps):
                weight = weight * corners[axis].weight[step]
                place = place + corners[axis].place[step] * self._strides[axis]
            total = total + weight.unsqueeze(-1) * table[place]
        return total

    def _stencil(self, axis: int, value: Tensor) -> "_Stencil":
        """Returns the four grid points around each value on one axis and their cubic Hermite weights."""
        knots = self._axes[axis].to(value)
        n = len(knots)
        if axis == 2 and self.periodic:
            # n points and the first one again, one turn later.
            knots = torch.cat([knots, knots[:1] + 2 * math.pi])
            value = knots[0] + torch.remainder(value - knots[0], 2 * math.pi)
        elif axis == 2:
            middle = (knots[0] + knots[-1]) / 2
            value = middle + torch.remainder(value - middle + math.pi, 2 * math.pi) - math.pi
        value = value.clamp(knots[0], knots[-1])
        cell = (torch.searchsorted(knots, value.detach().contiguous(), right=True) - 1).clamp(
            0, len(knots) - 2
        )
        x1, x2 = knots[cell], knots[cell + 1]
        if axis == 2 and self.periodic:
            gaps = knots.diff()
            x0 = x1 - gaps[(cell - 1) % n]
            x3 = x2 + gaps[(cell + 1) % n]
            index = [(cell + step) % n for step in (-1, 0, 1, 2)]
        else:
            # At an edge the missing neighbour is the edge itself, which makes its slope one-sided.
            index = [(cell + step).clamp(0, n - 1) for step in (-1, 0, 1, 2)]
            x0, x3 = knots[index[0]], knots[index[3]]
        width = x2 - x1
        t = (value - x1) / width
        slope1 = t * (1 - t) ** 2 * width / (x2 - x0)  # weight of the slope at x1, over its two neighbours
        slope2 = t * t * (t - 1) * width / (x3 - x1)
        rise = t * t * (3 - 2 * t)
        return _Stencil(index, [-slope1, 1 - rise - slope2, rise + slope1, slope2])


class _Stencil(NamedTuple):
    place: list[Tensor]
    """Four grid indices, each of the command's batch shape."""

    weight: list[Tensor]
    """Their weights, which sum to one."""


def write_table(
    path: str | os.PathLike[str],
    model: FinModel,
    amplitude: NDArray[np.float64],
    frequency: NDArray[np.float64],
    zero_direction: NDArray[np.float64],
) -> None:
    """Writes the forces of `model` on a grid of amplitude [rad], frequency [Hz] and zero direction [rad]."""
    axes = [np.asarray(axis, dtype=np.float64) for axis in (amplitude, frequency, zero_direction)]
    command = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    with torch.no_grad():
        force = model.force(torch.from_numpy(command)).numpy()
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows([f"{value:.10g}" for value in row] for row in np.hstack([command, force + 0.0]))


def _read_rows(path: Path) -> NDArray[np.float64]:
    """Returns the table (rows, 6) in the order of `COLUMNS`."""
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
    order = [header.index(name) for name in COLUMNS]
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
    """Returns the three axes and the forces (n_A, n_f, n_phi, 3) of rows that fill a grid."""
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
    forces = np.empty((math.prod(shape), 3))
    forces[place] = rows[:, 3:]
    return axes, forces.reshape(*shape, 3)


def _close_circle(
    angle: NDArray[np.float64], forces: NDArray[np.float64], source: str
) -> tuple[bool, NDArray[np.float64], NDArray[np.float64]]:
    """Returns whether the zero directions cover the circle, and the grid without a repeated end point."""
    span = angle[-1] - angle[0]
    if span > 2 * math.pi + 1e-3:
        raise DataError(f"{source}: zero directions span {span:.4g} rad, expected at most one turn (6.283)")
    if abs(span - 2 * math.pi) <= 1e-3:
        scale = np.abs(forces).max()
        if not np.allclose(forces[:, :, 0], forces[:, :, -1], rtol=0.0, atol=0.05 * scale + 1e-12):
            raise DataError(
                f"{source}: forces at phi = {angle[0]:.4g} and one turn later differ; they are the same"
            )
        return True, angle[:-1], forces[:, :, :-1]
    # A full circle given without its end point leaves a last gap like the others.
    closes = len(angle) > 2 and 2 * math.pi - span <= 1.5 * np.diff(angle).max()
    return bool(closes), angle, forces
