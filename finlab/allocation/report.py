"""An answer in words: two small tables and sentences for people, a JSON object for programs.

`print(result)`, the command line, the app and a robot's program say it in these words. The app has
tables of its own (`webapp/markup/answer.py`): they follow each step of a slider, with bars, loads
and limits in colour, and are too narrow for the words of a command.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import to_builtins

from finlab.actuators.actuator import Actuator
from finlab.actuators.fin.fin_laws import make_law
from finlab.actuators.fin.fin_model import DOUBT, FinModelSpec, Limits
from finlab.actuators.kinds import KINDS, laws_of
from finlab.actuators.law import FinLaw
from finlab.arrays import NEARLY, Array
from finlab.axes import AXES, MOTIONS, UNITS
from finlab.display import Block, Prefix, Table, listed, prefix_of, with_unit
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from finlab.allocation.method import Method

Allocation = Any
"""`finlab.allocation.Allocation`, which prints itself by what is here: it imports this module, so
that this one cannot import it, not even for its type."""

PLAIN_GAP = 0.01
"""Share by which the power may exceed its bound without a sentence."""

PROVED_GAP = 1e-4
"""Share by which the power may exceed its bound and count as proved least."""
UNKNOWN_GAP = 9.0
"""Share above the bound that says nothing of an answer, such as noise that pushes for nothing in a
table."""
LEAST_POWER = 1e-3
"""Bound [W] that shares are taken of where it is smaller, or nothing."""
SMALL_MISS = 0.05
"""Share of the largest miss, each axis over its scale, up to which another axis is not named."""
_SIX_NUMBERS = " ".join(["%.3f"] * 6)
"""Format of the components of a wrench."""

RESTLESS = 0.05
"""Share of its largest force from which on a fin's least force is told of."""
COMMANDS_ASKED = (5, 5, 16)
"""Amplitudes, frequencies and zero directions at which a fin is asked for its smallest and largest
force."""


def summary(result: Allocation) -> str:
    """Returns the figures of an answer in one line."""
    source = f", checkpoint {result.checkpoint}" if result.checkpoint else ""
    effort = "" if result.effort is None else f"effort {result.effort:.3f}   "
    expected = f"expected_error {result.expected_error:.2e}   " if result.expected_error else ""
    prefix = prefix_of(result.power)
    power = f"{result.power / prefix.factor:.3f} {prefix.symbol}W"
    return (
        f"err_norm {result.err_norm:.2e}   {expected}power {power}   {effort}"
        f"{result.solve_ms:.1f} ms   method {result.method}{source}"
    )


def remarks(result: Allocation) -> list[str]:
    """Returns sentences about a wrench that is not delivered, and what else the user should
    read."""
    notes = list(result.notes)
    if result.reachable or result.unknown_fins:
        # With fins that the method does not know, what is missing says nothing about the robot.
        return notes
    causes = [*share_words(result), missing_words(result), *result.binding]
    return [f"not reached: {'; '.join(causes)}", *notes]


def share_words(result: Allocation) -> list[str]:
    """Returns how much of the target is delivered in its own direction, in words; nothing where
    that is all of it, or less than nothing."""
    share_percent = round(100.0 * result.share)
    if not 0 <= share_percent < 100:
        return []
    return [f"{share_percent} % of the wrench is delivered"]


def missing_words(result: Allocation) -> str:
    """Returns what is left undone of a target, and what comes along unasked, axis by axis: `1.00 N
    of heave is left undone; 2.00 N of sway comes along unasked`."""
    if result.reachable:
        return "nothing is left undone"
    unallocated = result.unallocated
    # Residual of each axis over its scale, |r_k| / sigma_k.
    sizes = np.abs(unallocated / result.scale)
    undone: list[str] = []
    unasked: list[str] = []
    for k in np.argsort(-sizes):
        if sizes[k] < SMALL_MISS * sizes.max():
            continue
        amount = f"{with_unit(abs(unallocated[k]), UNITS[k])} of {MOTIONS[k]}"
        is_undone = unallocated[k] * result.target[k] > 0.0
        (undone if is_undone else unasked).append(amount)
    phrases = []
    if undone:
        phrases.append(f"{listed(undone)} {'is' if len(undone) == 1 else 'are'} left undone")
    if unasked:
        verb = "comes" if len(unasked) == 1 else "come"
        phrases.append(f"{listed(unasked)} {verb} along unasked")
    return "; ".join(phrases)


