"""`finlab simulate`: a robot swims a trajectory, fins fail on the way, a log is written."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from finlab.cli.shared_options import open_robot
from finlab.errors import FinlabError
from finlab.files.worker import in_worker
from finlab.whole_file import make_folder

if TYPE_CHECKING:
    from finlab.allocation import Allocator
    from finlab.fit.robot.online import OnlineFit
    from finlab.sim import ClosedLoop, RunLog


def simulate(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    trajectory: Annotated[str, arg(metavar="NAME|FILE")] = "lissajous",
    scale: Annotated[float, arg(metavar="X")] = 1.0,
    excite: bool = False,
    fail: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME@SECONDS[:KIND]")] = (),
    announced: bool = True,
    monitor: bool = False,
    learn: bool = False,
    method: Annotated[str, arg(metavar="NAME")] = "dual",
    controller: Annotated[str, arg(metavar="NAME")] = "tracking",
    duration: Annotated[float | None, arg(metavar="SECONDS")] = None,
    truth: Annotated[str | None, arg(metavar="LAYOUT")] = None,
    current: Annotated[tuple[float, float, float], arg(metavar="VX VY VZ")] = (0.0, 0.0, 0.0),
    noise: bool = True,
    seed: Annotated[int, arg(metavar="N")] = 0,
    checkpoint: Annotated[str | None, arg(metavar="NAME|FOLDER")] = None,
    output: Annotated[Path | None, arg(metavar="FOLDER", aliases=["-o"])] = None,
) -> None:
    """Let a robot follow a trajectory in simulation, and say how well it did.

    Example: finlab simulate A --trajectory circle --fail front_left@30 -o swim

    Args:
        layout: layout file, bundle, or the name of a shipped layout.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x, y, z.
        scale: how many times larger the path is to be, in the same time; a torpedo needs speed.
        excite: shake every axis and fin on the spot instead, for at most 300 s, within bounds of depth and
            attitude; `finlab fit robot` learns the robot from the log.
        fail: a fin and when it is lost, such as front_left@30; or what else becomes of it:
            front_left@30:torn=0.5 (half of its thrust is left), front_left@30:stuck (it no longer turns),
            front_left@60:whole (it is repaired).
        announced: whether what happens to fins is announced to the allocator.
        monitor: let a FaultMonitor watch the robot and tell the allocator what it finds.
        learn: every minute fit the actuators' strengths and directions to the last four minutes of the swim,
            and allocate with them from then on; for methods that take any shaft, and fins of a law.
        method: dual, mdn, paper, qp, sqp, paper_sqp, px4, ardusub, analytic, fixed_frequency or ipopt.
        controller: tracking, or of the paper waypoint, or velocity, which holds the path's speed and depth.
        duration: time for a shipped trajectory.
        truth: the robot that really swims, a layout with the same actuators; the one that is believed by
            default.
        current: velocity of the water in the world [m/s].
        noise: whether the sensors are noisy.
        seed: of the noise.
        checkpoint: trained checkpoint; the shipped one of the method by default.
        output: folder for the log (log.npz); without it only the summary is printed.
    """
    from tqdm import tqdm

    if output is not None:
        make_folder(output)
    tqdm.monitor_interval = 0  # a process of one thread is copied to read files, without room on a disk
    with tqdm(desc="swim", unit="s", disable=None, leave=False, miniters=0.1, file=sys.stderr) as bar:
        from finlab.sim import NO_NOISE, ClosedLoop, FinFault, make_trajectory

        sensors = None if noise else NO_NOISE
        robot, lost = open_robot(layout)
        true = None if truth is None else open_robot(truth)[0]
        faults = [*(FinFault(name, 0.0) for name in lost), *map(FinFault.parse, fail)]
        if excite:
            if fail or monitor or learn:
                raise FinlabError(
                    "--excite: a robot is learned with the fins that it has; leave --fail, --monitor and "
                    "--learn out"
                )
            from finlab.sim.excite import LONGEST_S, excitation

            learner = None
            whole, seconds = robot.without(lost), LONGEST_S if duration is None else duration
            loop = excitation(whole, seconds, truth=true, sensors=sensors, current=current, seed=seed)
        else:
            from finlab.control import FaultMonitor, controller_of
            from finlab.evaluation.method_specs import load_method_spec
            from finlab.vehicle.righting import righting_words

            allocator = load_method_spec(method, checkpoint).on(robot)
            learner = _learner(allocator) if learn else None
            loop = ClosedLoop(
                robot,
                allocator,
                in_worker(make_trajectory, trajectory, duration, scale),
                controller_of(controller, robot),
                truth=true,
                sensors=sensors,
                current=current,
                failures=faults,
                announced=announced,
                monitor=FaultMonitor(robot) if monitor else None,
                learner=learner,
                seed=seed,
            )
            overturns = righting_words(robot)
            if overturns is not None and "Ty" not in loop.controller.axes:
                bar.write(f"finlab: {robot.name}: {overturns}", file=sys.stderr)
        found = [(0.0, monitored(loop))]
        bar.reset(round(loop.task.duration_s, 1))
        bar.bar_format = "{l_bar}{bar}| {n:.0f}/{total:.0f} s [{elapsed}<{remaining}]"
        while not loop.done:
            loop.step()
            if (now := monitored(loop)) != found[-1][1]:
                found.append((loop.time - loop.period_s, now))
            bar.update(loop.period_s)
    written = []
    if output is not None:
        loop.log.save(output / "log.npz")
        written = [f"\n{output}: written log.npz."]
    told = excitation_summary(loop.log) if excite else summary(loop.log)
    changes = [] if learner is None else learner.notes
    changes += [f"{time:.1f} s: the monitor takes {what}" for time, what in found[1:]]
    print("\n".join([told, *changes, *written]))


def summary(log: RunLog) -> str:
    """The run in a few lines."""
    from finlab.evaluation.experiments.closed_loop import LOST_M, RTE_DELTA_S, follow_row

    row = follow_row(log)
    lost = [name for name, works in zip(log.fins, log.alive[-1], strict=True) if not works]
    lines = [
        f"{log.layout} along {log.task} by {log.method}, {log.time[-1]:.0f} s"
        + (f", lost: {', '.join(lost)}" if lost else ""),
        f"ATE {row['ate']:.4f} m   RTE over {RTE_DELTA_S:g} s {row['rte']:.4f} m   "
        f"depth RMSE {row['depth_rmse']:.4f} m   farthest {row['max']:.3f} m",
        f"power {row['driving_w']:.2f} W with motor losses, {row['inertial_w']:.2f} W inertial   "
        f"allocation {row['solve_ms']:.2f} ms (median)",
    ]
    if (when := log.capsized_s) is not None:
        lines.append(f"the robot capsized at {when:.1f} s")
    if row["max"] >= LOST_M:
        lines.append(f"the robot lost its reference: it was more than {LOST_M:g} m away")
    return "\n".join(lines)


def excitation_summary(log: RunLog) -> str:
    """How far the robot went from where it began, in a line or two."""
    import numpy as np

    from finlab.vehicle.attitude import euler

    away = np.abs(log.position - log.position[0]).max(axis=0)
    tilt = np.degrees(np.abs(euler(log.quaternion)[:, :2]).max())
    return (
        f"{log.layout} shaken on the spot, {log.time[-1]:.0f} s: at most "
        f"{np.hypot(away[0], away[1]):.2f} m away, {away[2]:.2f} m up or down, {tilt:.0f} deg of roll or "
        f"pitch, {np.abs(log.motion[:, :3]).max():.2f} m/s"
    )


def _learner(allocator: Allocator) -> OnlineFit:
    """Who learns a robot on the way; a `FinlabError` where the method takes no actuators that lean."""
    import numpy as np

    from finlab.fit.robot.fitted_robot import leaned
    from finlab.fit.robot.online import OnlineFit

    learner, layout = OnlineFit(allocator.layout), allocator.layout
    allocator.on(leaned(layout, np.full(layout.n, 0.01)))
    return learner


def monitored(loop: ClosedLoop) -> str:
    """What a monitor takes the fins for, in words."""
    from finlab.layout.damage import Damage

    failed, health = Damage() if loop.verdict is None else loop.verdict.damage
    opposed = () if loop.monitor is None else loop.monitor.opposed
    words = [f"{name} pushes the other way" for name in opposed]
    words += [f"{name} lost" for name in failed if name not in opposed]
    if loop.monitor is not None and not loop.monitor.tells:
        words += ["that it cannot tell: the robot moves otherwise than its model"]
    if health is not None:
        words += [f"{name} torn" for name, _ in (*health.thrust, *health.weak)]
        words += [f"{name} stuck at {math.degrees(angle):.0f} deg" for name, angle in health.stuck]
    return ", ".join(words) or "all fins whole"
