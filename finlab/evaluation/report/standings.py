"""Who leads: the default method against every other one, case by case.

A method leads another only where their intervals, in which another seed lands, lie apart by more than
`LEVEL`.
"""

from collections.abc import Sequence

from finlab.evaluation.experiment import Experiment
from finlab.evaluation.report.document import Column, Row

OURS = "dual"
LEVEL = 1e-5
"""Differences up to this are the solvers' rounding: normalized errors, ratios of costs, metres or watts."""
COLUMNS = (
    Column("experiment", "experiment", "code"),
    Column("measure", "less is better"),
    Column("against", "`dual` against", "code"),
    Column("cases", "cases", "count"),
    Column("leads", "leads", "count"),
    Column("level", "intervals overlap", "count"),
    Column("trails", "trails", "count"),
)


def standings(experiment: Experiment, rows: Sequence[Row]) -> list[Row]:
    """One row for each measure of the experiment and each other method.

    Rows of one case differ in their method and in numbers alone; those without an interval do not count.
    """
    about = [c.key for c in experiment.columns if not c.is_number and c.key != "method"]
    titles = {column.key: column.title for column in experiment.columns}
    found: list[Row] = []
    for measure in experiment.less_is_better:
        ends = {
            (row["method"], tuple(row.get(key) for key in about)): row[f"{measure}_interval"]
            for row in rows
            if row.get(f"{measure}_interval") is not None
        }
        others = dict.fromkeys(method for method, _ in ends if method != OURS)
        for other in others:
            pairs = [
                (ends[OURS, case], e) for (m, case), e in ends.items() if m == other and (OURS, case) in ends
            ]
            leads = sum(mine[1] < theirs[0] - LEVEL for mine, theirs in pairs)
            trails = sum(theirs[1] < mine[0] - LEVEL for mine, theirs in pairs)
            row: Row = {"experiment": experiment.name, "measure": titles[measure], "against": other}
            counts = {
                "cases": len(pairs),
                "leads": leads,
                "level": len(pairs) - leads - trails,
                "trails": trails,
            }
            found += [row | counts] if pairs else []
    return found
