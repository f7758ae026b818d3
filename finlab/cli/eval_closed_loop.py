"""`finlab eval trajectory|faults|velocity`: the paper's closed-loop experiments in simulation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from finlab.cli.eval_arguments import (
    Checkpoint,
    Count,
    Folder,
    JsonFile,
    Methods,
    check_positive,
    check_writable,
    open_layouts,
    write_json,
)
from finlab.cli.eval_report import verbs

Name = Annotated[str, arg(metavar="NAME")]
Source = Annotated[str, arg(metavar="NAME|FILE")]


@verbs.command
def trajectory(
    layouts: Annotated[str, arg(metavar="A,B,...")] = "A,B,C,D",
    trajectory: Source = "lissajous",
    methods: Methods = "learned",
    runs: Count = 5,
    seed: Count = 0,
    plant: Name = "mean",
    steady: bool = False,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
    figures: Folder = None,
) -> None:
    """Follow a trajectory with several layouts; ATE, RTE and depth error of each method.

    Args:
        layouts: names or files with commas between.
        trajectory: circle, lissajous, square, or a CSV file with the columns t, x, y, z.
        methods: names with commas between; also on-board, U-CAT's own law at a fixed frequency, and
            learned-power, the learned method with inertial power for its energy.
        runs: runs of each, with other noise.
        seed: of the first run; the others follow on.
        plant: mean, ripple or flexible.
        steady: tell the allocator its previous command.
        checkpoint: trained checkpoint; the shipped one by default.
        json: file for the rows.
        figures: folder for pictures.
    """
    from finlab.evaluation.experiments.closed_loop_runs import load_methods
    from finlab.evaluation.experiments.trajectory import run_trajectory, trajectory_report, trajectory_rows
    from finlab.sim import make_trajectory

    _check(runs, json, figures)
    robots, path = open_layouts(layouts), make_trajectory(trajectory)
    found = run_trajectory(
        robots, load_methods(methods, checkpoint), path, _seeds(seed, runs), plant, steady=steady
    )
    rows = trajectory_rows(found)
    write_json(json, {"rows": rows})
    print(trajectory_report(rows, path, plant))
    if figures is not None:
        from finlab.evaluation.plots.closed_loop_experiments import save_layouts_figure

        _save(figures, "trajectory", save_layouts_figure, found)


@verbs.command
def faults(
    layout: Annotated[str, arg(metavar="LAYOUT")] = "A",
    trajectory: Source = "circle",
    methods: Methods = "learned,on-board",
    runs: Count = 3,
    seed: Count = 0,
    plant: Name = "mean",
    steady: bool = False,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
    figures: Folder = None,
) -> None:
    """Lose each fin and each pair of fins, from the start and half-way, and follow a trajectory all the same.

    Args:
        layout: layout file or the name of a shipped layout.
        trajectory: circle, lissajous, square, or a CSV file with the columns t, x, y, z.
        methods: names with commas between; also on-board, U-CAT's own law at a fixed frequency, and
            learned-power, the learned method with inertial power for its energy.
        runs: runs of each, with other noise.
        seed: of the first run; the others follow on.
        plant: mean, ripple or flexible.
        steady: tell the allocator its previous command.
        checkpoint: trained checkpoint; the shipped one by default.
        json: file for the rows.
        figures: folder for pictures.
    """
    from finlab.cli.inputs import open_robot
    from finlab.evaluation.experiments.closed_loop_runs import load_methods
    from finlab.evaluation.experiments.faults import all_faults, fault_report, fault_rows, run_faults
    from finlab.sim import make_trajectory

    _check(runs, json, figures)
    robot, path = open_robot(layout).layout, make_trajectory(trajectory)
    cases = all_faults(robot, path.duration_s / 2)
    found = run_faults(
        robot, load_methods(methods, checkpoint), path, cases, _seeds(seed, runs), plant, steady=steady
    )
    rows = fault_rows(cases, found)
    write_json(json, {"rows": rows})
    print(fault_report(rows, robot, path, plant))
    if figures is not None:
        from finlab.evaluation.plots.closed_loop_experiments import save_faults_figure

        _save(figures, "faults", save_faults_figure, rows)


@verbs.command
def velocity(
    layout: Annotated[str, arg(metavar="LAYOUT")] = "A",
    methods: Methods = "learned-power,learned,analytic,on-board",
    baseline: Name = "analytic",
    runs: Count = 5,
    duration: Annotated[float, arg(metavar="SECONDS")] = 30.0,
    seed: Count = 0,
    plant: Name = "mean",
    steady: bool = False,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
    figures: Folder = None,
) -> None:
    """Keep 0.10, 0.15 and 0.20 m/s at constant depth; power and error of the speed against a baseline.

    Args:
        layout: layout file or the name of a shipped layout.
        methods: names with commas between; also on-board, U-CAT's own law at a fixed frequency, and
            learned-power, the learned method with inertial power for its energy.
        baseline: the method that the others are compared with.
        runs: runs at each speed, with other noise.
        duration: of a run.
        seed: of the first run; the others follow on.
        plant: mean, ripple or flexible.
        steady: tell the allocator its previous command.
        checkpoint: trained checkpoint; the shipped one by default.
        json: file for the rows.
        figures: folder for pictures.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import DataError
    from finlab.evaluation.experiments.closed_loop_runs import load_methods
    from finlab.evaluation.experiments.velocity import SETTLED_S, run_velocity, velocity_report, velocity_rows

    _check(runs, json, figures)
    if not SETTLED_S < duration <= 3600.0:
        raise DataError(f"duration: expected more than {SETTLED_S:g} s and at most 3600 s, got {duration:g}")
    robot = open_robot(layout).layout
    found = run_velocity(
        robot,
        load_methods(methods, checkpoint),
        _seeds(seed, runs),
        duration_s=duration,
        plant=plant,
        steady=steady,
    )
    rows = velocity_rows(found)
    write_json(json, {"rows": rows})
    print(velocity_report(rows, baseline, robot, plant))
    if figures is not None:
        from finlab.evaluation.plots.closed_loop_experiments import save_velocity_figure

        _save(figures, "velocity", save_velocity_figure, found)


def _seeds(first: int, count: int) -> range:
    return range(first, first + count)


def _check(runs: int, json: Path | None, figures: Path | None) -> None:
    """Refuse before the runs what would fail after them."""
    from finlab.errors import DataError

    check_positive("runs", runs)
    check_writable(json)
    if figures is not None and not figures.is_dir():
        raise DataError(f"figures: expected a folder that exists, got {figures}")


def _save(folder: Path, name: str, draw: Callable[[Any, Path], None], content: Any) -> None:
    """Draw into a folder and say so."""
    path = folder / f"{name}.png"
    draw(content, path)
    print(f"\n{path}: written.")
