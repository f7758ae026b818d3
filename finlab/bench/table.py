"""Results of the benchmark as text: one line for each method, and what failed."""

from collections.abc import Sequence
from typing import Any

from finlab.evaluation.report.numbers import FORMATS
from finlab.evaluation.statistics.tables import aligned

Row = dict[str, Any]
COLUMNS = {
    "failed": ("failed", "share"),
    "solved": ("solved", "share"),
    "error": ("error", "error"),
    "error_max": ("worst", "error"),
    "beyond": ("beyond", "error"),
    "power": ("power", "ratio"),
    "effort": ("effort", "ratio"),
    "turn": ("turn [rad]", "three"),
    "p50_ms": ("p50 [ms]", "three"),
    "p99_ms": ("p99 [ms]", "three"),
}
"""Key of a summary -> title, and how its values are shown."""
LEGEND = """\
failed: calls without a valid answer. solved: targets met within 1 % of what was asked, out of reach of the
best possible. error, worst: mean and largest relative error within reach. beyond: mean relative error beyond
the unavoidable, out of reach. power, effort: mean ratio to the cheapest exact command known, where the target
is met to 0.1 %. turn: mean change of zero direction per tick on noisy paths. p50, p99: time of a call."""


def text(found: Row, stored: Row | None) -> str:
    """What a terminal shows: the methods of a run, stored ones that it did not run, and what failed."""
    named = [row["method"] for row in found["methods"]]
    kept = [row for row in stored["methods"] if row["method"] not in named] if stored else []
    lines = cells([*found["methods"], *kept])
    parts = [
        aligned(
            ["method", *(title for title, _ in COLUMNS.values())], lines, [True, *[False] * len(COLUMNS)]
        ),
        LEGEND,
    ]
    if stored and kept:
        about = stored["machine"]
        parts.append(
            f"Stored, not of this run: {', '.join(row['method'] for row in kept)}; by\n{stored['command']}\n"
            f"on {about['processor']}, {about['cores']} cores."
        )
    failed = [
        f"{row['method']}: {count} calls failed ({kind}){_example(row, kind)}"
        for row in found["methods"]
        for kind, count in row["failures"].items()
    ]
    return "\n\n".join(parts + ["\n".join(failed)] * bool(failed))


def markdown(found: Row) -> str:
    """The table of stored results for the documentation."""
    head = ["method", *(title for title, _ in COLUMNS.values())]
    lines = [head, ["---"] * len(head), *cells(found["methods"])]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def cells(rows: Sequence[Row]) -> list[list[str]]:
    """Each method's name and summary as text; empty where there is nothing to tell."""
    return [[row["method"], *(_cell(row["summary"], key) for key in COLUMNS)] for row in rows]


def _cell(summary: Row, key: str) -> str:
    value = summary.get(key)
    return "" if value is None else FORMATS[COLUMNS[key][1]](value)


def _example(row: Row, kind: str) -> str:
    """What was seen of a kind of failure."""
    seen = [words.partition(": ")[2] for words in row["examples"] if words.startswith(f"{kind}: ")]
    return f": {seen[0]}" if seen else ""
