"""A result as plain values, for programs: the JSON object of an answer.

The command line, the app and a robot's program write it.
"""

from typing import Any

import numpy as np
from msgspec import to_builtins

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.layout.layout import Layout

RECORD = (
    "lost",
    "target",
    "flow",
    "wrench_expected",
    "wrench_plant",
    "unallocated",
    "err_norm",
    "expected_error",
    "expected_miss",
    "effort",
    "power",
    "bound",
    "calm_power",
    "scale",
    "solve_ms",
    "method",
    "checkpoint",
    "reachable",
    "share",
    "binding",
    "unknown_fins",
    "notes",
)
"""Keys of the JSON object, beside those of the commands; they are a contract."""


def allocation_record(result: Allocation) -> dict[str, object]:
    """Returns the JSON object of an answer, with the keys of `RECORD` and `command_record`."""
    values: dict[str, Any] = {}
    for key in RECORD:
        value = getattr(result, "wrench" if key == "wrench_plant" else key)
        values[key] = list(value) if isinstance(value, tuple) else value
    values["target"] = plain_target(result.target)
    plain = to_builtins(values, enc_hook=np.ndarray.tolist)
    return {**command_record(result.layout, result.command, result.forces), **plain}


def plain_target(target: Array) -> list[float | None]:
    """Returns a target (6,) as plain values, None for an axis that is free."""
    return [None if np.isnan(value) else value for value in target.tolist()]


def command_record(layout: Layout, command: Array, forces: Array) -> dict[str, object]:
    """Returns commands and forces as plain values.

    Args:
        layout: the robot of n actuators.
        command: (n, 3), NaN for a lost one.
        forces: (n, 3) [N], body frame.

    Returns:
        `actuators`: of each its name, type, force (signed, where it has an axis of its own) and
        command, None for a lost one; of a robot of fins also `fins` and `command`.
    """
    records: list[dict[str, object]] = []
    for actuator, row, force in zip(layout.actuators, command, forces, strict=True):
        typed = actuator.command(row)
        axis = getattr(actuator, "axis", None)
        record = {
            "name": actuator.name,
            "type": actuator.type,
            "force_n": force.tolist() if axis is None else float(force @ np.array(axis)),
            "command": None if typed is None else to_builtins(typed),
        }
        records.append(record)
    if not layout.is_of_fins:
        return {"actuators": records}
    rows = [None if np.isnan(row).any() else row.tolist() for row in command]
    return {"actuators": records, "fins": list(layout.names), "command": rows}
