"""How soon and how surely a `FaultMonitor` finds a fin that is lost without a word, and what that costs."""

import math
import time
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.control import PATH_CONTROLLERS, FaultMonitor, Measurement, Verdict
from finlab.evaluation.experiments.closed_loop_runs import Row, absolute_error
from finlab.evaluation.progress import progress
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.sim import ClosedLoop, FinFault, RunLog, SteadyCurrent, Trajectory

FOUND_WITHIN_S = 3.0
"""Time in which a loss should be found [s]."""
QUIET_S = 10.0
"""Neither in the first nor in the last seconds of a swim is a fin lost [s]."""
CURRENT_M_S = 0.05
"""Fastest current, whatever its heading [m/s]."""
PUSHES_N = 0.2
"""A fin that is told to push less than this on average until it should be found all but rests [N]."""
GOALS = {
    "found": ("found within 3 s", 0.95),
    "right": ("right fin", 0.99),
    "false_per_hour": ("false alarms an hour", 1.0),
    "ate_ratio": ("ATE over that of the announced loss", 1.1),
    "tick_ms": ("processor's time per tick [ms]", 0.1),
}
"""What is aimed at, by column: in words, and the number."""


class Loss(NamedTuple):
    """One swim with a monitor, and beside it the same swim with the loss announced."""

    layout: str
    """The robot."""
    feedback: bool
    """Whether the servos report their motion."""
    fin: str | None
    """The fin that is lost; None where none is."""
    found_s: float
    """Time from the loss until a fin is called broken [s]; infinite where none is."""
    right: bool
    """Whether it is the one."""
    pushes: bool
    """Whether the fin is told to push when it is lost."""
    false_alarms: int
    """How often a whole fin is called broken."""
    whole_s: float
    """Time during which nothing is broken [s]."""
    ate: float
    """Absolute trajectory error of the whole swim [m]."""
    ate_announced: float
    """That of the announced loss [m]; NaN where nothing is lost."""
    tick_ms: float
    """Processor's time of the monitor per tick [ms]."""


class TimedMonitor(FaultMonitor):
    """A monitor that counts the processor's time that its steps take."""

    spent_s = 0.0
    """So far [s]."""

    def step(self, measurement: Measurement, command: Array | None, reported: Array | None = None) -> Verdict:
        """As `FaultMonitor.step`."""
        start = time.process_time()
        verdict = super().step(measurement, command, reported)
        self.spent_s += time.process_time() - start
        return verdict


def swim_losses(
    layouts: Sequence[Layout],
    trajectory: Trajectory,
    allocator: Allocator,
    seeds: Sequence[int],
    feedback: Sequence[bool] = (False, True),
    plant: str = "mean",
    whole_seeds: Sequence[int] = (),
    controller: str = "tracking",
) -> list[Loss]:
    """Every fin of every layout lost once per seed, at a random time in a random current; and whole swims.

    Args:
        layouts: the robots.
        trajectory: what they follow.
        allocator: the method.
        seeds: of times, currents and noise.
        feedback: without and with what servos report.
        plant: how fin forces are simulated.
        whole_seeds: of more swims without a loss, one per layout, in which false alarms are counted.
        controller: one of `finlab.control.PATH_CONTROLLERS`.
    """
    cases = []
    for seed in (*seeds, *whole_seeds):
        rng = np.random.default_rng([seed, 14])
        for layout in layouts:
            for fin in (None, *layout.names) if seed in seeds else (None,):
                at = float(rng.uniform(QUIET_S, trajectory.duration_s - QUIET_S))
                speed, heading = rng.uniform(0.0, CURRENT_M_S), rng.uniform(0.0, 2 * math.pi)
                current = (speed * math.cos(heading), speed * math.sin(heading), 0.0)
                cases.append((seed, layout, fin, at, current))
    losses, steer = [], PATH_CONTROLLERS[controller]
    for seed, layout, fin, at, current in progress(cases, "swim"):
        failures = [] if fin is None else [FinFault(fin, at)]
        options: dict[str, Any] = {
            "failures": failures,
            "water": SteadyCurrent(current),
            "plant": plant,
            "seed": seed,
        }
        told = None
        if fin is not None:
            told = ClosedLoop(layout, allocator, trajectory, steer(layout), **options).run()
        for reports in feedback:
            monitor = TimedMonitor(layout)
            swim = ClosedLoop(
                layout,
                allocator,
                trajectory,
                steer(layout),
                announced=False,
                monitor=monitor,
                servo_feedback=reports,
                **options,
            )
            losses.append(_loss(swim, monitor, fin, at if fin is not None else math.inf, told))
    return losses


