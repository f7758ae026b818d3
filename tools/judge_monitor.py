"""How well the fault monitor does on robots in MuJoCo that are not quite as drawn (see
`tests/plant_mujoco.py`): faults of every kind, and hours without one.

    python -m tools.judge_monitor runs.jsonl --faults 200 --quiet-h 2     # goes on where it stopped
    python -m tools.judge_monitor runs.jsonl --table                      # what the file says

Seeds from 200000 on, and robots that they draw, are for judging alone: nothing is tuned on them.
What was looked at to find a cause is no judge any more: `--first-seed 300000` begins afresh.
"""

import argparse
import json
import math
import time
from collections import defaultdict
from collections.abc import Sequence
from functools import lru_cache
from multiprocessing import Pool
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.axes import mask_of
from finlab.layout import Layout, load_layout
from finlab.layout.damage import NO_DAMAGE, Damage
from finlab.swim.control import Completion, Diagnosis, FaultMonitor
from finlab.swim.control.completion import axes_of
from finlab.swim.control.contract import LEVER_M, asked_of_weak
from finlab.swim.vehicle.fossen import complete_body
from tests.plant_mujoco import MujocoRobot, TrueFault, random_frame
from tests.plant_mujoco import Path as SwumPath

JUDGED_SEED = 200_000
"""First of the seeds that are for judging."""
SHIPPED = ("bluerov2", "bluerov2_heavy", "catamaran", "turtle_hybrid")
"""Shipped robots among those that swim."""
N_ROBOTS = 24
"""Of all of them; the others are random frames."""
KINDS = ("lost", "weak", "reversed", "stuck")
"""Kinds of fault."""
SENSORS = ("dvl", "imu", "imu+test", "imu+accelerometer", "imu+esc")
"""With a velocity log, and without: there alone, with a test motion where an actuator is in doubt,
with an accelerometer, or with telemetry of the drives."""
PERIOD_S = 0.1
"""Of the loop [s]."""
FAULT_RUN_S = 12.5
"""How long a run goes on after its fault [s]."""
QUIET_RUN_S = 120.0
"""Length of a run without a fault [s]."""
SHOWN_ACCELERATION = 0.05
"""A fault shows where the wrench is off by so much of the robot's mass [m/s^2] for `SHOWN_S`."""
SHOWN_S = 0.5
"""[s]."""
ERROR_FROM_S = 3.0
"""Wrenches are compared from so long after the fault until `ERROR_UNTIL_S` [s]."""
ERROR_UNTIL_S = 12.0
SCALE = np.array([1.0, 1.0, 1.0, 1 / LEVER_M, 1 / LEVER_M, 1 / LEVER_M])
"""Torques as forces at a lever."""


class Run(NamedTuple):
    """One run: which robot, what it measures, and what breaks."""

    number: int
    sensors: str
    kind: str | None
    """None for no fault."""
    first_seed: int = JUDGED_SEED
    """Seed of the run of number 0, and of the first robot."""

    @property
    def seed(self) -> int:
        """Of all that is drawn in the run."""
        return self.first_seed + self.number

    @property
    def key(self) -> str:
        """A name by which a file of results knows it."""
        return f"{self.first_seed} {self.number} {self.sensors} {self.kind}"

    def robot(self) -> Layout:
        """The layout that is believed."""
        index = self.number % N_ROBOTS
        if index < len(SHIPPED):
            return load_layout(SHIPPED[index])
        return random_frame(self.first_seed + index)

    def fault(self, layout: Layout) -> TrueFault | None:
        """What breaks, and when."""
        if self.kind is None:
            return None
        rng = np.random.default_rng([self.seed, KINDS.index(self.kind), 7])
        possible = list(range(layout.n))
        if self.kind == "reversed":  # a fin that turns about is stuck, or wired wrongly
            possible = [k for k in possible if not layout.is_fin[k]]
        index = int(rng.choice(possible))
        moment = round(float(rng.uniform(12.0, 20.0)), 1)
        return TrueFault(index, self.kind, moment, float(rng.uniform(0.2, 0.5)))


class WrenchError:
    """RMS of the wrench that is off, over the RMS of what was asked."""

    def __init__(self, axes: tuple[str, ...]) -> None:
        """Takes the axes that are commanded."""
        self._weight = SCALE * mask_of(axes)
        self._off = 0.0
        self._asked = 0.0

    def add(self, given: Array, asked: Array) -> None:
        """Counts one tick."""
        self._off += float(np.square((given - asked) * self._weight).sum())
        self._asked += float(np.square(asked * self._weight).sum())

    @property
    def value(self) -> float:
        """The ratio."""
        return math.sqrt(self._off / max(self._asked, 1e-12))


def said_of(verdict: Diagnosis) -> dict[str, str]:
    """What a verdict says of which actuator."""
    return {finding.name: finding.kind for finding in verdict.findings}


