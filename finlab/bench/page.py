"""Results as tables for the terminal and as a page."""

from collections.abc import Sequence
from typing import Any

from finlab.bench.pictures import profile_and_times
from finlab.bench.problems import KINDS, Problems
from finlab.evaluation.report.document import Block, Card, Column, Document, Figure, Fold, Row, Table
from finlab.evaluation.report.numbers import FORMATS, error, share, three

MAIN = (
    Column("method", "method", "code"),
    Column("failed", "failed", "share"),
    Column("solved", "solved", "share"),
    Column("error", "error", "error"),
    Column("error_max", "worst", "error"),
    Column("beyond", "beyond", "error"),
    Column("power", "power", "ratio"),
    Column("effort", "effort", "ratio"),
    Column("turn", "turn [rad]", "three"),
    Column("p50_ms", "p50 [ms]", "three"),
    Column("p99_ms", "p99 [ms]", "three"),
)
LEGEND = (
    "*failed: calls without a valid answer. solved: targets met within 1 % of what was asked, out of reach "
    "of the best possible. error, worst: mean and largest relative error within reach. beyond: mean relative "
    "error beyond the unavoidable, out of reach. power, effort: mean ratio to the cheapest exact "
    "command known, where the target is met to 0.1 %. turn: mean change of zero direction per tick on noisy "
    "paths. p50, p99: time of a call.*"
)
PATH = (
    Column("method", "method", "code"),
    Column("path", "path"),
    Column("solved", "ticks met", "share"),
    Column("error", "error", "error"),
    Column("amplitude", "change of A [rad]", "error"),
    Column("frequency", "of f [Hz]", "error"),
    Column("turn", "of phi [rad]", "error"),
    Column("amplitude_max", "largest: A [rad]", "error"),
    Column("frequency_max", "f [Hz]", "error"),
    Column("turn_max", "phi [rad]", "error"),
)
FAILED = (
    Column("method", "method", "code"),
    Column("kind", "failure"),
    Column("calls", "calls", "count"),
    Column("seen", "seen"),
)
SETS = {
    "paper": "the paper's layouts A to D",
    "shipped": "other shipped layouts",
    "id": "2 to 5 fins in the paper's box",
    "ood": "fins out to 0.45 m",
    "ood-fins": "6 to 8 fins",
    "limits": "limits of each fin's own, arcs",
    "failure": "one or two fins lost",
    "near-singular": "nearly parallel or coincident fins",
    "fins": "fins of one random law",
    "fins-mixed": "each fin of a law of its own",
    "tables": "fins known by noisy tables",
    "many-fins": "9 to 12 fins",
    "big": "robots of 3 m",
    "tiny": "robots of 5 cm",
}
WHERE = {
    "inside": "wrenches of random commands",
    "boundary": "the most in a direction",
    "beyond-1.2": "1.2 times as far",
    "beyond-2": "twice as far",
    "beyond-3": "three times as far",
}


def rows_of(found: dict[str, Any], stored: dict[str, Any] | None) -> list[Row]:
    """Methods that were run, then those of the stored results that were not, each kind marked."""
    named = {row["method"] for row in found["methods"]}
    kept = [] if stored is None else [row for row in stored["methods"] if row["method"] not in named]
    own = {"_kind": "ours"} if kept else {}
    return [{**row, **own} for row in found["methods"]] + [{**row, "_kind": "printed"} for row in kept]


def summary_blocks(rows: Sequence[Row], stored: dict[str, Any] | None) -> list[Block]:
    """What a terminal shows."""
    flat = [{**_head(row), **row["summary"]} for row in rows]
    blocks: list[Block] = [Table(MAIN, flat), LEGEND]
    return blocks + _stored_remark(rows, stored) + _failures(rows)


def document(found: dict[str, Any], stored: dict[str, Any] | None, problems: Problems) -> Document:
    """The page."""
    rows = rows_of(found, stored)
    asked = rows[0]["summary"]
    size = "quick" if found["quick"] else "whole"
    return Document(
        "finlab bench",
        f"{asked['targets']:,} wrenches on {len(SETS)} sets of robots, "
        f"{asked['calls'] - asked['targets']:,} ticks along paths; {size} run, {found['made']}.",
        (
            _cards(rows[0]),
            "## Methods",
            *summary_blocks(rows, stored),
            Figure("bench", lambda: profile_and_times(rows), _CAPTION),
            "## By set of robots",
            "Share of targets solved, within reach and beyond.",
            _by("sets", "set", SETS, rows),
            "## By place of the target",
            "Share of targets solved; out of reach, met as well as possible.",
            _by("kinds", "target", WHERE, rows),
            "## From tick to tick",
            "Smooth paths at 10 Hz, and the same with noise of 2 % of each fin's largest force; a method is "
            "given its previous command. Changes are means, and the largest ones, over fins and ticks.",
            Table(PATH, _path_rows(rows)),
            "## How this was made",
            *_how(found, stored, problems),
        ),
    )


