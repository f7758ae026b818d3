"""What answers cost, in watts and as the paper's effort, beside the best of many random starts."""

from collections.abc import Sequence

from finlab.evaluation.experiments.cost import OBJECTIVES, TRACKED, UNITS
from finlab.evaluation.plots.costs import cost_by_fins
from finlab.evaluation.report.document import Block, Column, Figure, Fold, Row, Table, method_row


def _columns(unit: str) -> tuple[Column, ...]:
    return (
        Column("split", "cases", "code"),
        Column("method", "method"),
        Column("fins", "fins"),
        Column("n", "targets", "count"),
        Column("tracked", "tracked", "share"),
        Column("cost", f"mean cost [{unit}]", "three"),
        Column("cost_ratio", "over the best start", "ratio", "cost_ratio_interval"),
        Column("ratio_p95", "95th percentile", "ratio"),
        Column("ratio_max", "worst target", "ratio"),
        Column("cheaper", "cheaper than it", "share"),
        Column("win_error", "error by hand", "error"),
    )


def cost_blocks(rows: Sequence[Row], n_starts: int) -> list[Block]:
    """The whole section; so many random starts for each target."""
    picture = Figure(
        "cost-by-fins",
        lambda: cost_by_fins([row for row in rows if row["split"] == "id"]),
        "Cost over that of the best start with the interval of a rerun, split `id`.",
    )
    return [*introduction(n_starts), picture, *cost_tables(rows)]


def introduction(n_starts: int) -> tuple[Block, ...]:
    """What is compared with what."""
    return (
        "## Cost",
        (
            f"The yardstick is the cheapest end of {n_starts} random starts of IPOPT with the wrench as a "
            f"constraint ({2 * n_starts} of SLSQP where fins are tables), solvers that share nothing with "
            f"how the methods search; compared where both deliver the wrench to {TRACKED:g}, by the plant, "
            "whose physics both sides were given. Power grows faster than force, so its optimum mostly "
            "loads all fins; effort is the paper's proxy J_en, whose cheapest answer often lets some fins "
            "rest. The paper prints no weights of it; ours are 1 for amplitude, frequency and their product, "
            "0.1 for the zero direction, each over its fin's own limit. `axes`: pure axes on the layouts A, "
            "B, penta, hexa and octo, `axes-mixed`: two or three of them together; `coincident` and "
            "`stacked`: two fins at one place, and pairs one above the other. Error by hand: the largest "
            "error of the answers that are cheaper than every start, by the drag law written out apart from "
            "the plant."
        ),
    )


def cost_tables(rows: Sequence[Row]) -> list[Block]:
    """The tables of each objective, over all fins and by their number."""
    blocks: list[Block] = []
    for objective in OBJECTIVES:
        columns = _columns(UNITS[objective])
        shown = [row for row in rows if row["objective"] == objective]
        whole = [method_row(row) for row in shown if row["fins"] == "all"]
        by_fins = [method_row(row) for row in shown if row["fins"] != "all"]
        if shown:
            blocks += [
                f"### {objective.capitalize()}",
                Table(columns, whole),
                Fold("The same by number of fins", (Table(columns, by_fins),)),
            ]
    return blocks
