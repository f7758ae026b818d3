"""An answer as two small tables, for people: angles in degrees, three digits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from finlab.command_end import aligned
from finlab.layout.axes import AXES
from finlab.layout.commands import AzimuthCommand, Command, FinCommand, RudderCommand

if TYPE_CHECKING:
    from finlab.allocation.allocation import Allocation

NEARLY_ALL = 0.995
"""Share of a wrench from which on it is printed as all of it."""
COLUMNS = ("actuator", "type", "command", "force [N]")
"""Columns of the table of actuators."""
WRENCH_COLUMNS = ("", *(f"{axis} [{'N' if axis.startswith('F') else 'N m'}]" for axis in AXES))
"""Columns of the table of wrenches."""


def actuator_rows(result: Allocation) -> list[tuple[str, ...]]:
    """Cells of each actuator."""
    rows: list[tuple[str, ...]] = []
    for part, force in zip(result.layout.actuators, result.forces, strict=True):
        command = result.commands[part.name]
        told = ("failed", "") if command is None else (in_words(command), f"{math.hypot(*force):.3f}")
        rows.append((part.name, part.type, *told))
    return rows


def in_words(command: Command) -> str:
    """A command with its units."""
    if isinstance(command, FinCommand):
        return (
            f"{command.amplitude:.3f} rad, {command.frequency:.3f} Hz, "
            f"{math.degrees(command.zero_direction):.1f} deg"
        )
    if isinstance(command, RudderCommand):
        return f"{math.degrees(command.deflection):.1f} deg"
    angle = f" at {math.degrees(command.angle):.1f} deg" if isinstance(command, AzimuthCommand) else ""
    sent = "" if command.input is None else f", input {command.input:.5g}"
    return f"{round(command.force, 3) + 0.0:.3f} N{angle}{sent}"


def wrench_rows(result: Allocation) -> list[tuple[str, ...]]:
    """Name and cells of what was asked, what is delivered, what is missing, and how uncertain that is."""
    wrenches = {"asked": result.target, "delivered": result.wrench, "missing": result.unallocated}
    if result.expected_error:
        wrenches["uncertain"] = result.expected_miss
    # `+ 0.0` turns a rounded -0.0 into 0.0.
    return [
        (name, *("free" if math.isnan(v) else f"{round(v, 3) + 0.0:.3f}" for v in row))
        for name, row in wrenches.items()
    ]


def summary(result: Allocation) -> str:
    """The figures of an answer in one line."""
    source = f", checkpoint {result.checkpoint}" if result.checkpoint else ""
    effort = "" if result.effort is None else f"effort {result.effort:.3f}   "
    expected = f"expected_error {result.expected_error:.2e}   " if result.expected_error else ""
    return (
        f"err_norm {result.err_norm:.2e}   {expected}power {result.power:.3f} W   {effort}"
        f"{result.solve_ms:.1f} ms   method {result.method}{source}"
    )


def remarks(result: Allocation) -> list[str]:
    """Sentences about a wrench that is not delivered, and what else the user should read."""
    words = list(result.notes)
    if result.reachable or result.unknown_fins:
        # With fins that the method does not know, what is missing says nothing about the robot.
        return words
    limits = f"; {', '.join(result.binding)}" if result.binding else ""
    return [f"not reached: {_short_of(result)}{limits}", *words]


def _short_of(result: Allocation) -> str:
    """What is missing, in words: the share that is there, or where that is nearly all, the worst axis."""
    if result.share < NEARLY_ALL:
        return f"{100 * result.share:.0f} % of the wrench is delivered"
    worst = int(np.argmax(np.abs(result.unallocated / result.scale)))
    unit = "N" if worst < 3 else "N m"
    return f"{AXES[worst]} is off by {abs(result.unallocated[worst]):.3g} {unit}"


def allocation_text(result: Allocation) -> str:
    """The answer as plain text."""
    actuators = aligned(COLUMNS, actuator_rows(result), (True, True, True, False))
    wrenches = aligned(WRENCH_COLUMNS, wrench_rows(result), (True, *(False,) * 6))
    return "\n".join([actuators, "", wrenches, "", summary(result), *remarks(result)])