def allocation_blocks(result: Allocation) -> list[Block]:
    """Returns the answer as two tables, of actuators and of wrenches, and sentences."""
    actuator_rows: list[tuple[str, ...]] = []
    commands = result.commands
    # Python's numbers: numpy's take ten times as long to be written.
    sizes = [math.hypot(*force) for force in result.forces.tolist()]
    prefix = prefix_of(max(filter(math.isfinite, sizes), default=0.0))
    for actuator, size in zip(result.layout.actuators, sizes, strict=True):
        command = commands[actuator.name]
        words = "lost"
        force = ""
        if command is not None:
            words = command.words
            force = f"{size / prefix.factor:.3f}"
        actuator_rows.append((actuator.name, actuator.type, words, force))
    wrenches = {"asked": result.target, "delivered": result.wrench, "missing": result.unallocated}
    if result.expected_error:
        wrenches["uncertain"] = result.expected_miss
    wrench_table = _wrench_table({name: each.tolist() for name, each in wrenches.items()})
    is_text = (True, True, True, False)
    columns = ("actuator", "type", "command", f"force [{prefix.symbol}N]")
    actuators = Table(columns, actuator_rows, is_text)
    return [actuators, wrench_table, "\n".join([summary(result), *remarks(result)])]


def _wrench_table(wrenches: Mapping[str, list[float]]) -> Table:
    """Wrenches (6,) [N, N m] by name, all forces with one SI prefix and all torques with one: those
    of what is delivered, so that a target beyond all reach leaves its digits."""
    sizes = [abs(value) for value in wrenches["delivered"]]
    force_prefix = prefix_of(max(sizes[:3]))
    torque_prefix = prefix_of(max(sizes[3:]))
    rows = []
    for name, wrench in wrenches.items():
        rows.append((name, *_wrench_words(wrench, force_prefix, torque_prefix)))
    return Table(_wrench_heads(force_prefix, torque_prefix), rows, (True, *(False,) * 6))


@lru_cache(maxsize=64)
def _wrench_heads(force_prefix: Prefix, torque_prefix: Prefix) -> Sequence[str]:
    """Names of the columns of wrenches, cached: few prefixes occur."""
    prefixes = (force_prefix,) * 3 + (torque_prefix,) * 3
    heads = [""]
    for axis, unit, prefix in zip(AXES, UNITS, prefixes, strict=True):
        heads.append(f"{axis} [{prefix.symbol}{unit}]")
    return heads


def _wrench_words(wrench: list[float], force_prefix: Prefix, torque_prefix: Prefix) -> list[str]:
    """The components of a wrench (6,) [N, N m] with SI prefixes; NaN is that of a free axis."""
    newtons = force_prefix.factor
    newton_metres = torque_prefix.factor
    fx, fy, fz, tx, ty, tz = wrench
    scaled = (
        fx / newtons,
        fy / newtons,
        fz / newtons,
        tx / newton_metres,
        ty / newton_metres,
        tz / newton_metres,
    )
    numbers = _SIX_NUMBERS % scaled  # in half the time of one after the other
    return numbers.replace("nan", "free").replace("-0.000", "0.000").split()


def doubts(result: Allocation) -> tuple[str, ...]:
    """Returns sentences about what is not certain of an answer: its forces, and that no other takes
    less power."""
    sentences = (result.measure_next,) if result.measure_next else ()
    if result.bound is None or result.power <= (1.0 + PLAIN_GAP) * result.bound:
        return sentences
    least = result.bound
    calm_power = result.calm_power
    if calm_power > PLAIN_GAP * result.power:
        calm_percent = 100.0 * calm_power / result.power
        sentences = (
            *sentences,
            f"of its power, {calm_percent:.0f} % goes into less turning (calm)",
        )
        least += calm_power
    if result.power <= (1.0 + PLAIN_GAP) * least:
        return sentences
    if result.layout.interaction is not None:
        cause = (
            "the bound is that of the actuators' laws for what they push; what the jets take is "
            "not in it"
        )
    else:
        rates = "" if result.previous is None else ", or is held by its rates"
        has_buses = result.budget is not None and len(result.budget.names) > 1
        buses = ", or where several power buses bind" if has_buses else ""
        cause = (
            "where an actuator cannot rest, or has a wide arc, a dead band, drag or a measured "
            f"table{rates}{buses}, the least is not proved"
        )
    return (*sentences, f"{_gap_words(_power_gap(result.power, least))}: {cause}")


