"""The candidates of an answer as a table, one row each, with units in the heads of its columns."""

import csv
import io
from typing import Any

from finlab.allocation.allocation import Allocation
from finlab.allocation.report import command_record
from finlab.arrays import Array
from webapp.tasks.solver import Modes

COMMON = ("name", "origin", "err_norm", "power_w", "effort")
"""Columns that each row has; those of the actuators come after them."""


def modes_csv(answer: Allocation, modes: Modes) -> bytes:
    """The modes that are listed, then all that a network proposed, each as refined.

    Args:
        answer: whose modes they are.
        modes: of it, with what a network proposed.

    Returns:
        The table as UTF-8, with a line of columns' names.
    """
    rows = []
    for named in modes.visible:
        mode = named.mode
        figures = (named.name, named.badge, mode.err_norm, mode.power, mode.effort)
        rows.append(_row(answer, mode.command, figures))
    for candidates in modes.refinement[-1:]:
        for k, command in enumerate(candidates.command):
            figures = (
                "candidate",
                candidates.source[k],
                candidates.err_norm[k],
                candidates.power[k],
                candidates.effort[k],
            )
            rows.append(_row(answer, command, figures))
    columns = dict.fromkeys(COMMON)
    for row in rows:
        columns |= dict.fromkeys(row)
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, list(columns))
    table.writeheader()
    table.writerows(rows)
    return text.getvalue().encode()


def _row(answer: Allocation, command: Array, figures: tuple[Any, ...]) -> dict[str, Any]:
    """A line of the table: `COMMON` figures of a command (n, 3), then commands and forces of each
    actuator; NaN is left empty."""
    forces = answer.with_command(command).forces
    row: dict[str, Any] = {}
    for column, value in zip(COMMON, figures, strict=True):
        is_nan = value != value
        row[column] = "" if is_nan else value
    records: Any = command_record(answer.layout, command, forces)["actuators"]
    for record, force in zip(records, forces, strict=True):
        name = record["name"]
        for key, value in (record["command"] or {}).items():
            row[f"{name}.{key}"] = value
        for axis, value in zip("xyz", force, strict=True):
            row[f"{name}.F{axis}_n"] = float(value)
    return row
