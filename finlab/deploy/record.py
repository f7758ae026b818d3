"""An answer as plain values: the JSON object of `finlab allocate` and of `finlab-runtime allocate`."""

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.commands import command_of, command_values
from finlab.layout.thruster import Thruster


def allocation_record(result: Allocation) -> dict[str, object]:
    """The JSON object of an answer; its keys are a contract."""
    expected = result.wrench_expected
    return {
        **command_record(result.layout, result.command, result.forces),
        "failed": list(result.failed),
        "target": result.target.tolist(),
        "flow": None if result.flow is None else result.flow.tolist(),
        "wrench_expected": None if expected is None else expected.tolist(),
        "wrench_plant": result.wrench.tolist(),
        "unallocated": result.unallocated.tolist(),
        "err_norm": result.err_norm,
        "expected_error": result.expected_error,
        "expected_miss": result.expected_miss.tolist(),
        "effort": result.effort,
        "power": result.power,
        "bound": result.bound,
        "scale": result.scale.tolist(),
        "solve_ms": result.solve_ms,
        "method": result.method,
        "checkpoint": result.checkpoint,
        "reachable": result.reachable,
        "share": result.share,
        "binding": list(result.binding),
        "unknown_fins": list(result.unknown_fins),
        "notes": list(result.notes),
    }


def command_record(layout: Layout, command: Array, forces: Array) -> dict[str, object]:
    """The part of an answer that tells the commands; arguments as of `actuator_values`."""
    record: dict[str, object] = {"actuators": actuator_values(layout, command, forces)}
    if layout.is_of_fins:
        record |= {"fins": list(layout.names), "command": command_rows(command)}
    return record


def actuator_values(layout: Layout, command: Array, forces: Array) -> list[dict[str, object]]:
    """What each actuator of a robot is told and gives, as plain values; a failed one is told nothing.

    Args:
        layout: the robot.
        command: (n, 3).
        forces: (n, 3) [N], body frame; of a thruster the signed force along its axis is told.
    """
    values: list[dict[str, object]] = []
    for part, row, force in zip(layout.actuators, command, forces, strict=True):
        told = command_of(part, row)
        along = float(force @ np.array(part.axis)) if isinstance(part, Thruster) else force.tolist()
        own = None if told is None else command_values(told)
        values.append({"name": part.name, "type": part.type, "force_n": along, "command": own})
    return values


def command_rows(command: Array) -> list[list[float] | None]:
    """Commands (n, 3) as lists; None for a failed fin, whose row is NaN."""
    return [None if np.isnan(row).any() else row.tolist() for row in command]
