"""Sentences about fins with tables of forces: what the tables do not hold."""

from finlab.actuators.fin.fin_model import Limits
from finlab.actuators.fin.table_law import TableLaw
from finlab.actuators.law import FinLaw
from finlab.axes import wrapped
from finlab.physics.table_error import grid_uncertainty

AXES_OF_TABLES = ("half amplitudes", "frequencies", "zero directions")
BEYOND = 1e-6
"""By how much [rad, Hz] limits may exceed a table unnoticed."""


def beyond_table(law: FinLaw, limits: Limits) -> list[str]:
    """Returns the sentences about a fin with a table, with a place for its `{name}`: where its
    limits leave the table, and where the table has too few lines to tell how wrong it is between
    them."""
    assert isinstance(law, TableLaw)
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
            f"the table of fin {{name}} has two {' and two '.join(few)} alone: how wrong it is "
            "between them "
            "cannot be told"
        )
    return notes
