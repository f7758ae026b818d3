"""What the jobs of a plan gave, as the sections want it."""

from functools import cached_property
from pathlib import Path

import numpy as np

from finlab.arrays import AnyArray
from finlab.evaluation.experiments.ablation import variant_rows
from finlab.evaluation.experiments.temperature import temperature_row
from finlab.evaluation.experiments.training_study import training_row
from finlab.evaluation.report.jobs import Job, rows_of_columns
from finlab.evaluation.report.plan import Plan
from finlab.evaluation.splits import SPLITS
from finlab.evaluation.statistics.records import Columns, Records, records_of_columns
from finlab.evaluation.statistics.tables import Row, wrench_intervals, wrench_row


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
    def wrench(self) -> dict[str, dict[str, Records]]:
        """Split -> method -> records; splits without any are missing."""
        found: dict[str, dict[str, Records]] = {}
        for (split, method), job in self.plan.wrench.items():
            found.setdefault(split, {})[method] = records_of_columns(self.columns(job))
        return {split: found[split] for split in SPLITS if split in found}

    @cached_property
    def wrench_rows(self) -> dict[str, list[Row]]:
        """Split -> rows of the wrench table, with intervals under `<column>_interval`."""
        return {
            split: [
                {
                    **wrench_row(records, split=split, method=method),
                    **{f"{key}_interval": list(ends) for key, ends in wrench_intervals(records).items()},
                }
                for method, records in methods.items()
            ]
            for split, methods in self.wrench.items()
        }

    @cached_property
    def cost_rows(self) -> list[Row]:
        """Rows of the comparison of costs, of every set of cases and objective that has run."""
        return [row for job in self.plan.cost.values() for row in rows_of_columns(self.columns(job))]

    @cached_property
    def ablation_rows(self) -> list[Row]:
        """Each variant and refinement, scored by plant and surrogate."""
        jobs = self.plan.ablation.items()
        return [row for key, job in jobs for row in variant_rows(*key, self.columns(job))]

    @cached_property
    def temperature_rows(self) -> list[Row]:
        """One row per temperature."""
        return [temperature_row(value, self.columns(job)) for value, job in self.plan.temperature.items()]

    @cached_property
    def scatter(self) -> dict[str, AnyArray]:
        """Candidates of the middle one of the drawn targets, before and after refinement."""
        columns = self.columns(self.plan.scatter["paper"])
        chosen = columns["target"] == int(np.median(np.unique(columns["target"])))
        return {name: values[chosen] for name, values in columns.items()}

    @cached_property
    def tables(self) -> dict[str, list[Row]]:
        """Rows of the experiments whose results are finished tables; those that were left out are missing."""
        return {name: rows_of_columns(self.columns(job)) for name, job in self.plan.tables.items()}

    @cached_property
    def training_rows(self) -> list[Row]:
        """One row per small training."""
        return [training_row(name, self.columns(job)) for name, job in self.plan.training.items()]
