"""Wrench tracking on every split, beside the paper's table."""

from collections.abc import Sequence

from finlab.evaluation.method_specs import is_slow
from finlab.evaluation.paper_figures import PAPER_METHODS, paper_figures
from finlab.evaluation.plots.style import COLOURS
from finlab.evaluation.plots.wrench_tracking import error_by_fins, error_distribution
from finlab.evaluation.report.document import Block, Column, Figure, Fold, Row, Table, method_row, printed_row
from finlab.evaluation.report.results import Results
from finlab.evaluation.statistics.records import Records, join_records

ORDER = tuple(COLOURS)
"""Methods from top to bottom."""
SPLIT_WORDS = {
    "id": "2 to 5 fins within 0.30 m, nominal limits, as half of what `paper` was trained on",
    "ood": "fins out to 0.45 m, at least one beyond what `paper` was trained on",
    "ood-fins": "6 to 8 fins; method `paper` was trained on 2 to 5",
    "limits": "each fin with limits of its own, a third of them with an arc of directions",
    "failure": "one or two fins lost",
    "near-singular": "nearly parallel shafts, or two fins nearly at one place",
    "fins": "as id, all fins of a robot of one random model (drag, lighthill or soft)",
    "fins-mixed": "as id, each fin of a random model of its own",
    "tables": "the same, the fins being tables with 3 % noise, which score, too",
    "many-fins": "9 to 12 fins",
    "perturbed": "the paper's A to D, fins moved by up to 2 cm and turned by up to 20 degrees",
    "parallel": "all shafts along one direction, or against it",
    "collinear": "all fins on one line",
    "clustered": "all fins within 3 cm of one place along each axis",
    "coincident": "two fins at one place, shafts along or against each other",
    "stacked": "pairs of fins one above the other",
    "big": "fins out to 3 m, blades ten times as long at a tenth of the frequency",
    "tiny": "fins out to 5 cm, blades a sixth as long",
}
PRINTED = {"ours": "paper's method, printed", "qp": "QP, printed", "sqp": "SQP, printed"}

COLUMNS = (
    Column("method", "method"),
    Column("n", "targets", "count"),
    Column("err_norm_mean", "mean error", "error", "err_norm_mean_interval"),
    Column("rerun_mean", "rerun", "error", "rerun_interval"),
    Column("err_norm_median", "median", "error"),
    Column("err_norm_p95", "95th percentile", "error", "err_norm_p95_interval"),
    Column("err_norm_max", "largest", "error"),
    Column("err_phys_mean", "mean, N and N m", "error"),
    Column("success_0.01", "within 0.01", "share", "success_0.01_interval"),
    Column("success_0.5", "within 0.5", "share"),
    Column("success_1.0", "within 1.0", "share"),
    Column("power_mean", "mean power [W]", "three", "power_mean_interval"),
    Column("energy_mean", "mean effort", "three", "energy_mean_interval"),
    Column("solve_ms_p50", "ms per target", "error"),
)


def accuracy_blocks(results: Results) -> list[Block]:
    """The whole section."""
    printed = paper_figures()["wrench_tracking"]
    shown = {split: _quick(results.wrench[split]) for split in printed if split in results.wrench}
    blocks: list[Block] = [
        "## Wrench tracking",
        (
            "Every method answers wrenches that the robot can deliver, on layouts and fins that no training "
            "has seen. The error is the distance between asked and delivered wrench in standard deviations "
            "of the wrenches of random layouts of 2 to 5 of U-CAT's fins; on `fins`, `fins-mixed`, `tables`, "
            "`big` and `tiny` of the robot's own, so that it is relative to what the robot can do. The fins' "
            "own models score every method. `paper` takes every fin for one of the law `drag` with U-CAT's "
            "numbers, so on those five splits its errors show that it does not know the fins; all other "
            "methods were given them. Printed rows are for the paper's own layouts and targets, which it "
            "describes no further. Its normalized error of wrench tracking has no equation; it is read as "
            "the root of J_norm, as its ratio to the physical error (1.2 for all methods) suggests. Its SQP "
            "linearizes the learned surrogate by default, and solves for that error alone; `sqp` linearizes "
            "the law that scores it, from five starts, and keeps the power least as well: the printed row is "
            "no weaker run of ours. Rerun: the mean error with another seed and fewer targets."
        ),
        Figure(
            "error-distribution",
            lambda: error_distribution(
                shown, {split: printed[split]["ours"]["err_norm_mean"] for split in shown}
            ),
            "How large errors are: the further left and the steeper a curve falls, the better. Errors below "
            "1e-8 are drawn at 1e-8. Dashes: the mean error that the paper prints for its method.",
        ),
        Figure(
            "error-by-fins",
            lambda: error_by_fins(_by_fins(results), ORDER),
            "The error by number of working fins, after the paper's figure B, which has layouts ID and OOD "
            "of 2 to 5; here splits `id` (2 to 5) and `ood-fins` (6 to 8). Dots are means, bars reach from "
            "median to 95th percentile; less than 1e-8 is drawn at 1e-8.",
        ),
    ]
    for split in results.wrench:
        rows = [row for row in results.tables["wrench"] if row["split"] == split]
        rows = with_reruns(rows, results.tables.get("rerun", ()))
        table = Table(COLUMNS, wrench_table(rows, split))
        title = f"Split {split}: {SPLIT_WORDS[split]}"
        blocks += [f"### {title}", table] if split in printed else [Fold(title, (table,))]
    blocks.append(
        "*Small print below a number: where a rerun with another seed should land, 95 times of 100 "
        "(bootstrap over layouts). ms per target: all targets of a layout are solved together, and other "
        "parts of the report run beside it. `paper`, `multistart`, `sqp`, `trf`, `slsqp` and `ipopt`, which "
        "take long, solve the first targets of each layout only, the last three one by one, from 8 starts.*"
    )
    return blocks


def with_reruns(rows: Sequence[Row], reruns: Sequence[Row]) -> list[Row]:
    """Rows with the mean error of the same method and split under another seed beside their own."""
    found = {(again["split"], again["method"]): again for again in reruns}
    beside = [found.get((row["split"], row["method"]), {}) for row in rows]
    return [
        row
        | {
            "rerun_mean": again.get("err_norm_mean"),
            "rerun_interval": again.get("err_norm_mean_interval"),
        }
        for row, again in zip(rows, beside, strict=True)
    ]


def wrench_table(rows: Sequence[Row], split: str) -> list[Row]:
    """Rows in fixed order, the paper's after the method that each belongs to."""
    printed = paper_figures()["wrench_tracking"].get(split, {})
    shown: list[Row] = []
    for row in sorted(rows, key=lambda row: ORDER.index(row["method"])):
        shown.append(method_row(row))
        if (theirs := PAPER_METHODS.get(row["method"], "")) in printed:
            shown.append(printed_row(PRINTED[theirs], printed[theirs]))
    return shown


def _quick(methods: dict[str, Records]) -> dict[str, Records]:
    """Methods with enough targets for a curve, in order."""
    return {name: methods[name] for name in ORDER if name in methods and not is_slow(name)}


def _by_fins(results: Results) -> dict[str, Records]:
    """Records of both splits, for methods that ran on either."""
    parts = [results.wrench[split] for split in ("id", "ood-fins") if split in results.wrench]
    names = dict.fromkeys(name for part in parts for name in _quick(part))
    return {name: join_records([part[name] for part in parts if name in part]) for name in names}
