"""Report of an answer: two small tables and sentences for people, a JSON object for programs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from msgspec import to_builtins

from finlab.arrays import Array
from finlab.axes import AXES
from finlab.display.blocks import Block, Table
from finlab.layout import Layout
from finlab.physics.expected_miss import sources_of_miss
from finlab.physics.plant import Plant

Allocation = Any
"""`finlab.allocation.Allocation`, which prints itself by what is here."""

PLAIN_GAP = 0.01
"""Share by which the power may exceed its bound without a sentence."""

NEARLY_ALL = 0.995
"""Share of a wrench from which on it is printed as all of it."""
COLUMNS = ("actuator", "type", "command", "force [N]")
"""Columns of the table of actuators."""
WRENCH_COLUMNS = ("", *(f"{axis} [{'N' if axis.startswith('F') else 'N m'}]" for axis in AXES))
"""Columns of the table of wrenches."""


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


def allocation_blocks(result: Allocation) -> list[Block]:
    """The answer as two tables and sentences."""
    rows: list[tuple[str, ...]] = []
    for part, force in zip(result.layout.actuators, result.forces, strict=True):
        command = result.commands[part.name]
        cells = ("lost", "") if command is None else (command.words, f"{math.hypot(*force):.3f}")
        rows.append((part.name, part.type, *cells))
    wrenches = {"asked": result.target, "delivered": result.wrench, "missing": result.unallocated}
    if result.expected_error:
        wrenches["uncertain"] = result.expected_miss
    # `+ 0.0` turns a rounded -0.0 into 0.0.
    table = [
        (name, *("free" if math.isnan(v) else f"{round(v, 3) + 0.0:.3f}" for v in row))
        for name, row in wrenches.items()
    ]
    actuators = Table(COLUMNS, rows, (True, True, True, False))
    wrench = Table(WRENCH_COLUMNS, table, (True, *(False,) * 6))
    return [actuators, wrench, "\n".join([summary(result), *remarks(result)])]


def doubts(result: Allocation) -> tuple[str, ...]:
    """Sentences about what is not certain of an answer: its forces, and that no other takes less power."""
    doubt = (result.measure_next,) if result.measure_next else ()
    if result.bound is None or result.power <= (1.0 + PLAIN_GAP) * result.bound:
        return doubt
    least = result.bound
    if (calm := result.calm_power) > PLAIN_GAP * result.power:
        doubt = (*doubt, f"of its power, {100.0 * calm / result.power:.0f} % goes into less turning (calm)")
        least += calm
    if result.power <= (1.0 + PLAIN_GAP) * least:
        return doubt
    gap = f"of its power, {100.0 * (1.0 - least / result.power):.0f} % may be more than needed"
    if result.layout.interaction is not None:
        cause = "the bound is that of the actuators' laws for what they push; what the jets take is not in it"
    else:
        rates = "" if result.previous is None else ", or is held by its rates"
        cause = (
            "where an actuator cannot rest, or has a wide arc, a dead band, drag or a measured table"
            f"{rates}, the least is not proved"
        )
    return (*doubt, f"{gap}: {cause}")


def next_measurement(result: Allocation, plant: Plant) -> str:
    """The sentence about what adds most to the expected error of an answer."""
    sources = sources_of_miss(plant, result.command[None])
    parts = np.array([(source.variance[0] / result.scale**2).sum() for source in sources])
    most = int(parts.argmax())
    left = float(np.sqrt(parts.sum() - parts[most]))
    return (
        f"the true wrench is expected to be off by {result.expected_error:.2g}; measure "
        f"{sources[most].words} next, without whose uncertainty {left:.2g} would be left"
    )


RECORD = (
    *("lost", "target", "flow", "wrench_expected", "wrench_plant", "unallocated", "err_norm"),
    *("expected_error", "expected_miss", "effort", "power", "bound", "calm_power", "scale", "solve_ms"),
    *("method", "checkpoint", "reachable", "share", "binding", "unknown_fins", "notes"),
)
"""Keys of the JSON object, beside those of the commands; they are a contract."""


def allocation_record(result: Allocation) -> dict[str, object]:
    """The JSON object of an answer."""
    values = {key: getattr(result, "wrench" if key == "wrench_plant" else key) for key in RECORD}
    values["target"] = plain_target(result.target)
    values |= {key: list(value) for key, value in values.items() if isinstance(value, tuple)}
    plain = to_builtins(values, enc_hook=np.ndarray.tolist)
    return {**command_record(result.layout, result.command, result.forces), **plain}


def plain_target(target: Array) -> list[float | None]:
    """A target (6,) as plain values, None for an axis that is free."""
    return [None if np.isnan(value) else value for value in target.tolist()]


def command_record(layout: Layout, command: Array, forces: Array) -> dict[str, object]:
    """Commands (n, 3) with their forces (n, 3) [N], body frame, as plain values, along an axis of its own the
    signed one; None for a lost actuator, whose row is NaN."""
    values: list[dict[str, object]] = []
    for part, row, force in zip(layout.actuators, command, forces, strict=True):
        own, axis = part.command(row), getattr(part, "axis", None)
        along = force.tolist() if axis is None else float(force @ np.array(axis))
        plain = None if own is None else to_builtins(own)
        values.append({"name": part.name, "type": part.type, "force_n": along, "command": plain})
    if not layout.is_of_fins:
        return {"actuators": values}
    rows = [None if np.isnan(row).any() else row.tolist() for row in command]
    return {"actuators": values, "fins": list(layout.names), "command": rows}
