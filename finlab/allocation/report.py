"""What is said of an answer: two small tables and sentences for people, a JSON object for
programs."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import to_builtins

from finlab.actuators.fin.fin_laws import make_law
from finlab.actuators.fin.fin_model import DOUBT, FinModelSpec, Limits
from finlab.actuators.kinds import KINDS
from finlab.actuators.law import FinLaw
from finlab.arrays import NEARLY, Array
from finlab.axes import AXES, axes_in
from finlab.display import Block, Table
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from finlab.allocation.method import Method

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

RESTLESS = 0.05
"""Share of its largest force below which a fin counts as able to rest."""
STEPS = (5, 5, 16)
"""Amplitudes, frequencies and zero directions at which a fin is asked for its smallest and largest
force."""


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
    """What is missing, in words: the share that is there, or where that is nearly all, the worst
    axis."""
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
    """Sentences about what is not certain of an answer: its forces, and that no other takes less
    power."""
    doubt = (result.measure_next,) if result.measure_next else ()
    if result.bound is None or result.power <= (1.0 + PLAIN_GAP) * result.bound:
        return doubt
    least = result.bound
    if (calm := result.calm_power) > PLAIN_GAP * result.power:
        doubt = (
            *doubt,
            f"of its power, {100.0 * calm / result.power:.0f} % goes into less turning (calm)",
        )
        least += calm
    if result.power <= (1.0 + PLAIN_GAP) * least:
        return doubt
    gap = f"of its power, {100.0 * (1.0 - least / result.power):.0f} % may be more than needed"
    if result.layout.interaction is not None:
        cause = (
            "the bound is that of the actuators' laws for what they push; what the jets take is "
            "not in it"
        )
    else:
        rates = "" if result.previous is None else ", or is held by its rates"
        cause = (
            "where an actuator cannot rest, or has a wide arc, a dead band, drag or a measured "
            "table"
            f"{rates}, the least is not proved"
        )
    return (*doubt, f"{gap}: {cause}")


def next_measurement(result: Allocation, plant: Plant) -> str:
    """The sentence about what adds most to the expected error of an answer."""
    from finlab.physics.expected_miss import sources_of_miss

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
    *(
        "expected_error",
        "expected_miss",
        "effort",
        "power",
        "bound",
        "calm_power",
        "scale",
        "solve_ms",
    ),
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
    """Commands (n, 3) with their forces (n, 3) [N], body frame, as plain values, along an axis of
    its own the signed one; None for a lost actuator, whose row is NaN."""
    values: list[dict[str, object]] = []
    for part, row, force in zip(layout.actuators, command, forces, strict=True):
        own = part.command(row)
        axis = getattr(part, "axis", None)
        along = force.tolist() if axis is None else float(force @ np.array(axis))
        plain = None if own is None else to_builtins(own)
        values.append({"name": part.name, "type": part.type, "force_n": along, "command": plain})
    if not layout.is_of_fins:
        return {"actuators": values}
    rows = [None if np.isnan(row).any() else row.tolist() for row in command]
    return {"actuators": values, "fins": list(layout.names), "command": rows}


def answer_notes(
    layout: Layout, method: Method, flow: Array | None, target: Array, own: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Returns the sentences about answers of a method for targets (6,) or (N, 6): those of the
    method, those of `fin_notes`, those about these very answers (`own`), and what is asked of axes
    that nothing drives or that do not count."""
    notes = fin_notes(layout, flow) + own
    wanted = np.asarray((np.abs(target) > NEARLY * method.scale).reshape(-1, 6).any(axis=0))
    named = axes_in(wanted)
    undriven = method.undriven
    if left := [axis for axis in named if axis in undriven]:
        notes = (*notes, f"no actuator gives {' or '.join(left)}: what is asked of it is left out")
    if left := [axis for axis in named if axis not in layout.axes]:
        its = f"layout {layout.name} does not command {' or '.join(left)} (axes)"
        notes = (*notes, f"{its}: what is asked of it does not count")
    return method.notes + notes


def fin_notes(layout: Layout, flow: Array | None = None) -> tuple[str, ...]:
    """Returns a sentence for each fin that cannot rest, and for each that may leave its table;
    before them, why the layout itself is not to be trusted, where its description begins so. After
    them, what needs the flow and has none, what a flow (6,) leaves unknown, or that no actuator
    feels it.

    None is an error: a servo may be stuck, or a fin may have been damaged so that it runs on.
    """
    notes = _made(layout, layout.stamps)
    foils = [part for part in layout.actuators if part.KIND.driven_by_flow]
    if flow is None and not foils:
        return notes
    if flow is None:
        names = ", ".join(part.name for part in foils)
        one = len(foils) == 1
        them = f"{foils[0].type}{'' if one else 's'} {names} {'gives' if one else 'give'}"
        return (
            *notes,
            f"{them} nothing at rest; tell how the robot moves through the water (flow)",
        )
    if layout.interaction is not None:
        guessed = [part.name for part in layout.actuators if part.jet and part.advance is None]
        taken = (
            f"what speed takes from {', '.join(guessed)} is guessed: no open_water is known of them"
        )
        return (*notes, taken) if guessed else notes
    if not foils:
        kind = next(name for name, kind in KINDS.items() if kind.KIND.driven_by_flow)
        return (
            *notes,
            f"the flow is without effect: layout {layout.name} has no {kind}, and what speed "
            "through the "
            "water takes from other actuators is not known",
        )
    models = {
        part.name: getattr(part, "model", None)
        for part in layout.actuators
        if not part.KIND.driven_by_flow
    }
    tables = ", ".join(name for name, model in models.items() if model and model.type == "table")
    speed = (f"the tables of {tables} hold forces at rest; what speed changes is not known",)
    return notes + (speed if tables else ())


@lru_cache(maxsize=256)
def _made(layout: Layout, stamps: tuple[tuple[int, int] | None, ...]) -> tuple[str, ...]:
    first = layout.description.partition("\n")[0]
    notes = [f"layout {layout.name} is {first}"] if first.startswith(DOUBT) else []
    for fin in layout.fins:
        own = _notes_of(fin.model, fin.limits, fin.stamp)
        notes += [note.replace("{name}", fin.name) for note in own]
    return tuple(notes)


@lru_cache(maxsize=1024)
def _notes_of(
    model: FinModelSpec, limits: Limits, stamp: tuple[int, int] | None
) -> tuple[str, ...]:
    """The sentences about any fin of a model within limits, with a place for its name."""
    law = make_law(model)
    doubts = [
        f"the model of fin {{name}} is {note}" for note in law.notes if note.startswith(DOUBT)
    ]
    notes = (*doubts, *_restless(law, limits))
    if not law.measured:
        return notes
    from finlab.allocation.table_notes import beyond_table

    return (*notes, *beyond_table(law, limits))


def _restless(law: FinLaw, limits: Limits) -> list[str]:
    ends = zip(limits.lower, limits.upper, STEPS, strict=True)
    grid = np.meshgrid(*(np.linspace(low, high, count) for low, high, count in ends), indexing="ij")
    size = np.linalg.norm(law.force(np.stack(grid, axis=-1)), axis=-1)
    least = float(size.min())
    most = float(size.max())
    if least <= RESTLESS * most:
        return []
    return [
        f"fin {{name}} cannot rest: within its limits it always pushes with at least {least:.3g} "
        "N of at "
        f"most {most:.3g} N; wrenches that need less of it are out of reach"
    ]
