"""Two of the paper's experiments: several layouts follow a trajectory with one controller and one checkpoint;
a robot keeps a speed and a depth, for power and error of the speed."""

from collections.abc import Sequence

import numpy as np

from finlab.evaluation.experiments.closed_loop_runs import (
    Row,
    Run,
    Scenario,
    depth_error,
    follow_row,
    power_row,
    rows_and_totals,
)
from finlab.layout import Layout
from finlab.sim import Cruise, RunLog, Trajectory

SPEEDS = (0.10, 0.15, 0.20)
"""The paper's speeds [m/s]."""
SETTLED_S = 10.0
"""After this time the start from rest is over [s]."""


def trajectory_scenarios(layouts: Sequence[Layout], trajectory: Trajectory) -> list[Scenario]:
    """Every layout, under its name."""
    return [Scenario(layout.name, layout, trajectory) for layout in layouts]


def trajectory_rows(runs: Sequence[Run]) -> list[Row]:
    """One row per layout and method, and one over all layouts: mean and spread over seeds."""
    return rows_and_totals(runs, follow_row, "layout", "all")


def velocity_scenarios(
    layout: Layout, speeds: Sequence[float] = SPEEDS, duration_s: float = 30.0
) -> list[Scenario]:
    """Every speed, under its number [m/s]."""
    return [Scenario(speed, layout, Cruise(speed, duration_s=duration_s)) for speed in speeds]


def velocity_rows(runs: Sequence[Run]) -> list[Row]:
    """One row per speed and method, and one over all speeds: mean and spread over runs."""
    return rows_and_totals(runs, _row, "speed", None)


def _row(log: RunLog) -> Row:
    """Errors of one run [m/s, m] and power [W]."""
    error = np.abs(log.motion[:, 0] - log.reference_surge)
    return {
        "mae": float(error.mean()),
        "mae_settled": float(error[log.time >= SETTLED_S].mean()),
        "depth_rmse": depth_error(log.position, log.reference),
        **power_row(log),
    }
