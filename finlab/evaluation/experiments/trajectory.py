"""The paper's trajectory experiment: one controller, one checkpoint, several layouts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from finlab.allocation.allocator import Allocator
from finlab.evaluation.experiments.closed_loop_runs import (
    LOST_M,
    Row,
    Run,
    Scenario,
    follow_row,
    rows_and_totals,
    run_all,
    spread,
)
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.statistics.tables import text_table
from finlab.evaluation.statistics.trajectory_errors import RTE_DELTA_S
from finlab.layout import Layout
from finlab.sim import Trajectory


def run_trajectory(
    layouts: Sequence[Layout],
    allocators: Mapping[str, Allocator],
    trajectory: Trajectory,
    seeds: Sequence[int],
    plant: str = "mean",
    *,
    steady: bool = False,
) -> list[Run]:
    """Every layout with every method and seed, as in `run_all`; each run under (layout's name, method)."""
    scenarios = [Scenario(layout.name, layout, trajectory) for layout in layouts]
    return run_all(scenarios, allocators, seeds, plant, steady=steady)


def trajectory_rows(runs: Sequence[Run]) -> list[Row]:
    """One row per layout and method, and one over all layouts: mean and spread over seeds."""
    return rows_and_totals(runs, follow_row, "layout", "all")


def trajectory_report(rows: Sequence[Row], trajectory: Trajectory, plant: str) -> str:
    """The table with the paper's beside it, and what was measured how."""
    paper = paper_figures()["trajectory"]
    shown = [_shown(row) for row in rows]
    shown += [
        {"layout": name, "method": "(printed in the paper)"}
        | {label: f"{values[key]:.3f}" for key, label in LABELS.items()}
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


LABELS = {"ate": "ATE [m]", "rte": "RTE [m]", "depth_rmse": "depth RMSE [m]"}
"""Keys of a row and how a table calls them."""


def _shown(row: Row) -> Row:
    """A row for people."""
    errors = {label: spread(row, key) for key, label in LABELS.items()}
    lost = "" if row["max"] < LOST_M else "lost"
    power = {"inertial [W]": f"{row['inertial_w']:.2f}", "torque [W]": f"{row['torque_w']:.2f}"}
    return {"layout": row["layout"], "method": row["method"], **errors, **power, "": lost}
