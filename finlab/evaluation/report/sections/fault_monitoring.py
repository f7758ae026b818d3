"""Un-announced losses: how soon and how surely a monitor finds them, in a table."""

from collections.abc import Sequence

from finlab.evaluation.experiments.fault_monitoring import CURRENT_M_S, FOUND_WITHIN_S, GOALS, PUSHES_N
from finlab.evaluation.report.document import Block, Column, Row, Table

COLUMNS = (
    Column("layout", "layout"),
    Column("servos", "servos"),
    Column("losses", "losses", "count"),
    Column("found", f"found within {FOUND_WITHIN_S:g} s", "share"),
    Column("pushing", "pushing fins", "count"),
    Column("found_pushing", "of them found", "share"),
    Column("right", "right fin", "share"),
    Column("found_s", "found after [s]", "three"),
    Column("hours", "whole [h]", "three"),
    Column("false_alarms", "false alarms", "count"),
    Column("ate", "ATE [m]", "metres"),
    Column("ate_ratio", "over announced", "ratio"),
    Column("tick_ms", "per tick [ms]", "three"),
)


def monitoring_blocks(rows: Sequence[Row]) -> list[Block]:
    """Layouts and all of them together, and what was aimed at beside what came out."""
    return [
        "### Fins lost without a word",
        Table(COLUMNS, rows),
        (
            f"*A random moment, a steady current of up to {CURRENT_M_S:g} m/s, noisy sensors. Pushing fins "
            f"are commanded to give at least {PUSHES_N:g} N from their loss until they are found, or for "
            f"{FOUND_WITHIN_S:g} s; the others all but rest. Right fin: of all losses that were found. Per "
            "tick: processor's time of the monitor.*"
        ),
        *_verdicts(rows),
    ]


def _verdicts(rows: Sequence[Row]) -> list[str]:
    """One sentence for every way to swim: which goals are met."""
    sentences = []
    for row in rows:
        if row["layout"] != "all":
            continue
        words = []
        for key, (title, goal) in GOALS.items():
            at_least = key in ("found", "right")
            met = row[key] is not None and (row[key] >= goal if at_least else row[key] <= goal)
            shown = "-" if row[key] is None else f"{row[key]:.3f}"
            sign = "at least" if at_least else "at most"
            words.append(f"{title} {shown} ({'meets' if met else 'misses'} {sign} {goal:g})")
        sentences.append(f"Servos {row['servos']}: {'; '.join(words)}.")
    return sentences
