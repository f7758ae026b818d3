"""An answer as plain values: the JSON object of `finlab allocate` and of `finlab-runtime allocate`."""

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array


def allocation_record(result: Allocation) -> dict[str, object]:
    """The JSON object of an answer; its keys are a contract."""
    surrogate = result.wrench_surrogate
    return {
        "fins": list(result.fins),
        "failed": list(result.failed),
        "command": command_rows(result.command),
        "target": result.target.tolist(),
        "flow": None if result.flow is None else result.flow.tolist(),
        "wrench_surrogate": None if surrogate is None else surrogate.tolist(),
        "wrench_plant": result.wrench.tolist(),
        "unallocated": result.unallocated.tolist(),
        "err_norm": result.err_norm,
        "effort": result.effort,
        "power": result.power,
        "sigma": result.sigma.tolist(),
        "solve_ms": result.solve_ms,
        "method": result.method,
        "checkpoint": result.checkpoint,
        "reachable": result.reachable,
        "scale": result.scale,
        "binding": list(result.binding),
        "evaluated_by": result.evaluated_by,
        "unknown_fins": list(result.unknown_fins),
        "notes": list(result.notes),
    }


def command_rows(command: Array) -> list[list[float] | None]:
    """Commands (n, 3) as lists; None for a failed fin, whose row is NaN."""
    return [None if np.isnan(row).any() else row.tolist() for row in command]