_CAPTION = (
    "Left: share of all targets whose relative error is at most so large; dashes at 1 %. Right: median "
    "(dot) to 99th percentile of single calls."
)


def _cards(row: Row) -> tuple[Card, ...]:
    summary = row["summary"]
    power = summary["power"]
    return (
        Card(share(summary["solved"]), "targets solved", f"method `{row['method']}`"),
        Card(
            error(summary["error"]),
            "mean relative error",
            f"within reach; worst {error(summary['error_max'])}",
        ),
        Card(
            "–" if power is None else FORMATS["ratio"](power),
            "power over the best known",
            f"{summary['compared']} targets",
        ),
        Card(
            f"{three(summary['p99_ms'] or 0.0)} ms",
            "99th percentile of a call",
            f"median {three(summary['p50_ms'] or 0.0)} ms",
        ),
    )


def _by(key: str, title: str, names: dict[str, str], rows: Sequence[Row]) -> Table:
    """Shares solved: a line for each name, a column for each method."""
    columns = [Column("name", title, "code"), Column("what", "")]
    for row in rows:  # a space where a long name may be broken
        columns.append(Column(row["method"], f"`{row['method'].replace(':', ': ')}`", "share"))
    lines = []
    for name, what in names.items():
        known = {row["method"]: row[key][name]["solved"] for row in rows if name in row[key]}
        lines.append({"name": name, "what": what, **known})
    return Table(tuple(columns), lines)


def _head(row: Row) -> Row:
    """What every row of a method begins with."""
    return {key: row[key] for key in ("method", "_kind") if key in row}


def _path_rows(rows: Sequence[Row]) -> list[Row]:
    return [{**_head(row), "path": name, **path} for row in rows for name, path in row["paths"].items()]


def _failures(rows: Sequence[Row]) -> list[Block]:
    lines = [
        {"method": row["method"], "kind": kind, "calls": count, "seen": _example(row, kind)}
        for row in rows
        if row.get("_kind") != "printed"
        for kind, count in row["failures"].items()
    ]
    return [Table(FAILED, lines)] if lines else []


def _example(row: Row, kind: str) -> str:
    """What was seen of a kind of failure."""
    seen = [words.partition(": ")[2] for words in row["examples"] if words.startswith(f"{kind}: ")]
    return seen[0] if seen else ""


def _stored_remark(rows: Sequence[Row], stored: dict[str, Any] | None) -> list[Block]:
    """Which rows are not of this run."""
    kept = ", ".join(f"`{row['method']}`" for row in rows if row.get("_kind") == "printed")
    if stored is None or not kept:
        return []
    machine = stored["machine"]
    where = f"{machine['processor']}, {machine['cores']} cores"
    return [f"*Not of this run but stored: {kept}, by `{stored['command']}` on {where}.*"]


def _how(found: dict[str, Any], stored: dict[str, Any] | None, problems: Problems) -> list[Block]:
    def told(run: dict[str, Any]) -> str:
        machine = ", ".join(f"{key} {value}" for key, value in run["machine"].items())
        how = "all targets of a robot in one call" if run["together"] else "one target per call"
        limit = f"{how}, time limit {run['limit_s']:g} s per target"
        made = f"- Commit `{run['commit']}`, {run['made']}\n- Machine: {machine}"
        return f"- Command: `{run['command']}` ({limit})\n{made}"

    yardsticks = "\n".join(f"- {name}: {how}" for name, how in problems.about.get("yardsticks", {}).items())
    return [
        told(found),
        f"Problems: seed {problems.about.get('seed')}, `{problems.checksum}`. Every command is judged by the "
        "fins' own laws, in another process than the method's; the first call for each robot is not timed.",
        *([Fold("How the stored results were made", (told(stored),))] if stored else []),
        Fold("How the yardsticks were found", (yardsticks,)),
    ]


assert tuple(WHERE) == KINDS
