"""The candidates of an answer as a table, one row each, with units in the heads of its columns."""

import csv
import io
from typing import Any

from finlab.allocation.allocation import Allocation
from finlab.allocation.report import command_record
from finlab.arrays import Array
from webapp.tasks.solver import Modes

COMMON = ("name", "origin", "err_norm", "power_w", "effort")


def modes_csv(answer: Allocation, modes: Modes) -> bytes:
    """The modes that are listed, then all that a network proposed, each as refined."""
    rows = [
        _row(
            answer,
            each.mode.command,
            each.name,
            each.badge,
            each.mode.err_norm,
            each.mode.power,
            each.mode.effort,
        )
        for each in modes.shown
    ]
    for drawn in modes.refinement[-1:]:
        figures = drawn.command, drawn.source, drawn.err_norm, drawn.power, drawn.effort
        rows += [
            _row(answer, command, "candidate", *rest)
            for command, *rest in zip(*figures, strict=True)
        ]
    text = io.StringIO(newline="")
    table = csv.DictWriter(
        text, [*COMMON, *dict.fromkeys(key for row in rows for key in row if key not in COMMON)]
    )
    table.writeheader()
    table.writerows(rows)
    return text.getvalue().encode()


def _row(answer: Allocation, command: Array, *common: Any) -> dict[str, Any]:
    forces = answer.with_command(command).forces
    row = {key: "" if value != value else value for key, value in zip(COMMON, common, strict=True)}
    own: Any = command_record(answer.layout, command, forces)["actuators"]
    for part, force in zip(own, forces, strict=True):
        row |= {f"{part['name']}.{key}": value for key, value in (part["command"] or {}).items()}
        row |= {
            f"{part['name']}.F{axis}_n": float(value)
            for axis, value in zip("xyz", force, strict=True)
        }
    return row
