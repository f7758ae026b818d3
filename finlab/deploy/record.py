"""An answer as plain values: the JSON object of `finlab allocate`."""

import numpy as np
from msgspec import to_builtins

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.commands import command_of
from finlab.layout.propellers import Thruster


def allocation_record(result: Allocation) -> dict[str, object]:
    """The JSON object of an answer; its keys are a contract."""
    expected = result.wrench_expected
    return {
        **command_record(result.layout, result.command, result.forces),
        "failed": list(result.failed),
        "target": plain_target(result.target),
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


def plain_target(target: Array) -> list[float | None]:
    """Returns a target (6,) as plain values, None for an axis that is free."""
    return [None if np.isnan(value) else value for value in target.tolist()]


def command_record(layout: Layout, command: Array, forces: Array) -> dict[str, object]:
    """The part of an answer that tells the commands: what each actuator is told and gives, as plain values; a
    failed one, whose row is NaN, is told nothing.

    Args:
        layout: the robot.
        command: (n, 3).
        forces: (n, 3) [N], body frame; of a thruster the signed force along its axis is told.
    """
    values: list[dict[str, object]] = []
    for part, row, force in zip(layout.actuators, command, forces, strict=True):
        told = command_of(part, row)
        along = float(force @ np.array(part.axis)) if isinstance(part, Thruster) else force.tolist()
        own = None if told is None else to_builtins(told)
        values.append({"name": part.name, "type": part.type, "force_n": along, "command": own})
    if not layout.is_of_fins:
        return {"actuators": values}
    rows = [None if np.isnan(row).any() else row.tolist() for row in command]
    return {"actuators": values, "fins": list(layout.names), "command": rows}
