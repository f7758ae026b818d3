"""Energies beside 32 starts of IPOPT, fins at rest, and the check of every win on the plant."""

from __future__ import annotations

from finlab.evaluation.plots.wrench_tracking import energy_by_fins
from finlab.evaluation.report.document import Block, Column, Figure, Fold, Row, Table, method_row
from finlab.evaluation.report.plan import REFERENCE
from finlab.evaluation.report.results import Results

COLUMNS = (
    Column("method", "method"),
    Column("fins", "fins"),
    Column("n", "targets", "count"),
    Column("success_0.01", "within 0.01", "share"),
    Column("energy_mean", "mean energy", "three"),
    Column("energy_ratio", f"energy over {REFERENCE}'s", "ratio", "energy_ratio_interval"),
    Column("cheaper", "cheaper than it", "share"),
    Column("resting", "fins at rest", "three"),
)
CHECKS = (
    Column("method", "method"),
    Column("wins", f"targets cheaper than {REFERENCE}", "count"),
    Column("worst_error", "their largest error, checked again", "error"),
    Column("outside", "commands outside limits", "count"),
)


def energy_blocks(results: Results) -> list[Block]:
    """The whole section; nothing where the reference is not installed."""
    rows = results.energy_rows
    if not rows:
        return []
    whole = [_shown(row) for row in rows if row["fins"] == "all"]
    by_fins = [_shown(row) for row in rows if row["fins"] != "all"]
    return [
        "## Energy",
        (
            f"The best of 32 IPOPT starts (`{REFERENCE}`) is the yardstick: reachable targets of split `id`, "
            "the first ones of each layout, compared where both methods come within 0.05. The energy is "
            "concave in a fin's force, so the cheapest answer often lets some fins rest."
        ),
        Figure.drawn(
            "energy-by-fins",
            energy_by_fins(rows, REFERENCE),
            f"Energy over that of `{REFERENCE}` with the interval of a rerun, and how many fins give less "
            "than a hundredth of the force they can give.",
        ),
        Table(COLUMNS, whole),
        Fold("The same by number of fins", (Table(COLUMNS, by_fins),)),
        "### Every win checked again",
        (
            f"Each answer that is cheaper than `{REFERENCE}`'s was computed once more in double precision, "
            "by the fin law written out apart from the plant, and held against the limits bit for bit."
        ),
        Table(CHECKS, [{**row, "method": f"`{row['method']}`"} for row in results.recheck_rows]),
    ]


def _shown(row: Row) -> Row:
    known = row["method"] != REFERENCE and "energy_ratio_low" in row
    ends = [row["energy_ratio_low"], row["energy_ratio_high"]] if known else None
    return method_row({**row, "energy_ratio_interval": ends})
