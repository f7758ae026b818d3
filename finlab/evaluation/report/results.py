"""What the jobs of a plan gave, as the sections want it."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import numpy as np

from finlab.arrays import AnyArray
from finlab.evaluation.experiments.ablation import variant_rows
from finlab.evaluation.experiments.temperature import temperature_row
from finlab.evaluation.experiments.training_study import training_row
from finlab.evaluation.plots.closed_loop_experiments import Track
from finlab.evaluation.report.jobs import Job, rows_of_columns
from finlab.evaluation.report.plan import Plan
from finlab.evaluation.report.work import tracks_of_columns
from finlab.evaluation.splits import SPLITS
from finlab.evaluation.statistics.records import Columns, Records, records_of_columns
from finlab.evaluation.statistics.tables import Row, wrench_intervals, wrench_row


def _wrench_rows(split: str, method: str, columns: Columns) -> list[Row]:
    records = records_of_columns(columns)
    ends = {f"{name}_interval": list(ends) for name, ends in wrench_intervals(records).items()}
    return [wrench_row(records, split=split, method=method) | ends]


ROWS: dict[str, Callable[..., list[Row]]] = {
    "wrench": _wrench_rows,
    "rerun": _wrench_rows,
    "ablation": variant_rows,
    "temperature": lambda *made: [temperature_row(*made)],
    "training": lambda *made: [training_row(*made)],
}
"""Table -> its rows, from what is in a job's key and its arrays; the other tables come finished."""


class Results:
    """Records and rows by table; everything is computed from the files of the jobs.

    Args:
        plan: the jobs.
        folder: their results.
    """

    def __init__(self, plan: Plan, folder: Path) -> None:
        self.plan, self.folder = plan, folder

    def columns(self, job: Job) -> Columns:
        """The arrays of a job."""
        return job.result(self.folder)[0]

    @cached_property
    def tables(self) -> dict[str, list[Row]]:
        """Rows by table, with intervals under `<column>_interval`; tables without any are missing."""
        found: dict[str, list[Row]] = {}
        for table, jobs in self.plan.tables.items():
            for key, job in jobs.items():
                columns = self.columns(job)
                if table != "scatter":
                    rows = ROWS[table](*key, columns) if table in ROWS else rows_of_columns(columns)
                    found.setdefault(table, []).extend(rows)
        return found

    @cached_property
    def wrench(self) -> dict[str, dict[str, Records]]:
        """Split -> method -> records; splits without any are missing."""
        found: dict[str, dict[str, Records]] = {}
        for (split, method), job in self.plan.tables.get("wrench", {}).items():
            found.setdefault(split, {})[method] = records_of_columns(self.columns(job))
        return {split: found[split] for split in SPLITS if split in found}

    @cached_property
    def tracks(self) -> list[Track]:
        """Paths of the trajectory experiment."""
        return tracks_of_columns(self.columns(self.plan.tables["trajectory"][()]))

    @cached_property
    def scatter(self) -> dict[str, AnyArray]:
        """Candidates of the middle one of the drawn targets, before and after refinement."""
        columns = self.columns(self.plan.tables["scatter"][()])
        chosen = columns["target"] == int(np.median(np.unique(columns["target"])))
        return {name: values[chosen] for name, values in columns.items()}
