"""`finlab simulate`: a robot swims a trajectory, fins fail on the way, a log and pictures are written."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg

if TYPE_CHECKING:
    from finlab.sim import ClosedLoop, FinFault, RunLog
    from finlab.sim.water import Water


def simulate(
    layout: Annotated[Positional[str], arg(metavar="LAYOUT")],
    trajectory: Annotated[str, arg(metavar="NAME|FILE")] = "lissajous",
    excite: bool = False,
    fail: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME@SECONDS[:KIND]")] = (),
    announced: bool = True,
    monitor: bool = False,
    servo_feedback: bool = False,
    method: Annotated[str, arg(metavar="NAME")] = "search",
    objective: Literal["power", "effort"] = "power",
    duration: Annotated[float | None, arg(metavar="SECONDS")] = None,
    plant: Annotated[str, arg(metavar="NAME")] = "mean",
    controller: Literal["tracking", "waypoint"] = "tracking",
    gains: Annotated[str | None, arg(metavar="NAME|FILE")] = None,
    current: Annotated[tuple[float, float, float], arg(metavar="VX VY VZ")] = (0.0, 0.0, 0.0),
    waves: Annotated[tuple[float, float], arg(metavar="HEIGHT SECONDS")] = (0.0, 3.0),
    noise: bool = True,
    seed: Annotated[int, arg(metavar="N")] = 0,
    checkpoint: Annotated[str | None, arg(metavar="NAME|FOLDER")] = None,
    output: Annotated[Path | None, arg(metavar="FOLDER", aliases=["-o"])] = None,
    animate: bool = False,
) -> None:
    """Let a robot follow a trajectory in simulation, and say how well it did.

    Args:
        layout: layout file, layout graph file, or the name of a shipped layout.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x, y, z.
        excite: shake every axis and fin on the spot instead, for at most 300 s, within bounds of depth and
            attitude; `finlab fit robot` learns the robot from the log.
        fail: a fin and when it is lost, such as front_left@30; or what else becomes of it:
            front_left@30:weak=0.5 (half of its thrust is left), front_left@30:stuck (it no longer turns),
            front_left@60:whole (it is repaired).
        announced: whether the allocator is told of what happens to fins.
        monitor: let a FaultMonitor watch the robot and tell the allocator what it finds.
        servo_feedback: let the servos report their motion to the monitor.
        method: search, mdn, paper, qp, sqp, analytic, ipopt or on-board.
        objective: what the method keeps least: power in watts, or effort, the paper's J_en.
        duration: time for a shipped trajectory.
        plant: what the fins really do: mean (the fin law), ripple (within the flapping cycle), flexible (fins
            with soft tips), wake (fins in each other's jets), inflow (thrust falls with speed) or offset
            (centre of gravity and fins not where the layout says).
        controller: tracking (follows velocity and acceleration, learns current and unknown forces; its gains
            follow from the robot) or waypoint (heads for a point ahead, as in the paper).
        gains: of the waypoint controller alone: waypoint, waypoint_paper (proportional terms alone), or a
            YAML file.
        current: velocity of the water in the world [m/s].
        waves: significant height [m] and peak period [s] of waves that run along the world's x.
        noise: whether the sensors are noisy.
        seed: of the noise.
        checkpoint: trained checkpoint; the shipped one of the method by default.
        output: new or empty folder for the log (log.npz, and log.csv for other programs) and pictures;
            without it only the summary is printed.
        animate: write swim.gif into the folder, too: the swim from above, played in a quarter of a minute.
    """
    from tqdm import tqdm

    from finlab.cli.inputs import open_robot
    from finlab.control import (
        FaultMonitor,
        TrackingController,
        WaypointController,
        WaypointGains,
        load_gains,
    )
    from finlab.errors import FinlabError
    from finlab.evaluation.method_specs import load_method_spec
    from finlab.sim import NO_NOISE, ClosedLoop, FinFault, make_trajectory
    from finlab.sim.excite import LONGEST_S, excitation

    robot = open_robot(layout)
    failures = [FinFault(name, 0.0) for name in robot.failed] + [_failure(text) for text in fail]
    _check_folder(output)
    if animate and output is None:
        raise FinlabError("--animate: expected a folder for swim.gif; name one with --output")
    water = _water(current, waves, seed)
    sensors = None if noise else NO_NOISE
    if excite:
        if fail or monitor:
            raise FinlabError(
                "--excite: a robot is learned with the fins that it has; leave --fail and --monitor out"
            )
        swum = robot.layout.without(robot.failed) if robot.failed else robot.layout
        whole = LONGEST_S if duration is None else duration
        loop = excitation(swum, whole, plant=plant, sensors=sensors, water=water, seed=seed)
        failures = []
    else:
        if controller == "tracking" and gains is not None:
            raise FinlabError(
                "--gains: those of the tracking controller follow from the robot; leave it out, or add "
                "--controller waypoint"
            )
        pilot = (
            TrackingController(robot.layout)
            if controller == "tracking"
            else WaypointController(load_gains(WaypointGains, gains or "waypoint"))
        )
        loop = ClosedLoop(
            robot.layout,
            load_method_spec(method, checkpoint, objective),
            make_trajectory(trajectory, duration),
            pilot,
            plant=plant,
            sensors=sensors,
            water=water,
            failures=failures,
            announced=announced,
            monitor=FaultMonitor(robot.layout, period_s=pilot.period_s) if monitor else None,
            servo_feedback=servo_feedback,
            seed=seed,
        )
    for sentence in _warnings(loop, failures):
        print(sentence, file=sys.stderr)
    seconds = round(loop.task.duration_s, 1)
    with tqdm(total=seconds, unit="s", disable=None, leave=False, file=sys.stderr) as bar:
        found = Findings()
        while not loop.done:
            loop.step()
            found.note(loop)
            bar.update(loop.period_s)
    log = loop.log
    written = ""
    if output is not None:
        from finlab.evaluation.plots.animation import save_animation
        from finlab.evaluation.plots.closed_loop_run import save_pictures
        from finlab.evaluation.plots.film import Swum
        from finlab.sim.log_csv import save_csv

        output.mkdir(parents=True, exist_ok=True)
        log.save(output / "log.npz")
        save_csv(log, output / "log.csv")
        pictures = save_pictures(log, output)
        if animate:
            pictures.append(save_animation([Swum(log.method, log, loop.layout)], output / "swim.gif"))
        names = ", ".join(path.name for path in pictures)
        written = f"\n{output}: written log.npz, log.csv, {names}."
    print("\n".join([excitation_summary(log) if excite else summary(log), *found.sentences]))
    if written:
        print(written)


def summary(log: RunLog) -> str:
    """The run in a few lines."""
    from finlab.evaluation.experiments.closed_loop_runs import LOST_M, RTE_DELTA_S, follow_row

    row = follow_row(log)
    lost = [name for name, works in zip(log.fins, log.alive[-1], strict=True) if not works]
    lines = [
        f"{log.layout} along {log.task} by {log.method}, plant {log.plant}, {log.time[-1]:.0f} s"
        + (f", lost: {', '.join(lost)}" if lost else ""),
        f"ATE {row['ate']:.4f} m   RTE over {RTE_DELTA_S:g} s {row['rte']:.4f} m   "
        f"depth RMSE {row['depth_rmse']:.4f} m   farthest {row['max']:.3f} m",
        f"power {row['driving_w']:.2f} W with motor losses, {row['torque_w']:.2f} W by torque, "
        f"{row['inertial_w']:.2f} W inertial   "
        f"allocation {row['solve_ms']:.2f} ms (median)",
    ]
    if row["max"] >= LOST_M:
        lines.append(f"the robot lost its reference: it was more than {LOST_M:g} m away")
    return "\n".join(lines)


def excitation_summary(log: RunLog) -> str:
    """How far the robot went from where it began, in a line or two."""
    import numpy as np

    from finlab.physics.vehicle import euler

    away = np.abs(log.position - log.position[0]).max(axis=0)
    tilt = np.degrees(np.abs(euler(log.quaternion)[:, :2]).max())
    return (
        f"{log.layout} shaken on the spot, plant {log.plant}, {log.time[-1]:.0f} s: at most "
        f"{np.hypot(away[0], away[1]):.2f} m away, {away[2]:.2f} m up or down, {tilt:.0f} deg of roll or "
        f"pitch, {np.abs(log.motion[:, :3]).max():.2f} m/s"
    )


class Findings:
    """What a monitor says on the way, as sentences."""

    def __init__(self) -> None:
        """Nothing has been found."""
        self.sentences: list[str] = []
        """One for each time that the monitor changes its mind."""
        self._last = ""

    def note(self, loop: ClosedLoop) -> None:
        """Look at the monitor's verdict after a step."""
        verdict = loop.verdict
        if verdict is None:
            return
        words = [f"{name} lost" for name in verdict.failed]
        if verdict.health is not None:
            stuck = dict(verdict.health.stuck)
            words += [f"{name} weak" for name, _ in verdict.health.thrust]
            words += [f"{name} stuck at {math.degrees(angle):.0f} deg" for name, angle in stuck.items()]
        now = ", ".join(words) or "all fins whole"
        if now != (self._last or "all fins whole"):
            self.sentences.append(f"{loop.time - loop.period_s:.1f} s: the monitor takes {now}")
        self._last = now


def _failure(text: str) -> FinFault:
    """What `NAME@SECONDS`, `NAME@SECONDS:KIND` or `NAME@SECONDS:weak=SHARE` says."""
    from finlab.errors import FinlabError
    from finlab.sim import FinFault

    name, at, rest = text.rpartition("@")
    number, _, what = rest.partition(":")
    kind, equals, share = what.partition("=")
    try:
        fault = FinFault(name, float(number), kind or "lost", float(share) if equals else 0.5).checked()
    except (ValueError, FinlabError):
        fault = None
    if not at or not name or fault is None or (equals and kind != "weak"):
        raise FinlabError(
            "--fail: expected NAME@SECONDS such as front_left@30, with :weak=0.5, :stuck or :whole after it "
            f"for what is no loss, got {text!r:.60}"
        )
    return fault


def _water(current: tuple[float, float, float], waves: tuple[float, float], seed: int) -> Water:
    """How the water moves."""
    from finlab.sim.water import SteadyCurrent, Waves

    return Waves(*waves, current=current, seed=seed) if waves[0] else SteadyCurrent(current)


def _check_folder(output: Path | None) -> None:
    """Refuse before the run what would fail after it."""
    from finlab.errors import FinlabError

    if output is not None and output.exists() and (not output.is_dir() or any(output.iterdir())):
        raise FinlabError(f"{output}: expected a new or empty folder")


def _warnings(loop: ClosedLoop, failures: list[FinFault]) -> list[str]:
    """What will not be controllable, said before the run."""
    from finlab.control import Completion

    sentences, lost = [], []
    events = sorted((event for event in failures if event.kind == "lost"), key=lambda event: event.time_s)
    for name, time in [("", 0.0), *((event.fin, event.time_s) for event in events)]:
        lost += [name] if name else []
        if not Completion(loop.layout, tuple(lost), loop.controller.axes).controllable:
            without = f" without {', '.join(lost)}" if lost else ""
            sentences.append(
                f"finlab: from {time:g} s on, {loop.layout.name}{without} cannot give surge, heave and yaw "
                "independently"
            )
    return sentences
