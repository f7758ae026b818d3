"""Allocation matrices: the wrench of each thruster per unit of its command, in YAML or CSV."""

import csv
from collections.abc import Mapping
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.exchange import TO_FRD, Exchange
from finlab.files.plain_values import yaml_text
from finlab.layout import MAX_ACTUATORS, Layout, own_effectiveness

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
UNIT = 0.05
"""A column whose force is this close to 1 holds the wrench per newton."""


def read_matrix(data: Any, name: str, exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of the thrusters in plain values.

    Somewhere in them is a matrix: six rows, or a list of them all in one, or a key of `AXES` for each; beside
    it `names`, `limits` (least and most command of each) and `frame` (FLU or FRD), where it has them.

    Raises:
        LayoutError: there is no such matrix, or a column holds no force.
    """
    found = _searched(data)
    if found is None:
        raise LayoutError("has no matrix, expected six rows of numbers: Fx, Fy, Fz, Tx, Ty, Tz per thruster")
    matrix, beside = found
    n = matrix.shape[1]
    if n > MAX_ACTUATORS:
        raise LayoutError(f"expected up to {MAX_ACTUATORS} columns, got {n}")
    if str(beside.get("frame", exchange.frame)) == "FRD":
        matrix = matrix * TO_FRD
    names = beside.get("names", [f"thruster{i + 1}" for i in range(n)])
    limits = _numbers(beside.get("limits"))
    ends: list[tuple[float, float] | None] = [None] * n
    if not isinstance(names, list) or len(names) != n or (limits is not None and limits.shape != (n, 2)):
        raise LayoutError(f"expected a name, and least and most command, for each of {n} columns", "limits")
    if limits is not None:
        ends = [(low, high) for low, high in limits.tolist()]
    elif (np.abs(np.linalg.norm(matrix[:3], axis=0) - 1.0) > UNIT).any():
        exchange.note("It has no limits: commands are taken to go from -1 to 1 (--force LEAST MOST).")
        ends = [(-1.0, 1.0)] * n
    columns = zip(map(str, names), matrix.T, ends, strict=True)
    return Layout(name, tuple(exchange.of_column(*each) for each in columns))


def csv_values(text: str) -> dict[str, Any]:
    """Returns the cells of a CSV file as `read_matrix` takes them: rows of numbers, or a header of names and
    rows that begin with one of `AXES`, `least` or `most`; a line `# frame: FRD` names the frame."""
    lines = [line for line in text.splitlines() if line.strip()]
    beside = {"frame": "FRD"} if any(line.startswith("#") and "FRD" in line for line in lines) else {}
    rows = [row for row in csv.reader(line for line in lines if line[0] != "#") if row]
    told = {row[0].strip(): row[1:] for row in rows}
    if "Fx" not in told:
        return {**beside, "matrix": rows}
    limits = [*zip(told.get("least", []), told.get("most", []), strict=False)] or None
    return {**beside, "limits": limits, "names": [cell.strip() for cell in rows[0][1:]], "matrix": told}


def _searched(data: Any) -> tuple[Array, Mapping[str, Any]] | None:
    """The first matrix (6, n) in plain values, and the mapping that has it."""
    for key, value in data.items() if isinstance(data, Mapping) else ():
        if isinstance(value, Mapping):
            told = {str(each).capitalize(): row for each, row in value.items()}
            values = _numbers([told.get(axis) for axis in AXES])
        else:
            values = None if key in ("names", "limits") else _numbers(value)
        if values is not None and values.ndim == 1 and len(values) > 6 and len(values) % 6 == 0:
            values = values.reshape(6, -1)
        if values is not None and values.ndim == 2 and len(values) == 6 and values.shape[1]:
            return values, data
        found = _searched(value)
        if found is not None:
            return found
    return None


def _numbers(values: Any) -> Array | None:
    """Numbers, or text that stands for them, as an array; None where they are none."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return array if np.isfinite(array).all() else None


def write_matrix(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns the matrix of a layout's thrusters per newton, as CSV for `.csv`, else as YAML.

    Raises:
        LayoutError: there is no thruster.
    """
    kept = exchange.thrusters_of(layout, "A matrix", "places along the lines of the forces")
    rows = own_effectiveness(kept)[:, 0].T * (TO_FRD if exchange.frame == "FRD" else 1.0) + 0.0
    names, limits = list(kept.names), np.stack([kept.lower, kept.upper], axis=1)[..., 0].tolist()
    matrix = dict(zip(AXES, rows.tolist(), strict=True))
    if suffix != ".csv":
        told = {"frame": exchange.frame, "unit": "N", "names": names, "limits": limits}
        return yaml_text({**told, "matrix": matrix})
    table = {"axis": names, **matrix, **dict(zip(("least", "most"), zip(*limits, strict=True), strict=True))}
    lines = [",".join(map(str, [key, *row])) for key, row in table.items()]
    return "\n".join([f"# frame: {exchange.frame}", *lines]) + "\n"
