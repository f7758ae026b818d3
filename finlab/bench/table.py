"""Results of the benchmark as text: one line for each method, and what failed."""

from collections.abc import Sequence

from finlab.evaluation.report.document import Column, Row, Table
from finlab.evaluation.report.text import to_text

COLUMNS = (
    Column("method", "method"),
    Column("failed", "failed", "share"),
    Column("solved", "solved", "share"),
    Column("error", "error", "error"),
    Column("error_max", "worst", "error"),
    Column("beyond", "beyond", "error"),
    Column("power", "power", "ratio"),
    Column("effort", "effort", "ratio"),
    Column("turn", "turn", "three", unit="rad"),
    Column("p50_ms", "p50", "three", unit="ms"),
    Column("p99_ms", "p99", "three", unit="ms"),
)
LEGEND = (
    "failed: calls without a valid answer. solved: targets met within 1 % of what was asked, out of reach of "
    "the best possible. error, worst: mean and largest relative error within reach. beyond: mean relative "
    "error beyond the unavoidable, out of reach. power, effort: mean ratio to the cheapest exact command "
    "known, where the target is met to 0.1 %. turn: mean change of zero direction per tick on noisy paths. "
    "p50, p99: time of a call."
)


def text(found: Row, beside: Row | None) -> str:
    """What a terminal shows: the methods of a run, stored ones that it did not run, and what failed."""
    named = [row["method"] for row in found["methods"]]
    kept = [row for row in beside["methods"] if row["method"] not in named] if beside else []
    blocks: list[str | Table] = [table([*found["methods"], *kept]), LEGEND]
    if beside and kept:
        about, names = beside["machine"], ", ".join(row["method"] for row in kept)
        where = f"{about['processor']}, {about['cores']} cores"
        blocks.append(f"Stored, not of this run: {names}; by {beside['command']} on {where}.")
    blocks += [
        f"{row['method']}: {count} calls failed ({kind}){_example(row, kind)}"
        for row in found["methods"]
        for kind, count in row["failures"].items()
    ]
    return to_text(*blocks)


def table(rows: Sequence[Row]) -> Table:
    """Name and summary of each method."""
    return Table(COLUMNS, [{"method": row["method"], **row["summary"]} for row in rows])


def _example(row: Row, kind: str) -> str:
    """What was seen of a kind of failure."""
    seen = [words.partition(": ")[2] for words in row["examples"] if words.startswith(f"{kind}: ")]
    return f": {seen[0]}" if seen else ""