def damage_of(layout: Layout, fault: TrueFault, stuck_at: float) -> Damage:
    """What an allocator would be told by somebody who knows."""
    name = layout.names[fault.index]
    if fault.kind == "weak":
        return Damage.representing(layout, [], {name: fault.share}, {})
    if fault.kind == "stuck":
        return Damage.representing(layout, [], {}, {name: stuck_at})
    return Damage(lost=[name])


def judged(run: Run) -> dict[str, Any]:
    """Swims one run and returns what came of it."""
    layout = run.robot()
    seed = run.seed
    allocator = Allocator(layout)
    axes = axes_of(layout)
    completion_of = lru_cache(maxsize=8)(lambda damage: Completion(layout, damage, axes))

    def command_for(wanted: Array, damage: Damage) -> tuple[Array, Array]:
        wrench = completion_of(damage)(wanted)
        answer = allocator.allocate(wrench, damage=damage, policy="closest")
        return wrench, answer.command

    robot = MujocoRobot(layout, seed, sensors=run.sensors)
    has_velocity = run.sensors == "dvl"
    path = SwumPath(layout, axes, seed, gentle=not has_velocity)
    monitor = FaultMonitor(layout)
    fault = run.fault(layout)
    duration = QUIET_RUN_S if fault is None else fault.time_s + FAULT_RUN_S
    mass = complete_body(layout).mass_kg
    assert mass is not None
    of_monitor = WrenchError(axes)
    of_oracle = WrenchError(axes)
    of_unaware = WrenchError(axes)
    known = NO_DAMAGE
    command: Array | None = None
    said: dict[str, str] = {}
    events: list[tuple[float, str, str | None]] = []
    tick_ms: list[float] = []
    shown_s = 0.0
    shown_at: float | None = None
    unknown = 0
    for tick in range(round(duration / PERIOD_S)):
        now = round(tick * PERIOD_S, 6)
        if fault is not None and abs(now - fault.time_s) < 1e-6:
            robot.fail(fault)
            known = damage_of(layout, fault, float(robot.actuators.stuck_at[fault.index]))
        measurement = robot.measure()
        started = time.thread_time_ns()
        verdict = monitor.step(measurement, command)
        spent = time.thread_time_ns() - started
        wanted = path.wrench(now, measurement, has_velocity)
        _, answer = command_for(wanted, verdict.damage)
        started = time.thread_time_ns()
        if "test" in run.sensors.split("+"):
            answer = monitor.tested(answer, axes)
        command = monitor.sent(answer)
        tick_ms.append((spent + time.thread_time_ns() - started) / 1e6)
        unknown += verdict.unknown
        before = said
        said = said_of(verdict)
        for name in {*before, *said}:
            if before.get(name) != said.get(name):
                events.append((now, name, said.get(name)))
        if fault is not None and now >= fault.time_s:
            actuators = robot.actuators
            water = robot.water
            given = actuators.nominal(command, water)
            whole = actuators.nominal(command, water, whole=True)
            if np.linalg.norm((given - whole) * SCALE) > SHOWN_ACCELERATION * mass:
                shown_s += PERIOD_S
                if shown_at is None and shown_s > SHOWN_S - 1e-9:
                    shown_at = now
            if ERROR_FROM_S <= now - fault.time_s < ERROR_UNTIL_S:
                of_monitor.add(given, wanted)
                _, by_oracle = command_for(wanted, known)
                by_oracle = asked_of_weak(layout, known, by_oracle)
                of_oracle.add(actuators.nominal(by_oracle, water), wanted)
                _, by_unaware = command_for(wanted, NO_DAMAGE)
                of_unaware.add(actuators.nominal(by_unaware, water), wanted)
        robot.step(command, PERIOD_S)
    return {
        "key": run.key,
        "robot": layout.name,
        "sensors": run.sensors,
        "kind": run.kind,
        "actuator": None if fault is None else layout.names[fault.index],
        "time_s": None if fault is None else fault.time_s,
        "shown_s": shown_at,
        "duration_s": duration,
        "events": events,
        "unknown_s": unknown * PERIOD_S,
        "error": of_monitor.value,
        "error_of_oracle": of_oracle.value,
        "error_of_unaware": of_unaware.value,
        "tick_ms": [float(np.median(tick_ms)), float(np.percentile(tick_ms, 99))],
    }


def judged_or_failed(run: Run) -> dict[str, Any]:
    """As `judged`; an exception is a result."""
    try:
        return judged(run)
    except Exception as error:  # what a robot must never see: counted
        return {"key": run.key, "sensors": run.sensors, "kind": run.kind, "exception": repr(error)}


