"""Sentences about fins with tables of forces: what the tables do not hold."""

from finlab.actuators.fin.fin_model import Limits
from finlab.actuators.fin.table_law import TableLaw
from finlab.actuators.law import FinLaw
from finlab.axes import wrapped
from finlab.physics.table_error import grid_uncertainty

AXES_OF_TABLES = ("half amplitudes", "frequencies", "zero directions")
"""What the axes of a table are called."""
BEYOND = 1e-6
"""By how much [rad, Hz] limits may exceed a table unnoticed."""


def beyond_table(law: FinLaw, limits: Limits) -> list[str]:
    """Returns the sentences about a fin with a table.

    Args:
        law: of the fin, a `TableLaw`.
        limits: of its commands.

    Returns:
        Where its limits leave the table, and where the table has too few lines to tell how wrong it
        is between them; with `{name}` for the fin's name.
    """
    assert isinstance(law, TableLaw)
    ends = [("half amplitudes", "rad", limits.amplitude), ("frequencies", "Hz", limits.frequency)]
    if not law.periodic:
        # The arc of the fin is counted from the same full turn as that of the table.
        from_table = 0.5 * sum(limits.zero_direction) - 0.5 * sum(law.covers[2])
        shift = float(wrapped(from_table)) - from_table
        low, high = (end + shift for end in limits.zero_direction)
        ends.append(("zero directions", "rad", (low, high)))
    notes = [
        f"fin {{name}} may be asked for {name} of {low:.3g} to {high:.3g} {unit}, its table holds "
        f"{covered[0]:.3g} to {covered[1]:.3g}: beyond, its edge is taken"
        for (name, unit, (low, high)), covered in zip(ends, law.covers, strict=False)
        if low < covered[0] - BEYOND or high > covered[1] + BEYOND
    ]
    few = [AXES_OF_TABLES[k] for k in grid_uncertainty(law).error.few]
    if few:
        notes.append(
            f"the table of fin {{name}} has two {' and two '.join(few)} alone: how wrong it is "
            "between them cannot be told"
        )
    return notes
