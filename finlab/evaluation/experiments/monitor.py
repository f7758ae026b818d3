"""How soon and how surely a `FaultMonitor` finds a loss that is not announced, and what that costs."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from finlab.control import FaultMonitor, TrackingController
from finlab.evaluation.experiment import Experiment
from finlab.evaluation.experiments.closed_loop import absolute_error
from finlab.evaluation.method_specs import MethodSpec, load_method_spec
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.layout import Layout, load_layout
from finlab.sim import ClosedLoop, FinFault, SteadyCurrent, Trajectory, make_trajectory

FOUND_WITHIN_S = 3.0
"""Time in which a loss should be found [s]."""
QUIET_S = 10.0
"""Neither in the first nor in the last seconds of a swim is a fin lost [s]."""
CURRENT_M_S = 0.05
"""Fastest current, whatever its heading [m/s]."""
GOALS = (
    "Aimed at: 95 % found within 3 s, 99 % of them the right fin, at most one false alarm an hour, an error "
    "of at most 1.1 times that of the announced loss."
)


class Loss(NamedTuple):
    """One swim with a monitor; times in s, errors in m."""

    layout: str
    fin: str | None  # the fin that is lost, if one is
    found_s: float  # from the loss until a fin is called lost; infinite where none is
    right: bool  # whether it is the one
    false_alarms: int  # how often a whole fin is called lost
    whole_s: float  # time during which all fins are whole
    ate: float  # absolute trajectory error
    ate_announced: float  # that of the same swim with the loss announced; NaN where nothing is lost


def run(
    layouts: tuple[str, ...] = ("A", "B", "C", "D"),
    trajectory: str = "lissajous",
    method: str = "dual",
    seeds: int = 4,
    seed: int = 0,
) -> list[Row]:
    """One row for each layout, and one over all.

    A seed takes about two minutes with four layouts.

    Args:
        layouts: names or files.
        trajectory: circle, lissajous, square, dive, station, or a CSV file with the columns t, x, y, z.
        method: who allocates.
        seeds: how many; each loses every fin of every layout once, at a random time in a random current, and
            swims once without a loss.
        seed: the first seed of times, currents and noise.
    """
    robots, path = [load_layout(name) for name in layouts], make_trajectory(trajectory)
    spec = load_method_spec(method)
    cases: list[tuple[int, Layout, str | None]] = [
        (each, robot, fin)
        for each in range(seed, seed + seeds)
        for robot in robots
        for fin in (None, *robot.names)
    ]
    losses = []
    for each, robot, fin in progress(cases, "swim"):
        losses.append(swim_loss(robot, fin, path, spec, each))
    return monitoring_rows(losses)


def swim_loss(
    layout: Layout,
    fin: str | None,
    trajectory: Trajectory,
    method: MethodSpec,
    seed: int,
) -> Loss:
    """One loss, or none; the seed draws time, current and noise."""
    rng = np.random.default_rng([seed, 14, 0 if fin is None else 1 + layout.index(fin)])
    at = float(rng.uniform(QUIET_S, trajectory.duration_s - QUIET_S))
    speed, heading = rng.uniform(0.0, CURRENT_M_S), rng.uniform(0.0, 2 * math.pi)
    current = SteadyCurrent((speed * math.cos(heading), speed * math.sin(heading), 0.0))
    allocator = method.on(layout)

    def loop(monitor: FaultMonitor | None) -> ClosedLoop:
        return ClosedLoop(
            layout,
            allocator,
            trajectory,
            TrackingController(layout),
            water=current,
            failures=[] if fin is None else [FinFault(fin, at)],
            announced=monitor is None,
            monitor=monitor,
            seed=seed,
        )

    announced_ate = math.nan
    if fin is not None:
        log = loop(None).run()
        announced_ate = absolute_error(log.position, log.reference)
    monitor = FaultMonitor(layout)
    return _loss(loop(monitor), monitor, fin, math.inf if fin is None else at, announced_ate)


def _loss(swim: ClosedLoop, monitor: FaultMonitor, fin: str | None, at: float, announced_ate: float) -> Loss:
    """Swims to the end and counts."""
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
    return Loss(
        swim.layout.name,
        fin,
        found,
        right,
        false_alarms,
        whole_s=min(at, swim.time),
        ate=absolute_error(log.position, log.reference),
        ate_announced=announced_ate,
    )


def monitoring_rows(losses: Sequence[Loss]) -> list[Row]:
    """One row per layout, and one over all.

    `found` is the share within `FOUND_WITHIN_S`, `right` that of the right fin among those found at any time.
    """
    return [
        {"layout": layout, **_figures([loss for loss in losses if layout in (loss.layout, "all")])}
        for layout in (*dict.fromkeys(loss.layout for loss in losses), "all")
    ]


def _figures(losses: Sequence[Loss]) -> Row:
    lost = [loss for loss in losses if loss.fin is not None]
    found = [loss for loss in lost if math.isfinite(loss.found_s)]
    hours = sum(loss.whole_s for loss in losses) / 3600.0
    alarms = sum(loss.false_alarms for loss in losses)
    return {
        "losses": len(lost),
        "found": _share(loss.found_s <= FOUND_WITHIN_S for loss in lost),
        "right": _share(loss.right for loss in found),
        "found_s": float(np.median([loss.found_s for loss in found])) if found else None,
        "hours": hours,
        "false_alarms": alarms,
        "false_per_hour": alarms / hours,
        "ate": float(np.mean([loss.ate for loss in lost])),
        "ate_ratio": sum(loss.ate for loss in lost) / sum(loss.ate_announced for loss in lost),
    }


def _share(values: Iterable[bool]) -> float | None:
    every = list(values)
    return sum(every) / len(every) if every else None


experiment = Experiment(
    name="monitor",
    question="How soon and how surely is a fin found that is lost without an announcement?",
    columns=(
        Column("layout", "layout"),
        Column("losses", "losses", "count"),
        Column("found", f"found within {FOUND_WITHIN_S:g} s", "share"),
        Column("right", "right fin", "share"),
        Column("found_s", "found after", "three", unit="s"),
        Column("hours", "whole", "three", unit="h"),
        Column("false_alarms", "false alarms", "count"),
        Column("ate", "ATE", "metres", unit="m"),
        Column("ate_ratio", "over announced", "ratio"),
    ),
    run=run,
    note=f"A random moment, a steady current of up to {CURRENT_M_S:g} m/s, noisy sensors. {GOALS}",
    quick={"layouts": ("A",), "seeds": 1},
    full={"layouts": ("A", "C"), "seeds": 1},
)
