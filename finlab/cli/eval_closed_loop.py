"""`finlab eval trajectory|faults|velocity`: the paper's closed-loop experiments; and `eval monitor`."""

from typing import Annotated

from tyro.conf import arg

from finlab.cli.eval_arguments import (
    ClosedLoopRuns,
    Count,
    MethodRun,
    Name,
    Names,
    PathController,
    Source,
    open_layouts,
)

RUN = MethodRun()
LAYOUT_RUNS = ClosedLoopRuns()
FAULT_RUNS = ClosedLoopRuns("search,on-board", runs=3)
SPEED_RUNS = ClosedLoopRuns("search,search-effort,analytic,on-board")


def trajectory(
    layouts: Names = "A,B,C,D",
    trajectory: Source = "lissajous",
    controller: PathController = "waypoint",
    loop: Annotated[ClosedLoopRuns, arg(name="")] = LAYOUT_RUNS,
    run: Annotated[MethodRun, arg(name="")] = RUN,
) -> None:
    """Follow a trajectory with several layouts; ATE, RTE and depth error of each method.

    Args:
        layouts: names or files with commas between.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x, y, z.
        controller: waypoint (heads for a point ahead, as in the paper), or tracking.
    """
    from finlab.evaluation.experiments import trajectory_and_velocity as experiment
    from finlab.evaluation.plots.closed_loop_experiments import draw_layouts, track_of
    from finlab.evaluation.report.sections.closed_loop import INTRODUCTION, trajectory_blocks
    from finlab.sim import make_trajectory

    robots, path = open_layouts(layouts), make_trajectory(trajectory)
    found = loop.swim(experiment.trajectory_scenarios(robots, path), run, controller)
    rows = experiment.trajectory_rows(found)
    about = f"Trajectory {path.name}: {path.length_m:.1f} m in {path.duration_s:.0f} s; {controller} "
    about += f"controller; plant {loop.plant}."
    saved = loop.save("trajectory", lambda: draw_layouts([(key, track_of(log)) for key, log in found], rows))
    run.show(*INTRODUCTION, *trajectory_blocks(rows), about, *saved, rows=rows)


def faults(
    layout: Annotated[str, arg(metavar="LAYOUT")] = "A",
    trajectory: Source = "circle",
    controller: PathController = "waypoint",
    loop: Annotated[ClosedLoopRuns, arg(name="")] = FAULT_RUNS,
    run: Annotated[MethodRun, arg(name="")] = RUN,
) -> None:
    """Lose each fin and each pair of fins, from the start and half-way, and follow a trajectory all the same.

    Args:
        layout: layout file or the name of a shipped layout.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x, y, z.
        controller: waypoint (heads for a point ahead, as in the paper), or tracking.
    """
    from finlab.cli.inputs import open_robot
    from finlab.evaluation.experiments.faults import all_faults, fault_rows, fault_scenarios
    from finlab.evaluation.plots.closed_loop_experiments import draw_faults
    from finlab.evaluation.report.sections.closed_loop import INTRODUCTION, fault_blocks
    from finlab.sim import make_trajectory

    robot, path = open_robot(layout).layout, make_trajectory(trajectory)
    cases = all_faults(robot, path.duration_s / 2)
    rows = fault_rows(cases, loop.swim(fault_scenarios(robot, path, cases), run, controller))
    about = f"Layout {robot.name}, {path.name} of {path.duration_s:.0f} s; {controller} controller; "
    about += f"plant {loop.plant}."
    saved = loop.save("faults", lambda: draw_faults(rows))
    run.show(*INTRODUCTION, *fault_blocks(rows), about, *saved, rows=rows)


def velocity(
    layout: Annotated[str, arg(metavar="LAYOUT")] = "A",
    baseline: Name = "analytic",
    duration: Annotated[float, arg(metavar="SECONDS")] = 30.0,
    loop: Annotated[ClosedLoopRuns, arg(name="")] = SPEED_RUNS,
    run: Annotated[MethodRun, arg(name="")] = RUN,
) -> None:
    """Keep 0.10, 0.15 and 0.20 m/s at constant depth; power and error of the speed against a baseline.

    Args:
        layout: layout file or the name of a shipped layout.
        baseline: the method that the others are compared with.
        duration: of a run.
    """
    from finlab.cli.inputs import open_robot
    from finlab.errors import DataError
    from finlab.evaluation.experiments import trajectory_and_velocity as experiment
    from finlab.evaluation.plots.closed_loop_experiments import draw_velocity
    from finlab.evaluation.report.sections.closed_loop import INTRODUCTION, velocity_blocks

    least = experiment.SETTLED_S
    if not least < duration <= 3600.0:
        raise DataError(f"duration: expected more than {least:g} s and at most 3600 s, got {duration:g}")
    robot = open_robot(layout).layout
    found = loop.swim(experiment.velocity_scenarios(robot, duration_s=duration), run)
    rows = experiment.velocity_rows(found)
    about = f"Layout {robot.name}; plant {loop.plant}."
    saved = loop.save("velocity", lambda: draw_velocity(found))
    run.show(*INTRODUCTION, *velocity_blocks(rows, baseline), about, *saved, rows=rows)


def monitor(
    layouts: Names = "A,B,C,D",
    trajectory: Source = "lissajous",
    method: Name = "search",
    plant: Name = "mean",
    seed: Count = 0,
    seeds: Count = 4,
    whole: Count = 0,
    controller: PathController = "tracking",
    run: Annotated[MethodRun, arg(name="")] = RUN,
) -> None:
    """Lose each fin while swimming without telling the allocator; how soon and how surely a monitor finds it.

    A seed takes about three minutes with four layouts.

    Args:
        layouts: names or files with commas between.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x, y, z.
        method: the allocator.
        plant: how the fins' forces are simulated; see finlab simulate --help.
        seed: the first seed of times, currents and noise.
        seeds: how many; each loses every fin of every layout once, and swims once without a loss.
        whole: more seeds without a loss, for the false alarms: with four layouts ten make an hour.
        controller: tracking, or waypoint (heads for a point ahead, as in the paper).
    """
    from finlab.cli.inputs import check_positive
    from finlab.evaluation.experiments.fault_monitoring import monitoring_rows, swim_losses
    from finlab.evaluation.report.sections.fault_monitoring import monitoring_blocks
    from finlab.sim import make_trajectory

    check_positive(seeds=seeds, whole=whole or None)
    robots, path = open_layouts(layouts), make_trajectory(trajectory)
    end = seed + seeds
    losses = swim_losses(
        robots,
        path,
        run.method(method),
        range(seed, end),
        plant=plant,
        whole_seeds=range(end, end + whole),
        controller=controller,
    )
    rows = monitoring_rows(losses)
    about = f"{path.name} of {path.duration_s:.0f} s by {method}, {controller} controller; "
    about += f"plant {plant}; {seeds} seeds from {seed}."
    about += f" Besides, {whole} seeds of whole swims." if whole else ""
    run.show(*monitoring_blocks(rows), about, rows=rows)
