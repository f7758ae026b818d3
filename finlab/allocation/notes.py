"""Sentences about a robot, a method and a flow that the user should read before trusting an answer.

`LazyFigures` asks for them when the notes of a result are first read.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from finlab.actuators.actuator import Actuator
from finlab.actuators.fin.fin_laws import make_law
from finlab.actuators.fin.fin_model import DOUBT, FinModelSpec, Limits
from finlab.actuators.kinds import KINDS
from finlab.actuators.law import FinLaw
from finlab.arrays import NEARLY, Array
from finlab.axes import axes_in
from finlab.layout.layout import Layout

if TYPE_CHECKING:
    from finlab.allocation.method import Method

RESTLESS = 0.05
"""Share of its largest force from which on a fin's least force is told of."""
COMMANDS_ASKED = (5, 5, 16)
"""Amplitudes, frequencies and zero directions at which a fin is asked for its smallest and largest
force."""


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
    is_asked = (np.abs(target) > NEARLY * method.scale).reshape(-1, 6).any(axis=0)
    asked = axes_in(np.asarray(is_asked))
    undriven = [axis for axis in asked if axis in method.undriven]
    if undriven:
        axes = " or ".join(undriven)
        notes = (*notes, f"no actuator gives {axes}: what is asked of it is left out")
    uncommanded = [axis for axis in asked if axis not in layout.axes]
    if uncommanded:
        axes = " or ".join(uncommanded)
        notes = (
            *notes,
            f"layout {layout.name} does not command {axes} (axes): what is asked of it does not "
            "count",
        )
    return method.notes + notes


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
    foils = [actuator for actuator in layout.actuators if actuator.KIND.driven_by_flow]
    if flow is None:
        return (_nothing_at_rest(foils),) if foils else ()
    if layout.interaction is not None:
        guessed = ", ".join(
            actuator.name
            for actuator in layout.actuators
            if actuator.jet and actuator.advance is None
        )
        if not guessed:
            return ()
        return (f"what speed takes from {guessed} is guessed: no open_water is known of them",)
    if not foils:
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
