"""What the network of method `mdn` buys, by number of fins and objective."""

from collections.abc import Sequence

from finlab.evaluation.experiments.cost import OBJECTIVES
from finlab.evaluation.experiments.network import STARTS, TRACKED
from finlab.evaluation.plots.costs import cost_by_starts
from finlab.evaluation.report.document import Block, Column, Figure, Fold, Row, Table

SEEDED = [name for name in STARTS if name != "all"]
"""What is compared with `all`."""
SIDE_BY_SIDE = (
    Column("fins", "fins", "count"),
    Column("n", "targets", "count"),
    *(Column(name, f"`{name}`", "metres", f"{name}_interval") for name in SEEDED),
    *(Column(f"{name}_ms", f"`{name}` [ms]", "three") for name in ("network", "sub-layouts", "all")),
)
EVERY_ROW = (
    Column("fins", "fins", "count"),
    Column("seeds", "begun from", "code"),
    Column("tracked", "tracked", "share"),
    Column("error_mean", "mean error", "error"),
    Column("error_max", "largest", "error"),
    Column("cost_ratio", "cost over `all`", "metres", "cost_ratio_interval"),
    Column("dearer", "over 1 % dearer", "share"),
    Column("ms", "ms per call", "three"),
)


def network_blocks(rows: Sequence[Row], n_candidates: int) -> list[Block]:
    """The whole section; so many seeds where there are several."""
    blocks: list[Block] = [
        "## What the network buys",
        (
            "The same search answers the same targets; only where it begins differs. The search makes the "
            "answers exact, so a network can only make them cheaper or faster, and cheaper only where cost "
            "has several local minima. Robots with fins that no training saw, half of them with one random "
            "model for all fins, half with one for each; every row was given the fins' own laws, which score "
            f"it. {n_candidates} seeds where there are several. Cost is compared where both deliver the "
            f"target to {TRACKED:g}; times are the processor's, of single calls."
        ),
        "\n".join(f"- `{name}`: {what}" for name, what in STARTS.items()),
        Figure(
            "network", lambda: cost_by_starts(rows), "Cost over that of `all`, with the interval of a rerun."
        ),
    ]
    for objective in OBJECTIVES:
        shown = [row for row in rows if row["objective"] == objective]
        if shown:
            every = Fold("Every row, with errors", (Table(EVERY_ROW, shown),))
            title = f"### {objective.capitalize()} over that of `all`"
            blocks += [title, Table(SIDE_BY_SIDE, _side_by_side(shown)), every]
    return blocks


def _side_by_side(rows: Sequence[Row]) -> list[Row]:
    """One row per number of fins, one column per start."""
    lines: dict[int, Row] = {}
    for row in rows:
        line = lines.setdefault(row["fins"], {"fins": row["fins"], "n": row["n"]})
        name = row["seeds"]
        line |= {name: row.get("cost_ratio"), f"{name}_interval": row.get("cost_ratio_interval")}
        line[f"{name}_ms"] = row["ms"]
    return list(lines.values())