def is_right(result: dict[str, Any], until: float) -> bool:
    """Whether the last word on the broken actuator by a time [s] is right; a stuck one may be
    called lost, a weak one fouled."""
    said = None
    for moment, name, kind in result["events"]:
        if name == result["actuator"] and moment <= until + 1e-9:
            said = kind
    return said == result["kind"] or (result["kind"], said) in (
        ("stuck", "lost"),
        ("weak", "fouled"),
    )


def _percent(flags: Sequence[bool]) -> str:
    return f"{np.mean(flags):.0%}" if flags else "-"


def table(results: Sequence[dict[str, Any]]) -> str:
    """What all runs say, as a table in Markdown."""
    by_cell = defaultdict(list)
    for result in results:
        if "exception" not in result:
            by_cell[result["kind"], result["sensors"]].append(result)
    lines = [
        "| fault | sensors | runs | kind right 1 s / 3 s after the fault | 3 s after it shows | "
        "alarm before | wrong name after | wrench error: monitor / who knows / unaware |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for kind in KINDS:
        for sensors in SENSORS:
            runs = by_cell[kind, sensors]
            if not runs:
                continue
            early = [is_right(run, run["time_s"] + 1.0) for run in runs]
            late = [is_right(run, run["time_s"] + 3.0) for run in runs]
            # One that is made up for at once never shows for long.
            shown = [run for run in runs if run["shown_s"] is not None or is_right(run, math.inf)]
            of_shown = [is_right(run, (run["shown_s"] or math.inf) + 3.0) for run in shown]
            alarm = [any(event[0] < run["time_s"] for event in run["events"]) for run in runs]
            wrong = [bool(_wrong_names(run)) for run in runs]
            errors = [
                f"{np.median([run[name] for run in runs]):.2f}"
                for name in ("error", "error_of_oracle", "error_of_unaware")
            ]
            lines.append(
                f"| {kind} | {sensors} | {len(runs)} | {_percent(early)} / {_percent(late)} | "
                f"{_percent(of_shown)} of {len(shown)} | {_percent(alarm)} | {_percent(wrong)} | "
                f"{' / '.join(errors)} |"
            )
    lines.append("")
    for sensors in SENSORS:
        runs = by_cell[None, sensors]
        if runs:
            hours = sum(run["duration_s"] for run in runs) / 3600.0
            alarms = sum(1 for run in runs for event in run["events"] if event[2] is not None)
            unknown = sum(run["unknown_s"] for run in runs)
            lines.append(
                f"No fault, {sensors}: {alarms} alarms in {hours:.1f} h; {unknown:.0f} s unknown."
            )
    failed = sum("exception" in result for result in results)
    ticks = np.array([result["tick_ms"] for result in results if "exception" not in result])
    lines.append(f"Exceptions: {failed}.")
    if len(ticks):
        lines.append(
            f"A tick of the monitor: median {np.median(ticks[:, 0]):.1f} ms, 99 % "
            f"{np.median(ticks[:, 1]):.1f} ms."
        )
    return "\n".join(lines)


def _wrong_names(result: dict[str, Any]) -> set[str]:
    """Other actuators that were named after the fault."""
    names = set()
    for moment, name, kind in result["events"]:
        if moment >= result["time_s"] and kind is not None and name != result["actuator"]:
            names.add(name)
    return names


def planned(
    n_faults: int, quiet_h: float, first_seed: int, kinds: Sequence[str], sensors: Sequence[str]
) -> list[Run]:
    """The runs of a judgement: faults of some kinds with some sets of sensors, and hours without
    a fault."""
    runs = []
    for number in range(math.ceil(n_faults / (len(kinds) * len(sensors)))):
        for kind in kinds:
            runs += [Run(number, each, kind, first_seed) for each in sensors]
    for number in range(math.ceil(quiet_h * 3600.0 / QUIET_RUN_S / len(sensors))):
        runs += [Run(5000 + number, each, None, first_seed) for each in sensors]
    return runs


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs what is missing in a file of results, and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("--faults", type=int, default=400)
    parser.add_argument("--quiet-h", type=float, default=10.0)
    parser.add_argument("--first-seed", type=int, default=JUDGED_SEED)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--sensors", nargs="+", choices=SENSORS, default=SENSORS[:2])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args(arguments)
    results = []
    if options.results.exists():
        lines = options.results.read_text(encoding="utf-8").splitlines()
        results = [json.loads(line) for line in lines]
    if not options.table:
        done = {result["key"] for result in results}
        all_runs = planned(
            options.faults, options.quiet_h, options.first_seed, options.kinds, options.sensors
        )
        runs = [run for run in all_runs if run.key not in done]
        with Pool(options.workers) as pool, options.results.open("a", encoding="utf-8") as file:
            for result in pool.imap_unordered(judged_or_failed, runs):
                file.write(json.dumps(result) + "\n")
                file.flush()
                results.append(result)
    print(table(results))


if __name__ == "__main__":
    main()
