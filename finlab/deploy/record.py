"""An answer as plain values: the JSON object of `finlab allocate` and of `finlab-runtime allocate`."""

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array


def allocation_record(result: Allocation) -> dict[str, object]:
    """The JSON object of an answer; its keys are a contract."""
    expected = result.wrench_expected
    return {
        "fins": list(result.fins),
        "failed": list(result.failed),
        "command": command_rows(result.command),
        "target": result.target.tolist(),
        "flow": None if result.flow is None else result.flow.tolist(),
        "wrench_expected": None if expected is None else expected.tolist(),
        "wrench_plant": result.wrench.tolist(),
        "unallocated": result.unallocated.tolist(),
        "err_norm": result.err_norm,
        "expected_error": result.expected_error,
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


def command_rows(command: Array) -> list[list[float] | None]:
    """Commands (n, 3) as lists; None for a failed fin, whose row is NaN."""
    return [None if np.isnan(row).any() else row.tolist() for row in command]
