"""Two of the paper's experiments: several layouts follow a trajectory with one controller and one checkpoint;
a robot keeps a speed and a depth, for power and error of the speed."""

from collections.abc import Sequence

import numpy as np

from finlab.evaluation.experiments.closed_loop_runs import (
    LOST_M,
    RTE_DELTA_S,
    Row,
    Run,
    Scenario,
    depth_error,
    follow_row,
    power_row,
    rows_and_totals,
    shown_errors,
    spread,
)
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.statistics.tables import text_table
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


def trajectory_report(rows: Sequence[Row], trajectory: Trajectory, plant: str) -> str:
    """The table with the paper's beside it, and what was measured how."""
    paper = paper_figures()["trajectory"]
    shown = [_shown(row) for row in rows]
    shown += [
        {"layout": name, "method": "(printed in the paper)", **shown_errors(values)}
        for name, values in paper.items()
        if name in {row["layout"] for row in rows}
    ]
    return (
        f"{text_table(shown)}\n\n"
        f"Trajectory {trajectory.name}: {trajectory.length_m:.1f} m in {trajectory.duration_s:.0f} s; plant "
        f"{plant}. Errors over whole runs from rest, mean +- standard deviation over runs. Same world frame "
        f"and clock, no alignment; RTE over {RTE_DELTA_S:g} s, all pairs. The paper's trajectory and "
        "simulator are not described, so its figures stand beside ours, not against them."
    )


def _shown(row: Row) -> Row:
    """A row for people."""
    lost = "" if row["max"] < LOST_M else "lost"
    power = {"inertial [W]": f"{row['inertial_w']:.2f}", "torque [W]": f"{row['torque_w']:.2f}"}
    return {"layout": row["layout"], "method": row["method"], **shown_errors(row), **power, "": lost}


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
    printed = [
        {
            "method": f"{name} (printed in the paper)",
            "power [W]": spread(values, "inertial_w", 2),
            "MAE [m/s]": spread(values, "mae"),
        }
        for name, values in paper_figures()["velocity"].items()
    ]
    return (
        f"{text_table(shown)}\n\nLayout {layout.name}, runs from rest, plant {plant}. Inertial power is the "
        "paper's sum of |I alpha omega|; torque power adds the water that fins carry and their drag.\n\n"
        f"{text_table(printed)}"
    )
