"""The first screen: a few numbers, and in which measures and cases each method leads, by their intervals."""

from collections.abc import Mapping, Sequence

from finlab.evaluation.experiments.cost import OBJECTIVES
from finlab.evaluation.experiments.swims import TITLES, Swim, swim_rows
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.report.document import Block, Card, Column, Fold, Row, Table
from finlab.evaluation.report.numbers import error, share, three
from finlab.evaluation.report.plan import N_STARTS
from finlab.evaluation.report.verdicts import LEADS, LEVEL, TRAILS, compare, standings, with_printed

Tables = Mapping[str, Sequence[Row]]
"""Rows by table; those that have not run are missing."""
OURS = "search"
MINIMIZERS = ("search", "mdn", "sqp")
"""Methods that keep the cost least by which they are compared."""
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
    Column("ours", "its value", "near", "our_interval"),
    Column("against", "against", "code"),
    Column("theirs", "the other's", "near", "their_interval"),
    Column("verdict", "it"),
)


def summary_blocks(tables: Tables) -> list[Block]:
    """Cards, who leads where, and every comparison behind it."""
    found = comparisons(tables)
    return [
        tuple(_cards(tables)),
        "## Who leads",
        (
            "The default method, `search`, against every other one. One leads where the intervals in which "
            "reruns should land do not overlap; a single run has none and no verdict. Figures that the paper "
            "prints count as exact; rows against `paper (printed)` compare with other robots, targets and "
            "scoring, take its ablation for J_norm, and are no verdict on the paper. Mean errors below 1e-5 "
            "say where a method stops refining, not whether it delivers the wrench. Costs of answers are "
            "compared only with methods that keep the same cost least. The watts of the hard days are "
            "compared with two pseudo-inverses that do not: `analytic` takes the cheapest command of each "
            "fin's force, `on-board` beats at a fixed frequency. The hard days' own tables compare swim with "
            "swim under the same noise, and so tell apart what is too close here. `search` needs no network "
            "and no training."
        ),
        Table(STANDINGS, standings(found)),
        Fold("Every comparison, with its values", (Table(COMPARISONS, found),)),
    ]


def comparisons(tables: Tables) -> list[Row]:
    """Every table's rows against those of the default method."""
    printed, wrench = paper_figures(), tables.get("wrench", ())
    found: list[Row] = []
    for split in dict.fromkeys(row["split"] for row in wrench):
        rows = [row for row in wrench if row["split"] == split]
        theirs = printed["wrench_tracking"].get(split, {})
        means = {"paper (printed)": theirs["ours"]["err_norm_mean"]} if theirs else {}
        beside = with_printed(rows, "err_norm_mean", means)
        found += compare("mean error", beside, "err_norm_mean", split)
    for row in tables.get("ablation", ()):
        if (row["variant"], row["refinement"]) == ("ours", "adam"):
            means = {"paper (printed)": printed["ablation"]["ours"]["err_norm_mean"]}
            beside = with_printed([{**row, "method": "paper"}], "j_norm_mean", means)
            where = f"ablation by the {row['scored_by']}"
            found += compare("J_norm", beside, "j_norm_mean", where, ("paper",))
    for objective in OBJECTIVES:
        costs = [
            row
            for row in tables.get("cost", ())
            if row["objective"] == objective and row["fins"] == "all" and row["method"] in MINIMIZERS
        ]
        found += compare(objective, costs, "cost_ratio", lambda row: f"split {row['split']}")
    found += compare("time per call", tables.get("latency", ()), "p50_ms", "4 fins")
    found += compare("ATE", tables.get("trajectory", ()), "ate", lambda row: f"layouts {row['layout']}")
    faults = [row for row in tables.get("faults", ()) if row["controllable"]]
    found += compare("ATE, fins lost", faults, "ate", lambda row: row["fault"])
    days = swim_rows([Swim(**swim) for name in ("swims", "slow_swims") for swim in tables.get(name, ())])
    for value, title in TITLES.items():
        found += compare(f"{title}, hard days", days, value, lambda row: row["scenario"])
    found += compare("speed error", tables.get("velocity", ()), "mae", _speed, (OURS, "search-effort"))
    return found


def _speed(row: Row) -> str:
    return "all speeds" if row["speed"] is None else f"{row['speed']:.2f} m/s"


def _cards(tables: Tables) -> list[Card]:
    printed = paper_figures()["wrench_tracking"]
    cards = []
    mine = [row for row in tables.get("wrench", ()) if row["method"] == OURS and row["split"] in printed]
    for row in mine:
        theirs = printed[row["split"]]["ours"]["err_norm_mean"]
        detail = f"{share(row['success_0.01'])} within 0.01; the paper, with learned physics: {theirs:.4f}"
        cards.append(Card(error(row["err_norm_mean"]), f"mean error, split `{row['split']}`", detail))
    ours = [row for row in tables.get("cost", ()) if (row["method"], row["fins"]) == (OURS, "all")]
    for row in (row for row in ours if row["split"] == "id" and row["cost_ratio"] is not None):
        low, high = row["cost_ratio_interval"]
        detail = f"reruns: {low:.3f} to {high:.3f}; worst target {row['ratio_max']:.3f}"
        label = f"{row['objective']} over the best of {N_STARTS} IPOPT starts (`id`)"
        cards.append(Card(f"{row['cost_ratio']:.3f}", label, detail))
    times = {row["method"]: row for row in tables.get("latency", ())}
    if OURS in times:
        own = times[OURS]
        others = [f"`{n}` {three(times[n]['p50_ms'])}" for n in ("paper", "ipopt", "trf") if n in times]
        detail = f"99th percentile {three(own['p99_ms'])}; {', '.join(others)} ms"
        cards.append(Card(f"{three(own['p50_ms'])} ms", "one call, median, four fins", detail))
    swum = {r["method"]: r for r in tables.get("trajectory", ()) if r["layout"] == "all"}
    if OURS in swum:
        beside = paper_figures()["trajectory"]["all"]["ate"]
        detail = f"in our simulation; paper, in another: {100 * beside:.1f} cm"
        cards.append(Card(f"{100 * swum[OURS]['ate']:.1f} cm", "trajectory error, layouts A to D", detail))
    return cards
