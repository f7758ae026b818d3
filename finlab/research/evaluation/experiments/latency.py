"""Time of one call: near and far from the limits of robots, out of reach and from tick to tick.

Methods answer the same targets in one run, the default one beside IPOPT. All times are the
processor's.
"""

import math
import re
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, paper_figures, progress
from finlab.research.evaluation.method_specs import (
    MethodSpec,
    can_run,
    load_method_spec,
    load_method_specs,
)
from finlab.research.random_layouts import random_layout, random_robot, random_thruster

DOMAIN = 0xF1257
"""Leads the seed of every robot."""
REFERENCE = "dual"
"""The method that the others are compared with, where it takes part."""
LAYOUTS = 5
"""Robots of each kind whose calls are timed."""
TARGETS = 40
"""Directions of wrenches on each of them."""
WARM_UP = 2
"""First calls on each robot that are not counted; a robot keeps its layout for long."""
FAR = 1e3
"""How many times a wrench lies beyond its robot's reach for certain."""
DIRECTION_STEP = 0.05
"""Share of the way to the next direction by which a target moves from tick to tick."""
REACH_SHARE = 0.6
"""Size of targets that wander, as a share of reach."""
_ROBOT = re.compile(r"(fins|thrusters)-(\d{1,2})")


class Timed(NamedTuple):
    """A robot, and the largest wrenches (N, 6) [N, N m] that it delivers in drawn directions."""

    layout: Layout
    rim: Array


