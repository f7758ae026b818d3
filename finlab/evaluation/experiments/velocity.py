"""The paper's velocity experiment: keep a speed and a depth; power and error of the speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.evaluation.experiments.closed_loop_runs import (
    Row,
    Run,
    Scenario,
    power_row,
    rows_and_totals,
    run_all,
    spread,
)
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.statistics.tables import text_table
from finlab.layout import Layout
from finlab.sim import Cruise, RunLog

SPEEDS = (0.10, 0.15, 0.20)
"""The paper's speeds [m/s]."""
SETTLED_S = 10.0
"""After this time the start from rest is over [s]."""


def run_velocity(
    layout: Layout,
    allocators: Mapping[str, Allocator],
    seeds: Sequence[int],
    speeds: Sequence[float] = SPEEDS,
    duration_s: float = 30.0,
    plant: str = "mean",
    *,
    steady: bool = False,
) -> list[Run]:
    """Every speed with every method and seed, as in `run_all`; each run under (speed, method)."""
    scenarios = [Scenario(speed, layout, Cruise(speed, duration_s=duration_s)) for speed in speeds]
    return run_all(scenarios, allocators, seeds, plant, steady=steady)


def velocity_rows(runs: Sequence[Run]) -> list[Row]:
    """One row per speed and method, and one over all speeds: mean and spread over runs."""
    return rows_and_totals(runs, _row, "speed", None)


def _row(log: RunLog) -> Row:
    """Errors of one run [m/s, m] and power [W]."""
    error = np.abs(log.motion[:, 0] - log.reference_surge)
    depth = log.position[:, 2] - log.reference[:, 2]
    return {
        "mae": float(error.mean()),
        "mae_settled": float(error[log.time >= SETTLED_S].mean()),
        "depth_rmse": float(np.sqrt(np.square(depth).mean())),
        **power_row(log),
    }


def velocity_report(rows: Sequence[Row], baseline: str, layout: Layout, plant: str) -> str:
    """The table, differences to the baseline, and the paper's."""
    reference = {row["speed"]: row for row in rows if row["method"] == baseline}
    shown = []
    for row in rows:
        line = {
            "method": row["method"],
            "speed [m/s]": "all" if row["speed"] is None else f"{row['speed']:.2f}",
            "inertial [W]": spread(row, "inertial_w"),
            "torque [W]": spread(row, "torque_w"),
            "MAE [m/s]": spread(row, "mae", 4),
            "MAE from 10 s": f"{row['mae_settled']:.4f}",
        }
        if row["speed"] in reference and row["method"] != baseline:
            other = reference[row["speed"]]
            for key, label in (("inertial_w", "inertial"), ("torque_w", "torque"), ("mae", "MAE")):
                line[f"{label} to {baseline}"] = f"{100 * (row[key] / other[key] - 1):+.1f} %"
        shown.append(line)
    paper = paper_figures()["velocity"]
    printed = [
        {
            "method": f"{name} (printed in the paper)",
            "power [W]": f"{values['inertial_w']:.2f} +- {values['inertial_w_std']:.2f}",
            "MAE [m/s]": f"{values['mae']:.3f} +- {values['mae_std']:.3f}",
        }
        for name, values in paper.items()
    ]
    return (
        f"{text_table(shown)}\n\nLayout {layout.name}, runs from rest, plant {plant}. Inertial power is the "
        "paper's sum of |I alpha omega|; torque power adds the water that fins carry and their drag.\n\n"
        f"{text_table(printed)}"
    )