def _power_gap(power: float, least: float) -> float:
    """How far a power lies above a bound on it, both [W], as a share of the bound."""
    return (power - least) / max(least, LEAST_POWER)


def _gap_words(gap: float) -> str:
    """How far the power of an answer may be from the least, by such a share."""
    if gap > UNKNOWN_GAP:
        return "how far its power is from the least is not known"
    gap_percent = f"{100 * gap:.2g}" if gap < 0.1 else f"{100 * gap:.0f}"
    return f"its power is at most {gap_percent} % above the least"


def is_proved_least(result: Allocation) -> bool:
    """Returns whether no command that gives the same wrench takes less power, by the bound that the
    method proves."""
    return result.bound is not None and _power_gap(result.power, result.bound) <= PROVED_GAP


def bound_words(result: Allocation) -> str:
    """Returns how far the power of an answer may be from the least, by the bound that its method
    proves; nothing where it proves none."""
    if result.bound is None:
        return ""
    gap = _power_gap(result.power, result.bound)
    return "its power is proved least" if gap <= PROVED_GAP else _gap_words(gap)


def next_measurement(result: Allocation, plant: Plant) -> str:
    """Returns the sentence about what adds most to the expected error of an answer.

    Args:
        result: the answer.
        plant: of its robot, in its flow.

    Returns:
        Which uncertainty to measure next, and what is expected without it.
    """
    from finlab.physics.expected_miss import sources_of_miss

    sources = sources_of_miss(plant, result.command[None])
    variances = np.array([(source.variance[0] / result.scale**2).sum() for source in sources])
    largest = int(variances.argmax())
    error_without = float(np.sqrt(variances.sum() - variances[largest]))
    return (
        f"the true wrench is expected to be off by {result.expected_error:.2g}; measure "
        f"{sources[largest].words} next, without whose uncertainty {error_without:.2g} would be "
        "left"
    )


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


