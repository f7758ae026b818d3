"""Every method through the hard days, with one controller for all."""

import time
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import islice, product

import numpy as np

from finlab.axes import command_change
from finlab.layout import load_layout
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import Experiment, check_names
from finlab.research.evaluation.experiments.closed_loop import (
    ABOUT_ERRORS,
    LOST_M,
    MEASURES,
    follow_row,
)
from finlab.research.evaluation.experiments.hard_days import HARD_DAYS, HardDay, HardDaySwim
from finlab.research.evaluation.method_specs import MethodSpec, load_method_specs
from finlab.research.executor import map_parts
from finlab.swim.control.contract import LEVER_M
from finlab.swim.simulation import RunLog

DAYS = {day.name: day for day in HARD_DAYS}
REPORTED = (
    *(
        "nominal",
        "damping-double",
        "parameters-high",
        "current",
        "buoyant",
        "late",
        "station",
        "hexa",
    ),
    *(
        "fins-mixed",
        "weak",
        "lost-one-unannounced",
        "lost-two",
        "restricted",
        "saturated",
        "offset",
    ),
)
"""Days of the whole report, which has a quarter of an hour."""
GAP_N = 0.1
"""A tick whose wrench misses what was asked by more than this, torques as forces at `LEVER_M`,
counts as out of reach [N]."""
FIGURES = (
    "ate",
    "rte",
    "depth_rmse",
    "driving_w",
    "peak_w",
    "out_of_reach",
    "cpu_s_per_min",
    "turn",
)
"""All figures of a swim."""
LARGEST = ("turn", "peak_w")
"""Those of which a row has the largest of its swims, not the mean."""


def run(
    scenarios: tuple[str, ...] = tuple(DAYS),
    methods: tuple[str, ...] = ("dual", "analytic"),
    seeds: int = 5,
    checkpoint: str | None = None,
    seed: int = 0,
) -> Iterator[Row]:
    """One row for each day and method, as soon as it is known; of robots that a method takes.

    dual and analytic take two minutes of the processor each per seed.

    Args:
        scenarios: names of days.
        methods: names as in eval wrench; slow ones (sqp, paper) are best tried on a few scenarios.
        seeds: how many.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: the first seed of noise, biases and mixed fins.
    """
    check_names("scenarios", scenarios, DAYS)
    specs = load_method_specs(methods, checkpoint)
    for day in map(DAYS.__getitem__, scenarios):
        robots = [load_layout(name) for name in day.layouts]
        taken = {
            name: spec for name, spec in specs.items() if all(map(spec.choice.kind.fits, robots))
        }
        yield from day_rows(day, taken, range(seed, seed + seeds))


def day_rows(day: HardDay, methods: Mapping[str, MethodSpec], seeds: Sequence[int]) -> list[Row]:
    """One row per method: means over its swims, and the largest steps and peaks; hopeless cases are
    left out."""
    cases = [case for case in day.cases() if not day.is_hopeless(case)]
    parts = list(product(methods, cases, seeds))
    done = map_parts(partial(_swim, day, methods), parts, day.name, "swim")
    rows = list[Row]()
    for method in methods:
        swims = list(islice(done, len(parts) // len(methods)))
        row: Row = {"scenario": day.name, "method": method, "about": day.about, "swims": len(swims)}
        row["lost"] = sum(figures["max"] > LOST_M for figures in swims)
        for key in FIGURES:
            values = np.array([figures[key] for figures in swims])
            row[key] = float(values.max() if key in LARGEST else values.mean())
        rows.append(row)
    return rows


def _swim(
    day: HardDay, methods: Mapping[str, MethodSpec], part: tuple[str, HardDaySwim, int]
) -> Row:
    """Figures of one swim: of a method by its name, in a case, with a seed."""
    name, case, seed = part
    loop = day.swim(case, methods[name], seed)
    start = time.process_time()
    log = loop.run()
    return swim_figures(log, time.process_time() - start)


def swim_figures(log: RunLog, cpu_s: float) -> Row:
    """Errors [m], driving power with motor losses [W], steadiness per tick (radians and Hz), and
    cost of one swim along a trajectory, which took `cpu_s` seconds of the processor, simulation
    included."""
    minutes = log.n_ticks * float(log.time[1] - log.time[0]) / 60.0
    gap = np.linalg.norm((log.asked - log.allocated) / [1, 1, 1, LEVER_M, LEVER_M, LEVER_M], axis=1)
    turn = command_change(log.command)[..., 2]
    works = log.command[..., 0] > 0.0  # not so for lost fins, which are NaN
    return {
        **follow_row(log),
        "peak_w": float(log.driving_power.sum(axis=1).max()),
        "turn": float(turn[works[1:] & works[:-1]].max(initial=0.0)),
        "out_of_reach": float((gap > GAP_N).mean()),
        "cpu_s_per_min": cpu_s / minutes,
    }


experiment = Experiment(
    name="swims",
    question="How do methods swim on days on which body, water, sensors or fins are not as "
    "believed?",
    columns=(
        Column("scenario", "scenario", "code"),
        Column("method", "method", "code"),
        Column("swims", "swims", "count"),
        Column("ate", "ATE", "metres", unit="m"),
        Column("driving_w", "power", "three", unit="W"),
        Column("peak_w", "peak", "three", unit="W"),
        Column("lost", "lost", "count"),
        Column("turn", "turn", "ratio", unit="rad"),
        Column("out_of_reach", "out of reach", "share"),
        Column("cpu_s_per_min", "CPU per min", "three", unit="s"),
    ),
    run=run,
    note=f"{ABOUT_ERRORS} Means over swims; peaks and turns (of a zero direction from tick to "
    "tick) are the largest. Power with the motors' losses. Lost: swims that were ever farther "
    f"than {LOST_M:g} m away. Out of reach: ticks at which commands miss more than {GAP_N:g} N of "
    f"what is asked, torques at {LEVER_M:g} m. Processor's time with the simulation's. What the "
    "days are: `finlab/research/evaluation/experiments/hard_days.py`.",
    pieces=("scenarios", "methods"),
    measures=(
        *MEASURES,
        "finlab/research/evaluation/experiments/hard_days.py",
        "finlab/research/evaluation/experiments/swims.py",
    ),
    quick={
        "scenarios": ("nominal", "current", "lost-one"),
        "methods": ("dual", "analytic"),
        "seeds": 1,
    },
    usual={"scenarios": REPORTED, "seeds": 1, "methods": ("dual", "analytic")},
)
