"""The first screen: four numbers, and where the learned allocator leads and where it does not."""

from __future__ import annotations

from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.report import claims
from finlab.evaluation.report.document import Block, Card, Cards, Row, TwoSides
from finlab.evaluation.report.numbers import error, factor, share, three
from finlab.evaluation.report.plan import REFERENCE
from finlab.evaluation.report.results import Results
from finlab.evaluation.report.sections.closed_loop import closed_loop_claims

NOTHING = ("Nowhere in the tables below.",)


def summary_blocks(results: Results) -> list[Block]:
    """Cards and both lists."""
    tables = results.wrench_rows
    found = _claims(results, tables)
    titles = ("Where the learned allocator leads", "Where it does not")
    sides = (found.leads or NOTHING, found.trails or NOTHING)
    return [Cards(tuple(_cards(results, tables))), TwoSides(titles, sides)]


def _claims(results: Results, tables: dict[str, list[Row]]) -> claims.Claims:
    printed = paper_figures()
    means = {split: rows["ours"]["err_norm_mean"] for split, rows in printed["wrench_tracking"].items()}
    whole = {
        row["scored_by"]: row["err_norm_mean"]
        for row in results.ablation_rows
        if (row["variant"], row["refinement"]) == ("ours", "adam")
    }
    return (
        claims.paper_claims(tables, means)
        + claims.accuracy_claims(tables)
        + claims.energy_claims(results.energy_rows, REFERENCE)
        + claims.latency_claims(results.latency_rows, printed["inference"]["cycle_s"] * 1e3)
        + closed_loop_claims(results.swim_rows)
        + claims.seed_claims(results.seed_rows)
        + claims.rebuild_claims(whole, printed["ablation"]["ours"]["err_norm_mean"])
    )


def _cards(results: Results, tables: dict[str, list[Row]]) -> list[Card]:
    printed = paper_figures()["wrench_tracking"]
    cards = []
    for split, label in (("id", "mean error, layouts like those of training"), ("ood", "mean error, beyond")):
        row = next((row for row in tables.get(split, ()) if row["method"] == claims.OURS), None)
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
    ours = [row for row in results.energy_rows if (row["method"], row["fins"]) == (claims.OURS, "all")]
    for row in (row for row in ours if row["energy_ratio"] is not None):
        cards.append(
            Card(
                f"{row['energy_ratio']:.3f}",
                "energy over the best of 32 IPOPT starts",
                f"reruns: {row['energy_ratio_low']:.3f} to {row['energy_ratio_high']:.3f}; "
                f"{row['resting']:.2f} fins rest on average",
            )
        )
    times = {row["method"]: row for row in results.latency_rows}
    if claims.OURS in times:
        mine = times[claims.OURS]
        others = [f"`{n}` {three(times[n]['p50_ms'])}" for n in ("paper", "ipopt", "trf") if n in times]
        detail = f"99th percentile {three(mine['p99_ms'])}; {', '.join(others)} ms"
        cards.append(Card(f"{three(mine['p50_ms'])} ms", "one call, median, four fins", detail))
    swum = {r["method"]: r for r in results.swim_rows.get("trajectory", ()) if r["layout"] == "all"}
    if claims.OURS in swum:
        beside = paper_figures()["trajectory"]["all"]["ate"]
        detail = f"in our simulation; paper, in another: {100 * beside:.1f} cm"
        cards.append(
            Card(f"{100 * swum[claims.OURS]['ate']:.1f} cm", "trajectory error, layouts A to D", detail)
        )
    return cards
