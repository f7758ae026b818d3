"""The first screen: a few numbers, and in which measures and cases each method leads, by their intervals."""

from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.report.document import Block, Card, Column, Fold, Row, Table
from finlab.evaluation.report.numbers import error, factor, share, three
from finlab.evaluation.report.results import Results
from finlab.evaluation.report.verdicts import LEADS, LEVEL, TRAILS, compare, standings, with_printed

OURS = "learned"
STANDINGS = (
    Column("measure", "less is better"),
    Column("method", "method", "code"),
    Column("against", "against", "code"),
    Column(LEADS, "it leads"),
    Column(TRAILS, "the other leads"),
    Column(LEVEL, "neither"),
)
COMPARISONS = (
    Column("measure", "less is better"),
    Column("case", "case"),
    Column("method", "method", "code"),
    Column("ours", "its value", "error", "our_interval"),
    Column("against", "against", "code"),
    Column("theirs", "the other's", "error", "their_interval"),
    Column("verdict", "it"),
)


def summary_blocks(results: Results) -> list[Block]:
    """Cards, who leads where, and every comparison behind it."""
    found = comparisons(results)
    return [
        tuple(_cards(results, results.wrench_rows)),
        "## Who leads",
        (
            "The learned allocator against every other method. One leads where the intervals in which reruns "
            "would land do not overlap; a single run has none and no verdict. Figures that the paper prints "
            "count as exact. `analytic`, `sqp`, `qp`, `multistart`, `trf`, `slsqp` and `ipopt` know the fin "
            "law itself, the learned allocator knows forward samples only."
        ),
        Table(STANDINGS, standings(found)),
        Fold("Every comparison, with its values", (Table(COMPARISONS, found),)),
    ]


def comparisons(results: Results) -> list[Row]:
    """Every table's rows against those of the learned allocator."""
    printed, tables = paper_figures(), results.tables
    found: list[Row] = []
    for split, rows in results.wrench_rows.items():
        theirs = printed["wrench_tracking"].get(split, {})
        means = {"paper (printed)": theirs["ours"]["err_norm_mean"]} if theirs else {}
        beside = with_printed(rows, "err_norm_mean", means)
        found += compare("mean error", beside, "err_norm_mean", split)
    for row in results.ablation_rows:
        if (row["variant"], row["refinement"]) == ("ours", "adam"):
            means = {"paper (printed)": printed["ablation"]["ours"]["err_norm_mean"]}
            beside = with_printed([{**row, "method": "paper"}], "err_norm_mean", means)
            where = f"ablation by the {row['scored_by']}"
            found += compare("mean error", beside, "err_norm_mean", where, ("paper",))
    found += compare("energy", results.energy_rows, "energy_ratio", _fins)
    found += compare("time per call", tables.get("latency", ()), "p50_ms", "4 fins")
    found += compare("ATE", tables.get("trajectory", ()), "ate", lambda row: f"layouts {row['layout']}")
    faults = [row for row in tables.get("faults", ()) if row["controllable"]]
    found += compare("ATE, fins lost", faults, "ate", lambda row: row["fault"])
    for measure, value in (("inertial power", "inertial_w"), ("speed error", "mae")):
        found += compare(measure, tables.get("velocity", ()), value, _speed, ("learned-power", OURS))
    seeds = tables.get("seeds", [])
    for steps in dict.fromkeys(row["steps"] for row in seeds):
        rows = [row for row in seeds if row["steps"] == steps]
        measure = f"mean error of seeds, {steps} steps"
        found += compare(measure, rows, "err_norm_mean", _fins, ("network",), "seeds")
    return found


def _speed(row: Row) -> str:
    return "all speeds" if row["speed"] is None else f"{row['speed']:.2f} m/s"


def _fins(row: Row) -> str:
    return f"{row['fins']} fins"


def _cards(results: Results, tables: dict[str, list[Row]]) -> list[Card]:
    printed = paper_figures()["wrench_tracking"]
    cards = []
    for split, label in (("id", "mean error, layouts like those of training"), ("ood", "mean error, beyond")):
        row = next((row for row in tables.get(split, ()) if row["method"] == OURS), None)
        if row is None:
            continue
        theirs = printed[split]["ours"]["err_norm_mean"]
        cards.append(
            Card(
                error(row["err_norm_mean"]),
                f"{label} (`{split}`)",
                f"paper: {theirs:.4f}, {factor(theirs / row['err_norm_mean'])} times as much; "
                f"{share(row['success_0.01'])} within 0.01",
            )
        )
    ours = [row for row in results.energy_rows if (row["method"], row["fins"]) == (OURS, "all")]
    for row in (row for row in ours if row["energy_ratio"] is not None):
        cards.append(
            Card(
                f"{row['energy_ratio']:.3f}",
                "energy over the best of 32 IPOPT starts",
                f"reruns: {row['energy_ratio_low']:.3f} to {row['energy_ratio_high']:.3f}; "
                f"{row['resting']:.2f} fins rest on average",
            )
        )
    times = {row["method"]: row for row in results.tables.get("latency", ())}
    if OURS in times:
        mine = times[OURS]
        others = [f"`{n}` {three(times[n]['p50_ms'])}" for n in ("paper", "ipopt", "trf") if n in times]
        detail = f"99th percentile {three(mine['p99_ms'])}; {', '.join(others)} ms"
        cards.append(Card(f"{three(mine['p50_ms'])} ms", "one call, median, four fins", detail))
    swum = {r["method"]: r for r in results.tables.get("trajectory", ()) if r["layout"] == "all"}
    if OURS in swum:
        beside = paper_figures()["trajectory"]["all"]["ate"]
        detail = f"in our simulation; paper, in another: {100 * beside:.1f} cm"
        cards.append(Card(f"{100 * swum[OURS]['ate']:.1f} cm", "trajectory error, layouts A to D", detail))
    return cards
