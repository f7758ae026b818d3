"""`finlab simulate`: a robot swims a trajectory, actuators are lost on the way, a log is
written."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from finlab.cli.shared_options import open_robot
from finlab.errors import FinlabError
from finlab.files.worker import in_worker
from finlab.whole_file import make_folder

if TYPE_CHECKING:
    from finlab.allocation import Allocator
    from finlab.swim.identification.online_fit import OnlineFit
    from finlab.swim.simulation import ClosedLoop, Fault, RunLog


@dataclass(frozen=True)
class Options:
    """Of one swim."""

    layout: Annotated[Positional[str], arg(metavar="LAYOUT")]
    """layout file, bundle, or the name of a shipped layout."""
    trajectory: Annotated[str, arg(metavar="NAME|FILE")] = "lissajous"
    """circle, lissajous, square, dive, straight, station, or a CSV file with the columns t, x, y,
    z."""
    scale: Annotated[float, arg(metavar="X")] = 1.0
    """how many times larger the path is to be, in the same time; a torpedo needs speed."""
    controller: Annotated[str, arg(metavar="NAME")] = "tracking"
    """tracking; or one of the paper's: waypoint, or velocity, which keeps speed and depth of the
    path, but no course."""
    excite: bool = False
    """shake every axis and fin on the spot instead, for at most 300 s, within bounds of depth and
    attitude; `finlab fit robot` learns the robot from the log."""
    lost: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME@SECONDS")] = ()
    """an actuator and when it is lost, such as front_left@30; from the start where no time is
    said."""
    torn: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME=SHARE@SECONDS")] = ()
    """one that gives a share of its thrust from then on, such as front_left=0.5@30."""
    stuck: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME@SECONDS")] = ()
    """one that no longer turns from then on."""
    whole: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME@SECONDS")] = ()
    """one that is repaired."""
    announced: bool = True
    """whether what happens to fins is announced to the allocator."""
    monitor: bool = False
    """let a FaultMonitor watch the robot and tell the allocator what it finds."""
    learn: bool = False
    """every minute fit the actuators' strengths and directions to the last four minutes of the
    swim, and allocate with them from then on; for methods that take any shaft, and fins of a
    law."""
    method: Annotated[str, arg(metavar="NAME")] = "dual"
    """dual, mdn, paper, qp, sqp, paper_sqp, px4, ardusub, analytic, fixed_frequency or ipopt."""
    duration: Annotated[float | None, arg(metavar="SECONDS")] = None
    """time for a shipped trajectory."""
    truth: Annotated[str | None, arg(metavar="LAYOUT")] = None
    """the robot that really swims, a layout with the same actuators; the one that is believed by
    default."""
    current: Annotated[tuple[float, float, float], arg(metavar="VX VY VZ")] = (0.0, 0.0, 0.0)
    """velocity of the water in the world [m/s]."""
    plant: Annotated[str, arg(metavar="NAME")] = "finlab"
    """what integrates the robot's body: finlab, or mujoco with the robot as `finlab layout convert
    --to mjcf` writes it (needs extra mujoco)."""
    noise: bool = True
    """whether the sensors are noisy."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """of the noise."""
    checkpoint: Annotated[str | None, arg(metavar="NAME|FOLDER")] = None
    """trained checkpoint; the shipped one of the method by default."""
    output: Annotated[Path | None, arg(metavar="FOLDER", aliases=["-o"])] = None
    """folder for the log (log.npz); without it only the summary is printed."""
    plot: Annotated[Path | None, arg(metavar="FILE")] = None
    """file for a picture of the path, .png, .svg or .pdf (needs matplotlib, extra plot)."""


def simulate(options: OmitArgPrefixes[Options]) -> None:
    """Let a robot follow a trajectory in simulation, and say how well it did."""
    from tqdm import tqdm

    if options.output is not None:
        make_folder(options.output)
    tqdm.monitor_interval = (
        0  # a process of one thread is copied to read files, without room on a disk
    )
    with tqdm(
        desc="swim", unit="s", disable=None, leave=False, miniters=0.1, file=sys.stderr
    ) as bar:
        from finlab.display.figures import check_figure_file
        from finlab.swim.vehicle.righting import righting_words

        check_figure_file(options.plot)
        loop = _excitation(options) if options.excite else _swim(options)
        is_righted = options.excite or "Ty" in loop.controller.axes
        if not is_righted and (words := righting_words(loop.layout)) is not None:
            bar.write(f"finlab: {loop.layout.name}: {words}", file=sys.stderr)
        verdicts = [(0.0, monitored(loop))]
        bar.reset(round(loop.task.duration_s, 1))
        bar.bar_format = "{l_bar}{bar}| {n:.0f}/{total:.0f} s [{elapsed}<{remaining}]"
        while not loop.done:
            loop.step()
            if (verdict := monitored(loop)) != verdicts[-1][1]:
                verdicts.append((loop.time - loop.period_s, verdict))
            bar.update(loop.period_s)
    lines = [excitation_summary(loop.log) if options.excite else summary(loop.log)]
    lines += [] if options.plant == "finlab" else [f"plant: {options.plant}"]
    lines += [] if loop.learner is None else cast("OnlineFit", loop.learner).notes
    lines += [f"{time:.1f} s: the monitor takes {verdict}" for time, verdict in verdicts[1:]]
    if options.output is not None:
        loop.log.save(options.output / "log.npz")
        lines.append(f"\n{options.output}: written log.npz.")
    if options.plot is not None:
        from finlab.display.figures import write_figure
        from finlab.swim.simulation.swim_pictures import swim_picture

        write_figure(lambda: swim_picture(loop.log), options.plot)
        lines.append(f"\n{options.plot}: written.")
    print("\n".join(lines))


def _excitation(options: Options) -> ClosedLoop:
    """The swim of a robot that is shaken on the spot."""
    from finlab.swim.simulation.excite import LONGEST_S, excitation

    robot, lost = open_robot(options.layout)
    if _faults(options) or options.monitor or options.learn or options.controller != "tracking":
        raise FinlabError(
            "--excite: a robot is learned with the fins that it has, by a controller of its own; "
            "leave --controller, --lost, --torn, --stuck, --whole, --monitor and --learn out"
        )
    seconds = LONGEST_S if options.duration is None else options.duration
    return excitation(robot.without(lost), seconds, **_world(options))


def _swim(options: Options) -> ClosedLoop:
    """The swim along a trajectory, at its start."""
    from finlab.research.evaluation.method_specs import load_method_spec
    from finlab.swim.control import FaultMonitor, make_controller
    from finlab.swim.simulation import ClosedLoop, Fault, make_trajectory

    robot, lost = open_robot(options.layout)
    world = _world(options)
    faults = [*(Fault(name, 0.0) for name in lost), *_faults(options)]
    allocator = load_method_spec(options.method, options.checkpoint).on(robot)
    return ClosedLoop(
        robot,
        allocator,
        in_worker(make_trajectory, options.trajectory, options.duration, options.scale),
        make_controller(options.controller, robot),
        failures=faults,
        announced=options.announced,
        monitor=FaultMonitor(robot) if options.monitor else None,
        learner=_learner(allocator) if options.learn else None,
        **world,
    )


def _faults(options: Options) -> list[Fault]:
    """What becomes of actuators during the swim."""
    from finlab.swim.simulation import Fault

    faults = [Fault.parse("lost", text) for text in options.lost]
    faults += [Fault.parse("torn", text) for text in options.torn]
    faults += [Fault.parse("stuck", text) for text in options.stuck]
    faults += [Fault.parse("whole", text) for text in options.whole]
    return faults


def _world(options: Options) -> dict[str, Any]:
    """The robot that really swims, its sensors, the water and the seed."""
    from finlab.swim.simulation import NO_NOISE

    return {
        "truth": None if options.truth is None else open_robot(options.truth)[0],
        "sensors": None if options.noise else NO_NOISE,
        "current": options.current,
        "plant": options.plant,
        "seed": options.seed,
    }


def summary(log: RunLog) -> str:
    """The run in a few lines."""
    from finlab.research.evaluation.experiments.closed_loop import (
        LOST_M,
        RTE_DELTA_S,
        follow_row,
        speed_error,
    )

    row = follow_row(log)
    keeps_course = log.controller != "velocity"
    lost = [name for name, works in zip(log.names, log.alive[-1], strict=True) if not works]
    path_line = (
        f"ATE {row['ate']:.4f} m   RTE over {RTE_DELTA_S:g} s {row['rte']:.4f} m   depth RMSE "
        f"{row['depth_rmse']:.4f} m   farthest {row['max']:.3f} m"
    )
    speed_line = (
        f"MAE of the speed {speed_error(log).mean():.4f} m/s   depth RMSE {row['depth_rmse']:.4f} m"
    )
    lines = [
        f"{log.layout} along {log.task} by {log.method}, {log.time[-1]:.0f} s"
        + (f", lost: {', '.join(lost)}" if lost else ""),
        path_line if keeps_course else speed_line,
        f"power {row['driving_w']:.2f} W with motor losses, {row['inertial_w']:.2f} W inertial   "
        f"allocation {row['solve_ms']:.2f} ms (median)",
    ]
    if (capsized_s := log.capsized_s) is not None:
        lines.append(f"the robot capsized at {capsized_s:.1f} s")
    if keeps_course and row["max"] >= LOST_M:
        lines.append(f"the robot lost its reference: it was more than {LOST_M:g} m away")
    return "\n".join(lines)


def excitation_summary(log: RunLog) -> str:
    """How far the robot went from where it began, in a line or two."""
    import numpy as np

    from finlab.swim.vehicle.attitude import euler

    distance = np.abs(log.position - log.position[0]).max(axis=0)
    tilt = np.degrees(np.abs(euler(log.quaternion)[:, :2]).max())
    horizontal = np.hypot(distance[0], distance[1])
    speed = np.abs(log.motion[:, :3]).max()
    return (
        f"{log.layout} shaken on the spot, {log.time[-1]:.0f} s: at most {horizontal:.2f} m away, "
        f"{distance[2]:.2f} m up or down, {tilt:.0f} deg of roll or pitch, {speed:.2f} m/s"
    )


def _learner(allocator: Allocator) -> OnlineFit:
    """Who learns a robot on the way; a `FinlabError` where the method takes no actuators that
    lean."""
    import numpy as np

    from finlab.swim.identification.fitted_robot import with_lean
    from finlab.swim.identification.online_fit import OnlineFit

    learner = OnlineFit(allocator.layout)
    layout = allocator.layout
    allocator.on(with_lean(layout, np.full(layout.n, 0.01)))
    return learner


def monitored(loop: ClosedLoop) -> str:
    """What a monitor takes the fins for, in words."""
    from finlab.layout.damage import Damage

    damage = Damage() if loop.verdict is None else loop.verdict.damage
    opposed = () if loop.monitor is None else loop.monitor.opposed
    words = [f"{name} pushes the other way" for name in opposed]
    words += [f"{name} lost" for name in damage.lost if name not in opposed]
    if loop.monitor is not None and not loop.monitor.tells:
        words += ["that it cannot tell: the robot moves otherwise than its model"]
    words += [f"{name} torn" for name in (*damage.torn, *damage.weak)]
    for name, value in damage.stuck.items():
        is_angle = loop.layout.actuator(name).KIND.sticks_at_angle
        words.append(
            f"{name} stuck at "
            + (f"{math.degrees(value):.0f} deg" if is_angle else f"{value:.3g} N")
        )
    return ", ".join(words) or "all fins whole"
