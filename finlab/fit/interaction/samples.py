"""Samples of robots whose actuators act on each other: commands, and the wrenches that they gave.

An NPZ file holds `layouts`, JSON text of a list of layout files, `command` (L, K, n, 3) in SI
units, NaN where a robot has no more actuators, and `wrench` (L, K, 6) [N, N m] in the body frame,
NaN where it was not measured; and, of robots that moved, `flow` (L, K, 6), the velocity of the
body through the water [m/s, rad/s].

A CSV file holds the samples of one robot: `NAME.number` for each actuator, such as `bow.force`, or
`left.A`, `left.f`, `left.phi`, and Fx, Fy, Fz, Tx, Ty, Tz, and may hold vx, vy, vz, wx, wy, wz. A
folder holds a CSV file for each robot, beside its layout file of the same name.
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import DataError
from finlab.files.csv_table import TURNS
from finlab.files.guarded import check_shapes, json_of, read_arrays
from finlab.fit.columns import command_columns, commands_in, read_columns
from finlab.layout import Layout, layout_to_dict, load_layout, parse_layout
from finlab.layout.effectiveness import body_force
from finlab.physics import Plant
from finlab.physics.objective import wrench_scale_of
from finlab.whole_file import write_whole

MAX_BYTES = 1_000_000_000
"""Largest file of samples that is read [bytes]."""
FLOW = ("vx", "vy", "vz", "wx", "wy", "wz")
"""Columns of the velocity of the body through the water [m/s, rad/s]; those that are not there are
0."""
EXPECTED = "samples of wrenches (.npz)"
"""What a sentence says was expected."""


class Samples(NamedTuple):
    """Samples of one robot."""

    layout: Layout
    command: Array
    """(K, n, 3), of fins [rad, Hz, rad]."""
    wrench: Array
    """(K, 6) [N, N m]."""
    flow: Array | None = None
    """Velocities (K, 6) of the body through the water, body frame [m/s, rad/s]; None at rest."""

    def some(self, chosen: slice) -> "Samples":
        """Returns some of the samples."""
        flow = None if self.flow is None else self.flow[chosen]
        return Samples(self.layout, self.command[chosen], self.wrench[chosen], flow)


class LawResiduals(NamedTuple):
    """Residuals of the samples of a robot under the laws of its actuators alone."""

    force: Array
    """Forces (K, n, 3) [N] by the laws, body frame."""
    missed: Array
    """Measured wrenches (K, 6) less those of these forces, over the wrench scale."""
    scale: Array
    """The wrench scale (6,) [N, N m]."""
    inflow: Array | None
    """Velocities (K, n, 3) of the points through the water, body frame [m/s]; None at rest."""


def left_by_laws(samples: Samples) -> LawResiduals:
    """Returns the residuals of samples under the laws, whatever interaction their layout names."""
    layout = replace(samples.layout, interaction=None)
    plant = Plant(layout)
    scale = wrench_scale_of(layout)
    force = plant.force(samples.command, flow=samples.flow)
    missed = (samples.wrench - plant.wrench_of(force)) / scale
    inflow = None if samples.flow is None else plant.point_velocity(samples.flow)
    return LawResiduals(body_force(force, layout.frames), missed, scale, inflow)


def write_samples(path: Path, samples: Sequence[Samples]) -> None:
    """Writes the samples of several robots into an NPZ file.

    Args:
        path: the file.
        samples: samples of each robot.

    Raises:
        DataError: the file cannot be written.
    """
    n = max(robot_samples.layout.n for robot_samples in samples)
    n_samples = max(len(robot_samples.command) for robot_samples in samples)
    command = np.full((len(samples), n_samples, n, 3), np.nan)
    wrench = np.full((len(samples), n_samples, 6), np.nan)
    flow = np.zeros((len(samples), n_samples, 6))
    for k, robot_samples in enumerate(samples):
        command[k, : len(robot_samples.command), : robot_samples.layout.n] = robot_samples.command
        wrench[k, : len(robot_samples.wrench)] = robot_samples.wrench
        if robot_samples.flow is not None:
            flow[k, : len(robot_samples.flow)] = robot_samples.flow
    text = json.dumps([layout_to_dict(robot_samples.layout) for robot_samples in samples])
    content = BytesIO()
    arrays: dict[str, Any] = {"layouts": np.array(text), "command": command, "wrench": wrench}
    if any(robot_samples.flow is not None for robot_samples in samples):
        arrays["flow"] = flow
    np.savez_compressed(content, **arrays)
    write_whole(path, content.getvalue(), DataError)


def read_samples(path: Path) -> list[Samples]:
    """Returns the samples in an NPZ file or a folder.

    Raises:
        DataError: they cannot be read, or do not fit the robots.
        LayoutError: a layout is not valid.
    """
    if path.is_dir():
        tables = sorted(path.glob("*.csv"))
        if tables:
            return [_read_with_layout(table) for table in tables]
        expected = "expected for each robot a layout file and a CSV file of one name"
        raise DataError(f"{path}: {expected}, got no CSV file")
    arrays = read_arrays(path, None, MAX_BYTES, EXPECTED)
    for name in ("layouts", "command", "wrench"):
        if name not in arrays:
            raise DataError(f"{path}: expected {EXPECTED}, but it holds no {name}")
    values = json_of(arrays["layouts"], f"{path}: layouts")
    if not isinstance(values, list) or not values:
        raise DataError(f"{path}: layouts: expected JSON text of a list of layout files")
    robots = [
        parse_layout(v, f"{path}: layouts[{k}]", path.parent, may_open=False)
        for k, v in enumerate(values)
    ]
    count, n = (arrays["command"].shape + (0, 0, 0))[1:3]
    n_actuators = max(n, max(robot.n for robot in robots))
    shapes = {"command": (len(robots), count, n_actuators, 3), "wrench": (len(robots), count, 6)}
    if "flow" in arrays:
        shapes["flow"] = (len(robots), count, 6)
    check_shapes(arrays, shapes, str(path))
    result = []
    for k, layout in enumerate(robots):
        command = arrays["command"][k]
        wrench = arrays["wrench"][k]
        is_measured = np.isfinite(wrench).all(axis=1)
        robot_command = command[is_measured][:, : layout.n].astype(np.float64)
        if not np.isfinite(robot_command).all():
            raise DataError(
                f"{path}: command: NaN or infinity for an actuator of {layout.name}, expected "
                "numbers"
            )
        flow = None
        if "flow" in arrays:
            flow = arrays["flow"][k][is_measured].astype(np.float64)
            if not np.isfinite(flow).all():
                raise DataError(f"{path}: flow: NaN or infinity, expected numbers")
        robot_wrench = wrench[is_measured].astype(np.float64)
        result.append(Samples(layout, robot_command, robot_wrench, flow))
    return result


def _read_with_layout(table: Path) -> Samples:
    """The samples in a CSV file whose layout file has the same name."""
    for suffix in (".yaml", ".yml", ".json"):
        layout_file = table.with_suffix(suffix)
        if layout_file.exists():
            return read_table(load_layout(layout_file), table)
    raise DataError(
        f"{table}: expected a layout file of the same name beside it, such as {table.stem}.yaml"
    )


def read_table(layout: Layout, path: Path) -> Samples:
    """Returns the samples of one robot in a CSV file.

    Args:
        layout: the robot.
        path: the file.

    Raises:
        DataError: the file cannot be read, or lacks a column.
    """
    columns = []
    for names in command_columns(layout):
        columns += names
    columns += AXES
    units = {"": 1.0, "n": 1.0, "rad": 1.0, "hz": 1.0, "nm": 1.0, "deg": TURNS["deg"]}
    units |= {"m/s": 1.0, "rad/s": 1.0, "deg/s": TURNS["deg"]}
    known = {name: name for name in (*columns, *FLOW)}
    table = read_columns(path, known, columns, ", ".join(columns), units).values
    wrench = np.stack([table[axis] for axis in AXES], axis=-1)
    flow = None
    if any(name in table for name in FLOW):
        still = np.zeros(len(wrench))
        flow = np.stack([table.get(name, still) for name in FLOW], axis=-1)
    return Samples(layout, commands_in(table, layout), wrench, flow)
