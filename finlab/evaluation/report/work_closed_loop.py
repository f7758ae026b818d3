"""What the closed-loop jobs do: the rows of each of the three experiments, and the paths that were swum."""

from __future__ import annotations

import numpy as np

from finlab.evaluation.plots.closed_loop_experiments import Track
from finlab.evaluation.statistics.store import Columns, columns_of_rows

TRACK = "track "
"""Leads the name of a column of time, position and reference (K, 7); layout and method follow."""
PAPER_LAYOUTS = ("A", "B", "C", "D")
"""The paper's robots."""


def trajectory(*, methods: str, runs: int, seed: int, checkpoint: str | None) -> Columns:
    """Rows of the trajectory experiment, and one path on each layout, five points a second."""
    from finlab.evaluation.experiments.trajectory import run_trajectory, trajectory_rows
    from finlab.evaluation.method_specs import load_method_specs
    from finlab.layout import load_layout
    from finlab.sim import make_trajectory

    robots = [load_layout(name) for name in PAPER_LAYOUTS]
    allocators = load_method_specs(methods, checkpoint)
    found = run_trajectory(robots, allocators, make_trajectory("lissajous"), range(seed, seed + runs), "mean")
    columns = columns_of_rows(trajectory_rows(found))
    for (layout, method), log in found:
        step = max(1, round(0.2 / float(log.time[1] - log.time[0])))
        track = np.column_stack([log.time, log.position, log.reference])
        columns.setdefault(f"{TRACK}{layout} {method}", track[::step])
    return columns


def tracks_of_columns(columns: Columns) -> list[Track]:
    """The paths that `trajectory` kept."""
    tracks = []
    for name, track in columns.items():
        if name.startswith(TRACK):
            layout, method = name.removeprefix(TRACK).split(" ", 1)
            tracks.append(Track(layout, method, track[:, 0], track[:, 1:4], track[:, 4:]))
    return tracks


def faults(*, methods: str, runs: int, pairs: bool, seed: int, checkpoint: str | None) -> Columns:
    """Rows of the fault experiment on layout A."""
    from finlab.evaluation.experiments.faults import all_faults, fault_rows, run_faults
    from finlab.evaluation.method_specs import load_method_specs
    from finlab.layout import load_layout
    from finlab.sim import make_trajectory

    robot, path = load_layout("A"), make_trajectory("circle")
    cases = [c for c in all_faults(robot, path.duration_s / 2) if pairs or len(c.fins) < 2]
    seeds = range(seed, seed + runs)
    found = run_faults(robot, load_method_specs(methods, checkpoint), path, cases, seeds, "mean")
    return columns_of_rows(fault_rows(cases, found))


def velocity(*, methods: str, runs: int, seed: int, checkpoint: str | None) -> Columns:
    """Rows of the velocity experiment on layout A."""
    from finlab.evaluation.experiments.velocity import run_velocity, velocity_rows
    from finlab.evaluation.method_specs import load_method_specs
    from finlab.layout import load_layout

    robot, seeds = load_layout("A"), range(seed, seed + runs)
    return columns_of_rows(velocity_rows(run_velocity(robot, load_method_specs(methods, checkpoint), seeds)))