def _loss(swim: ClosedLoop, monitor: TimedMonitor, fin: str | None, at: float, told: RunLog | None) -> Loss:
    """Swims to the end and counts."""
    names = swim.layout.names
    called: set[str] = set()
    found, right, false_alarms = math.inf, False, 0
    while not swim.done:
        tick = swim.step()
        now = set(monitor.broken)
        fresh = now - called
        if fresh and tick.time >= at and math.isinf(found):
            found, right = tick.time - at, fin in fresh
        elif fresh - {fin if tick.time >= at else None}:
            false_alarms += 1
        called = now
    log = swim.log
    pushes = False
    if fin is not None:
        soon = (log.time >= at) & (log.time < at + FOUND_WITHIN_S) & np.isfinite(log.command[:, 0, 0])
        force = plant_of(swim.layout).forces(log.command[soon])[:, names.index(fin)]
        pushes = bool(np.linalg.norm(force, axis=-1).mean() >= PUSHES_N) if soon.any() else True
    return Loss(
        layout=swim.layout.name,
        feedback=swim.servo_feedback,
        fin=fin,
        found_s=found,
        right=right,
        pushes=pushes,
        false_alarms=false_alarms,
        whole_s=min(at, swim.time),
        ate=absolute_error(log.position, log.reference),
        ate_announced=math.nan if told is None else absolute_error(told.position, told.reference),
        tick_ms=1e3 * monitor.spent_s / log.n_ticks,
    )


def monitoring_rows(losses: Sequence[Loss]) -> list[Row]:
    """One row per layout, and one over all, without and with what servos report.

    `found` is the share within `FOUND_WITHIN_S`, `right` that of the right fin among those found at any time.
    """
    rows = []
    for feedback in dict.fromkeys(loss.feedback for loss in losses):
        chosen = [loss for loss in losses if loss.feedback == feedback]
        for layout in (*dict.fromkeys(loss.layout for loss in chosen), "all"):
            mine = [loss for loss in chosen if layout in (loss.layout, "all")]
            rows.append({"layout": layout, "servos": "report" if feedback else "silent", **_figures(mine)})
    return rows


def _figures(losses: Sequence[Loss]) -> Row:
    lost = [loss for loss in losses if loss.fin is not None]
    found = [loss for loss in lost if math.isfinite(loss.found_s)]
    pushing = [loss for loss in lost if loss.pushes]
    hours = sum(loss.whole_s for loss in losses) / 3600.0
    alarms = sum(loss.false_alarms for loss in losses)
    return {
        "losses": len(lost),
        "found": _share(loss.found_s <= FOUND_WITHIN_S for loss in lost),
        "pushing": len(pushing),
        "found_pushing": _share(loss.found_s <= FOUND_WITHIN_S for loss in pushing),
        "right": _share(loss.right for loss in found),
        "found_s": float(np.median([loss.found_s for loss in found])) if found else None,
        "hours": hours,
        "false_alarms": alarms,
        "false_per_hour": alarms / hours,
        "ate": float(np.mean([loss.ate for loss in lost])),
        "ate_ratio": sum(loss.ate for loss in lost) / sum(loss.ate_announced for loss in lost),
        "tick_ms": float(np.mean([loss.tick_ms for loss in losses])),
    }


def _share(values: Iterable[bool]) -> float | None:
    every = list(values)
    return sum(every) / len(every) if every else None
