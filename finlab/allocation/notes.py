"""Sentences that the user should read of a robot before trusting any answer, whatever the method."""

from functools import lru_cache

import numpy as np

from finlab.actuators.fin.fin_laws import file_stamp
from finlab.actuators.fin.force_table_file import DOUBT
from finlab.actuators.kinds import KINDS
from finlab.allocation.method import Method
from finlab.arrays import Array
from finlab.axes import axes_in, wrapped
from finlab.layout import FinModelSpec, Layout, Limits
from finlab.physics import FinLaw, TableLaw, make_law
from finlab.physics.table_error import grid_uncertainty
from finlab.precision import NEARLY

RESTLESS = 0.05
"""Share of its largest force below which a fin counts as able to rest."""
STEPS = (5, 5, 16)
"""Amplitudes, frequencies and zero directions at which a fin is asked for its smallest and largest force."""
AXES_OF_TABLES = ("half amplitudes", "frequencies", "zero directions")
BEYOND = 1e-6
"""By how much [rad, Hz] limits may exceed a table unnoticed."""


def answer_notes(
    layout: Layout, method: Method, flow: Array | None, target: Array, own: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Returns the sentences about answers of a method for targets (6,) or (N, 6): those of `fin_notes`, those
    of the method's `own`, what is asked of axes that nothing drives or that do not count, and fins that its
    networks do not know."""
    notes = fin_notes(layout, flow) + own
    wanted = np.asarray((np.abs(target) > NEARLY * method.scale).reshape(-1, 6).any(axis=0))
    named = axes_in(wanted)
    undriven = method.undriven
    if left := [axis for axis in named if axis in undriven]:
        notes = (*notes, f"no actuator gives {' or '.join(left)}: what is asked of it is left out")
    if left := [axis for axis in named if axis not in layout.axes]:
        its = f"layout {layout.name} does not command {' or '.join(left)} (axes)"
        notes = (*notes, f"{its}: what is asked of it does not count")
    model, weights = method.fin_model, method.weights
    if not method.unknown_fins or model is None or weights is None:
        return notes
    values = [f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in model.values().items()]
    return (
        f"the method does not know these fins: {', '.join(method.unknown_fins)}; checkpoint "
        f"{weights.name!r} takes them for fins of model {model.type!r} ({', '.join(values)}): trust the "
        "plant's error or train a surrogate for them",
        *notes,
    )


def fin_notes(layout: Layout, flow: Array | None = None) -> tuple[str, ...]:
    """Returns a sentence for each fin that cannot rest, and for each that may leave its table; before them,
    why the layout itself is not to be trusted, where its description begins so. After them, what needs the
    flow and has none, what a flow (6,) leaves unknown, or that no actuator feels it.

    None is an error: a servo may be stuck, or a fin may have been damaged so that it runs on.
    """
    notes = _made(layout, layout.stamps)
    foils = [part for part in layout.actuators if part.BY_FLOW]
    if flow is None and not foils:
        return notes
    if flow is None:
        names, one = ", ".join(part.name for part in foils), len(foils) == 1
        them = f"{foils[0].type}{'' if one else 's'} {names} {'gives' if one else 'give'}"
        return (*notes, f"{them} nothing at rest; tell how the robot moves through the water (flow)")
    if layout.interaction is not None:
        guessed = [part.name for part in layout.actuators if part.jet and part.advance is None]
        taken = f"what speed takes from {', '.join(guessed)} is guessed: no open_water is known of them"
        return (*notes, taken) if guessed else notes
    if not foils:
        kind = next(name for name, kind in KINDS.items() if kind.BY_FLOW)
        return (
            *notes,
            f"the flow is without effect: layout {layout.name} has no {kind}, and what speed through the "
            "water takes from other actuators is not known",
        )
    models = {part.name: getattr(part, "model", None) for part in layout.actuators if not part.BY_FLOW}
    tables = ", ".join(name for name, model in models.items() if model and model.type == "table")
    speed = (f"the tables of {tables} hold forces at rest; what speed changes is not known",)
    return notes + (speed if tables else ())


@lru_cache(maxsize=256)
def _made(layout: Layout, stamps: tuple[tuple[int, int] | None, ...]) -> tuple[str, ...]:
    first = layout.description.partition("\n")[0]
    notes = [f"layout {layout.name} is {first}"] if first.startswith(DOUBT) else []
    for fin in layout.fins:
        own = _notes_of(fin.model, fin.limits, file_stamp(fin.reads))
        notes += [note.replace("{name}", fin.name) for note in own]
    return tuple(notes)


@lru_cache(maxsize=1024)
def _notes_of(model: FinModelSpec, limits: Limits, stamp: tuple[int, int] | None) -> tuple[str, ...]:
    """The sentences about any fin of a model within limits, with a place for its name."""
    law = make_law(model)
    known = law.notes if isinstance(law, TableLaw) else ()
    doubts = [f"the model of fin {{name}} is {note}" for note in known if note.startswith(DOUBT)]
    return (*doubts, *_restless(law, limits), *_beyond_table(law, limits))


def _restless(law: FinLaw, limits: Limits) -> list[str]:
    ends = zip(limits.lower, limits.upper, STEPS, strict=True)
    grid = np.meshgrid(*(np.linspace(low, high, count) for low, high, count in ends), indexing="ij")
    size = np.linalg.norm(law.force(np.stack(grid, axis=-1)), axis=-1)
    least, most = float(size.min()), float(size.max())
    if least <= RESTLESS * most:
        return []
    return [
        f"fin {{name}} cannot rest: within its limits it always pushes with at least {least:.3g} N of at "
        f"most {most:.3g} N; wrenches that need less of it are out of reach"
    ]


def _beyond_table(law: FinLaw, limits: Limits) -> list[str]:
    if not isinstance(law, TableLaw):
        return []
    ends = [("half amplitudes", "rad", limits.amplitude), ("frequencies", "Hz", limits.frequency)]
    if not law.periodic:
        middle = 0.5 * sum(law.covers[2])
        turn = 0.5 * sum(limits.zero_direction) - middle
        shift = float(wrapped(turn)) - turn
        low, high = (end + shift for end in limits.zero_direction)
        ends.append(("zero directions", "rad", (low, high)))
    notes = [
        f"fin {{name}} may be asked for {name} of {low:.3g} to {high:.3g} {unit}, "
        f"its table holds {covered[0]:.3g} to {covered[1]:.3g}: beyond, its edge is taken"
        for (name, unit, (low, high)), covered in zip(ends, law.covers, strict=False)
        if low < covered[0] - BEYOND or high > covered[1] + BEYOND
    ]
    if few := [AXES_OF_TABLES[k] for k in grid_uncertainty(law).error.few]:
        notes.append(
            f"the table of fin {{name}} has two {' and two '.join(few)} alone: how wrong it is between them "
            "cannot be told"
        )
    return notes
