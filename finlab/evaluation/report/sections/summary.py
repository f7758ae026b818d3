"""The first screen: a few numbers, and in which measures and cases each method leads, by their intervals."""

from finlab.evaluation.experiments.cost import OBJECTIVES
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.report.document import Block, Card, Column, Fold, Row, Table
from finlab.evaluation.report.numbers import error, factor, share, three
from finlab.evaluation.report.plan import N_STARTS
from finlab.evaluation.report.results import Results
from finlab.evaluation.report.verdicts import LEADS, LEVEL, TRAILS, compare, standings, with_printed

OURS = "search"
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
            "The default method, `search`, against every other one. One leads where the intervals in which "
            "reruns would land do not overlap; a single run has none and no verdict. Figures that the paper "
            "prints count as exact. All methods but `paper` know each fin's own model; `search` needs no "
            "network and no training."
        ),
        Table(STANDINGS, standings(found)),
        Fold("Every comparison, with its values", (Table(COMPARISONS, found),)),
    ]


def comparisons(results: Results) -> list[Row]:
    """Every table's rows against those of the default method."""
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
    for objective in OBJECTIVES:
        costs = [row for row in results.cost_rows if row["objective"] == objective and row["fins"] == "all"]
        found += compare(objective, costs, "cost_ratio", lambda row: f"split {row['split']}")
    found += compare("time per call", tables.get("latency", ()), "p50_ms", "4 fins")
    found += compare("ATE", tables.get("trajectory", ()), "ate", lambda row: f"layouts {row['layout']}")
    faults = [row for row in tables.get("faults", ()) if row["controllable"]]
    found += compare("ATE, fins lost", faults, "ate", lambda row: row["fault"])
    for measure, value in (("inertial power", "inertial_w"), ("speed error", "mae")):
        found += compare(measure, tables.get("velocity", ()), value, _speed, (OURS, "search-effort"))
    return found


def _speed(row: Row) -> str:
    return "all speeds" if row["speed"] is None else f"{row['speed']:.2f} m/s"


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
    ours = [row for row in results.cost_rows if (row["method"], row["fins"]) == (OURS, "all")]
    for row in (row for row in ours if row["split"] == "id" and row["cost_ratio"] is not None):
        low, high = row["cost_ratio_interval"]
        detail = f"reruns: {low:.3f} to {high:.3f}; worst target {row['ratio_max']:.3f}"
        label = f"{row['objective']} over the best of {N_STARTS} IPOPT starts (`id`)"
        cards.append(Card(f"{row['cost_ratio']:.3f}", label, detail))
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