def run(
    robots: tuple[str, ...] = ("fins-4", "fins-8", "thrusters-4", "thrusters-8"),
    methods: tuple[str, ...] = (REFERENCE, "ipopt"),
    reach: tuple[float, ...] = (0.3, 0.9, 0.98, 1.5),
    calls: int = 200,
    budget: float = 2.0,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each robot, call and method that takes such a robot. Raises DataError: a robot or
    a reach that is none.

    Args:
        robots: fins-N or thrusters-N, random ones of so many.
        methods: names as in eval wrench; left out where their package is missing.
        reach: targets over the most that the robot gives in their direction.
        calls: of each method.
        budget: seconds of the processor after which a slow method stops.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of robots and targets.
    """
    kinds = {name: _ROBOT.fullmatch(name) for name in robots}
    if wrong := [
        name for name, kind in kinds.items() if kind is None or not 2 <= int(kind[2]) <= 64
    ]:
        raise DataError(
            f"robots: expected fins-N or thrusters-N, N from 2 to 64, got {wrong[0]!r:.60}"
        )
    if min(reach) <= 0.0:
        raise DataError(f"reach: expected numbers above 0, got {min(reach):g}")
    specs = load_method_specs(
        [name for name in methods if can_run(name)] or [REFERENCE], checkpoint
    )
    ours = load_method_spec(REFERENCE, checkpoint)
    rows = list[Row]()
    for name, kind in kinds.items():
        assert kind is not None
        timed = [_robot(ours, kind[1], int(kind[2]), seed, k) for k in range(LAYOUTS)]
        able = {
            each: spec for each, spec in specs.items() if spec.choice.kind.fits(timed[0].layout)
        }
        for share in (*reach, None):
            rows += _rows(name, timed, able, share, calls, budget)
    return rows


def _robot(method: MethodSpec, kind: str, count: int, seed: int, k: int) -> Timed:
    """Robot k of a kind: fins of U-CAT's law with horizontal shafts, or any thrusters."""
    rng = np.random.default_rng([DOMAIN, seed, len(kind), count, k])
    name = f"{kind}-{count}"
    ends = (count, count)
    fins = kind == "fins"
    layout = (
        random_layout(rng, name, ends)
        if fins
        else random_robot(rng, name, ends, (random_thruster,))
    )
    plant = plant_of(layout)
    allocator = method.on(layout)
    wrenches = plant.wrench(plant.sample(rng, (TARGETS,)))
    return Timed(layout, allocator.allocate_batch(FAR * wrenches, policy="direction").wrench)


def _rows(
    name: str,
    timed: Sequence[Timed],
    methods: dict[str, MethodSpec],
    share: float | None,
    calls: int,
    budget: float,
) -> list[Row]:
    """A row for each method; without a share of reach, targets wander and the command before is
    known."""
    what = f"{share:g} of reach" if share is not None else "next tick"
    rows = list[Row]()
    answers = dict[str, list[Allocation]]()
    for method, spec in progress(methods.items(), "method", f"{name}, {what}"):
        times, answers[method] = call_times(spec, timed, share, calls, budget)
        middle, high = (float(np.quantile(times, q)) for q in (0.5, 0.99))
        about: Row = {"robot": name, "call": what, "method": method, "calls": len(times)}
        rows.append(about | {"p50_ms": middle, "p99_ms": high})
    for row in rows if REFERENCE in answers else ():
        row["p50_over_dual"] = row["p50_ms"] / rows[list(answers).index(REFERENCE)]["p50_ms"]
        pairs = zip(answers[row["method"]], answers[REFERENCE], strict=False)
        watts = np.array(
            [(mine.power, best.power) for mine, best in pairs if mine.reachable and best.reachable]
        )
        row["power_over_dual"] = watts[:, 0].sum() / watts[:, 1].sum() if len(watts) else math.nan
    for row in rows:
        row["delivered"] = float(np.mean([answer.reachable for answer in answers[row["method"]]]))
    return rows


def call_times(
    method: MethodSpec, timed: Sequence[Timed], share: float | None, calls: int, budget: float
) -> tuple[list[float], list[Allocation]]:
    """The processor's time of each counted call [ms], at most so many, of robots visited in turn,
    and its answer. Without a share of reach targets wander, with the command of the tick before.
    After its part of the budget [s] a robot gets no further call."""
    times = list[float]()
    answers = list[Allocation]()
    ahead = -(-calls // len(timed))
    for robot in timed:
        allocator = method.on(robot.layout)
        spent = 0.0
        previous = None
        for k in range(WARM_UP + min(ahead, calls - len(times))):
            target = _wandering(robot.rim, k) if share is None else share * robot.rim[k % TARGETS]
            start = time.process_time()
            answer = allocator.allocate(target, previous=previous)
            took = time.process_time() - start
            previous = answer if share is None else None
            if k >= WARM_UP:
                times.append(1e3 * took)
                answers.append(answer)
                spent += took
                if spent > budget / len(timed):
                    break
    return times, answers


def _wandering(rim: Array, tick: int) -> Array:
    """The target (6,) at a tick: on the straight way from one direction to the next."""
    corner, fraction = divmod(DIRECTION_STEP * tick, 1.0)
    begin = rim[int(corner) % len(rim)]
    end = rim[(int(corner) + 1) % len(rim)]
    return np.asarray(REACH_SHARE * ((1.0 - fraction) * begin + fraction * end))


def _printed(_: Sequence[Row]) -> list[Row]:
    """The time of a cycle that the paper prints."""
    cycle_ms = paper_figures()["inference"]["cycle_s"] * 1e3
    return [
        {
            "method": "paper",
            "call": "cycle on a Jetson Orin Nano, printed in the paper",
            "p50_ms": cycle_ms,
        }
    ]


experiment = Experiment(
    name="latency",
    question="How long does one call take, by the processor's time?",
    columns=(
        Column("robot", "robot"),
        Column("call", "call"),
        Column("method", "method", "code"),
        Column("calls", "calls", "count"),
        Column("p50_ms", "median", "three", unit="ms"),
        Column("p99_ms", "99th percentile", "three", unit="ms"),
        Column("p50_over_dual", "times that of dual", "three"),
        Column("delivered", "delivered", "share"),
        Column("power_over_dual", "power over dual's", "ratio"),
    ),
    run=run,
    note=(
        "Whole calls of allocate, one target each, one after the other. Reach: the most that a "
        "robot gives in the direction of the target; beyond it, methods answer with the nearest "
        f"wrench. Next tick: targets wander at {REACH_SHARE:g} of reach, and the command before is "
        "known, whose rates `dual` and `mdn` alone keep to. Power: where both deliver."
    ),
    pieces=("robots",),
    measures=(
        "finlab/allocation/dual",
        "finlab/core/src",
        "finlab/research/evaluation/experiments/latency.py",
    ),
    quick={"robots": ("fins-4", "thrusters-8"), "calls": 20, "budget": 0.5},
    usual={
        "methods": (REFERENCE, "mdn", "paper", "analytic", "qp", "sqp", "px4", "ipopt"),
        "budget": 1.0,
    },
    printed=_printed,
)