def answer_notes(
    layout: Layout, method: Method, flow: Array | None, target: Array, own: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Returns the sentences about answers of a method.

    Args:
        layout: the robot of the actuators that work.
        method: what answered.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.
        target: desired wrenches (6,) or (N, 6) [N, N m].
        own: sentences of the method about these very answers.

    Returns:
        Those of the method, those of `fin_notes`, its own, and what is asked of axes that nothing
        drives or that do not count.
    """
    notes = fin_notes(layout, flow) + own
    idle = _idle_axes(method.undriven, layout.axes)
    if not idle:
        return method.notes + notes
    asked_axes = _asked_axes(target, method.scale, idle)
    if not asked_axes:
        return method.notes + notes
    undriven = [axis for axis in asked_axes if axis in method.undriven]
    if undriven:
        axes = " or ".join(undriven)
        notes = (*notes, f"no actuator gives {axes}: what is asked of it is left out")
    uncommanded = [axis for axis in asked_axes if axis not in layout.axes]
    if uncommanded:
        axes = " or ".join(uncommanded)
        notes = (
            *notes,
            f"layout {layout.name} does not command {axes} (axes): what is asked of it does not "
            "count",
        )
    return method.notes + notes


def _asked_axes(target: Array, scale: Array, axes: Sequence[int]) -> list[str]:
    """Names of those of some axes along which one of the wrenches (6,) or (N, 6) [N, N m] is more
    than nothing."""
    if target.ndim == 1:
        # Numbers one by one: arrays take five times as long.
        return [AXES[k] for k in axes if abs(target.item(k)) > NEARLY * scale.item(k)]
    is_asked = np.any(np.abs(target) > NEARLY * scale, axis=0).tolist()
    return [AXES[k] for k in axes if is_asked[k]]


@lru_cache(maxsize=64)
def _idle_axes(undriven: tuple[str, ...], commanded: tuple[str, ...]) -> list[int]:
    """Indices of the axes of a wrench that nothing drives, or that do not count."""
    return [k for k, axis in enumerate(AXES) if axis in undriven or axis not in commanded]


def fin_notes(layout: Layout, flow: Array | None = None) -> tuple[str, ...]:
    """Returns the sentences about a robot that its user should read before trusting an answer.

    None is an error: a servo may be stuck, or a fin may have been damaged so that it runs on.

    Args:
        layout: the robot.
        flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.

    Returns:
        Why the layout itself is not to be trusted, where its description begins so; a sentence for
        each fin that cannot rest, and for each that may leave its table; and one about the flow.
    """
    return _notes_at_rest(layout, layout.stamps) + _flow_notes(layout, flow)


def _flow_notes(layout: Layout, flow: Array | None) -> tuple[str, ...]:
    """What needs a flow and has none, what a flow leaves unknown, or that no actuator feels it."""
    if flow is None and not layout.flow_driven:
        return ()
    foils = [actuator for actuator in layout.actuators if actuator.KIND.driven_by_flow]
    if flow is None:
        return (_nothing_at_rest(foils),)
    if layout.interaction is not None:
        if layout.interaction.type == "linear":
            # Its weights were learned at speed, and `expected_miss` says how surely.
            return ()
        guessed = ", ".join(
            actuator.name
            for actuator in layout.actuators
            if actuator.jet and actuator.advance is None
        )
        if not guessed:
            return ()
        return (f"what speed takes from {guessed} is guessed: no open_water is known of them",)
    feels_flow = any(law.feels_flow for _, law in laws_of(layout.actuators))
    if not feels_flow:
        kind_by_flow = next(name for name, kind in KINDS.items() if kind.KIND.driven_by_flow)
        return (
            f"the flow is without effect: layout {layout.name} has no {kind_by_flow}, and what "
            "speed through the water takes from other actuators is not known",
        )
    with_table = []
    for actuator in layout.actuators:
        model = getattr(actuator, "model", None)
        if not actuator.KIND.driven_by_flow and model and model.type == "table":
            with_table.append(actuator.name)
    if not with_table:
        return ()
    names = ", ".join(with_table)
    return (f"the tables of {names} hold forces at rest; what speed changes is not known",)


def _nothing_at_rest(foils: Sequence[Actuator]) -> str:
    """The sentence about foils that are asked without a flow."""
    names = ", ".join(foil.name for foil in foils)
    if len(foils) == 1:
        they_give = f"{foils[0].type} {names} gives"
    else:
        they_give = f"{foils[0].type}s {names} give"
    return f"{they_give} nothing at rest; tell how the robot moves through the water (flow)"


@lru_cache(maxsize=256)
def _notes_at_rest(layout: Layout, stamps: tuple[tuple[int, int] | None, ...]) -> tuple[str, ...]:
    """The sentences about a layout in still water; tables whose files have changed (by their
    stamps) are read again."""
    first_line = layout.description.partition("\n")[0]
    notes = [f"layout {layout.name} is {first_line}"] if first_line.startswith(DOUBT) else []
    notes += layout.parts_notes
    for fin in layout.fins:
        notes_of_fin = _notes_of_model(fin.model, fin.limits, fin.stamp)
        notes += [note.replace("{name}", fin.name) for note in notes_of_fin]
    return tuple(notes)


@lru_cache(maxsize=1024)
def _notes_of_model(
    model: FinModelSpec, limits: Limits, stamp: tuple[int, int] | None
) -> tuple[str, ...]:
    """The sentences about any fin of a model within limits, with `{name}` for its name."""
    law = make_law(model)
    doubtful = [
        f"the model of fin {{name}} is {note}" for note in law.notes if note.startswith(DOUBT)
    ]
    notes = (*doubtful, *_restless(law, limits))
    if not law.measured:
        return notes
    from finlab.allocation.table_notes import beyond_table

    return (*notes, *beyond_table(law, limits))


def _restless(law: FinLaw, limits: Limits) -> list[str]:
    """The sentence about a fin that cannot rest; none about any other."""
    axes = [
        np.linspace(low, high, count)
        for low, high, count in zip(limits.lower, limits.upper, COMMANDS_ASKED, strict=True)
    ]
    commands = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    size = np.linalg.norm(law.force(commands), axis=-1)
    smallest = float(size.min())
    largest = float(size.max())
    if smallest <= RESTLESS * largest:
        return []
    return [
        "fin {name} cannot rest: within its limits it always pushes with at least "
        f"{smallest:.3g} N of at most {largest:.3g} N; wrenches that need less of it are out of "
        "reach"
    ]
