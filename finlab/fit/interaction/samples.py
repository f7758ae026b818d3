"""Forward data of what actuators do to each other: robots, commands, and the wrenches that these
caused.

An NPZ file holds `layouts`, JSON text of a list of layout files, `command` (L, K, n, 3) in SI
units, NaN where a robot has no more actuators, and `wrench` (L, K, 6) [N, N m] in the body frame,
NaN where it was not measured. A CSV file holds the samples of one robot: `NAME.number` for each
actuator, such as `bow.force`, or `left.A`, `left.f`, `left.phi`, and Fx, Fy, Fz, Tx, Ty, Tz. A
folder holds a CSV file for each robot, beside its layout file of the same name.
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

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
from finlab.physics.objective import yardstick
from finlab.whole_file import write_whole

MAX_BYTES = 1_000_000_000
"""Largest file of samples that is read [bytes]."""
WHAT = "samples of wrenches (.npz)"


class Samples(NamedTuple):
    """Samples of one robot."""

    layout: Layout
    command: Array
    """(K, n, 3), of fins [rad, Hz, rad]."""
    wrench: Array
    """(K, 6) [N, N m]."""


class Left(NamedTuple):
    """What the laws of a robot's actuators leave of its samples."""

    force: Array
    """Forces (K, n, 3) [N] by the laws, body frame."""
    missed: Array
    """Measured wrenches (K, 6) less those of these forces, on the yardstick."""
    scale: Array
    """The yardstick (6,) [N, N m]."""


def left_by_laws(samples: Samples) -> Left:
    """Returns what the laws leave of samples, whatever interaction their layout names."""
    layout = replace(samples.layout, interaction=None)
    plant = Plant(layout)
    scale = yardstick(layout)
    own = plant.force(samples.command)
    return Left(
        body_force(own, layout.frames), (samples.wrench - plant.wrench_of(own)) / scale, scale
    )


def write_samples(path: Path, samples: Sequence[Samples]) -> None:
    """Writes an NPZ file; a `DataError` where it cannot be written."""
    n = max(one.layout.n for one in samples)
    most = max(len(one.command) for one in samples)
    command = np.full((len(samples), most, n, 3), np.nan)
    wrench = np.full((len(samples), most, 6), np.nan)
    for k, one in enumerate(samples):
        command[k, : len(one.command), : one.layout.n] = one.command
        wrench[k, : len(one.wrench)] = one.wrench
    text = json.dumps([layout_to_dict(one.layout) for one in samples])
    content = BytesIO()
    np.savez_compressed(content, layouts=np.array(text), command=command, wrench=wrench)
    write_whole(path, content.getvalue(), DataError)


def read_samples(path: Path) -> list[Samples]:
    """Returns the samples in an NPZ file or a folder. Raises DataError: they cannot be read, or do
    not fit the robots; LayoutError: a robot is none."""
    if path.is_dir():
        if tables := sorted(path.glob("*.csv")):
            return [_beside(table) for table in tables]
        expected = "expected for each robot a layout file and a CSV file of one name"
        raise DataError(f"{path}: {expected}, got no CSV file")
    arrays = read_arrays(path, ("layouts", "command", "wrench"), MAX_BYTES, WHAT)
    values = json_of(arrays["layouts"], f"{path}: layouts")
    if not isinstance(values, list) or not values:
        raise DataError(f"{path}: layouts: expected JSON text of a list of layout files")
    robots = [
        parse_layout(v, f"{path}: layouts[{k}]", path.parent, may_open=False)
        for k, v in enumerate(values)
    ]
    count, n = (arrays["command"].shape + (0, 0, 0))[1:3]
    most = max(n, max(robot.n for robot in robots))
    shapes = {"command": (len(robots), count, most, 3), "wrench": (len(robots), count, 6)}
    check_shapes(arrays, shapes, str(path))
    result = []
    for layout, command, wrench in zip(robots, arrays["command"], arrays["wrench"], strict=True):
        known = np.isfinite(wrench).all(axis=1)
        own = command[known][:, : layout.n].astype(np.float64)
        if not np.isfinite(own).all():
            raise DataError(
                f"{path}: command: NaN or infinity for an actuator of {layout.name}, expected "
                "numbers"
            )
        result.append(Samples(layout, own, wrench[known].astype(np.float64)))
    return result


def _beside(table: Path) -> Samples:
    for suffix in (".yaml", ".yml", ".json"):
        if (robot := table.with_suffix(suffix)).exists():
            return read_table(load_layout(robot), table)
    raise DataError(
        f"{table}: expected a layout file of the same name beside it, such as {table.stem}.yaml"
    )


def read_table(layout: Layout, path: Path) -> Samples:
    """Returns the samples of one robot in a CSV file; errors as for `read_samples`."""
    wanted = [*sum(command_columns(layout), []), *AXES]
    units = {"": 1.0, "n": 1.0, "rad": 1.0, "hz": 1.0, "nm": 1.0, "deg": TURNS["deg"]}
    table = read_columns(
        path, {name: name for name in wanted}, wanted, ", ".join(wanted), units
    ).values
    return Samples(
        layout, commands_in(table, layout), np.stack([table[axis] for axis in AXES], axis=-1)
    )
