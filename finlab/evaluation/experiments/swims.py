"""Every method through the suite of hard days, with one controller for all, and who leads where."""

import time
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.control.completion import LEVER_M
from finlab.evaluation.experiments.closed_loop_runs import LOST_M, Row, follow_row
from finlab.evaluation.experiments.hard_days import HardDay, Kind
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.bootstrap import Interval, mean_interval, spread_interval
from finlab.layout.angles import command_change
from finlab.sim import RunLog

GAP_N = 0.1
"""A tick whose wrench misses what was asked by more than this, torques as forces at `LEVER_M`, counts as out
of reach [N]."""
OURS = ("search", "mdn")
"""Beginnings of our methods' names; all others are baselines."""
TITLES = {"ate": "error", "driving_w": "power"}
"""What methods are compared by with the best baseline, in words."""
GOALS: dict[Kind, dict[str, float]] = {
    "nominal": {"ate": 0.95, "driving_w": 0.95},
    "law kept": {"ate": 1.02, "driving_w": 1.02},
    "hard": {"ate": 0.7},
}
"""Largest ratio to the best baseline that is aimed at, by kind of day."""
FIGURES = (
    *("ate", "rte", "depth_rmse", "driving_w", "peak_w", "out_of_reach", "rests_per_min", "cpu_s_per_min"),
    *("turn", "frequency_step", "amplitude_step"),
)
"""All figures of a swim."""
LARGEST = ("turn", "frequency_step", "amplitude_step", "peak_w")
"""Those of which a row has the largest of its swims, not the mean."""


class Swim(NamedTuple):
    """One swim and its figures."""

    scenario: str
    """Name of the day."""
    method: str
    """Name of the method."""
    layout: str
    """The robot."""
    fins: tuple[str, ...]
    """Fins that were weak or lost."""
    seed: int
    """Of noise, biases, waves and mixed fins."""
    figures: Row
    """Those of `swim_figures`."""


def swim_figures(log: RunLog, cpu_s: float) -> Row:
    """Errors [m], driving power with motor losses [W], steadiness per tick (radians and Hz), and cost.

    Args:
        log: one swim along a trajectory.
        cpu_s: processor's time that it took, simulation included [s].
    """
    minutes = log.n_ticks * float(log.time[1] - log.time[0]) / 60.0
    gap = np.linalg.norm((log.asked - log.allocated) / [1, 1, 1, LEVER_M, LEVER_M, LEVER_M], axis=1)
    step = command_change(log.command)
    works = log.command[..., 0] > 0.0  # not so for lost fins, which are NaN
    told = np.isfinite(log.command[..., 0])
    both, kept = works[1:] & works[:-1], told[1:] & told[:-1]
    return {
        **follow_row(log),
        "peak_w": float(log.driving_power.sum(axis=1).max()),
        "turn": _largest(step[..., 2], both),
        "frequency_step": _largest(step[..., 1], both),
        "amplitude_step": _largest(step[..., 0], kept),
        "rests_per_min": float(((works[1:] != works[:-1]) & kept).sum() / minutes),
        "out_of_reach": float((gap > GAP_N).mean()),
        "cpu_s_per_min": cpu_s / minutes,
    }


def _largest(values: Array, where: NDArray[np.bool_]) -> float:
    return float(values[where].max(initial=0.0))


def swim_all(
    days: Sequence[HardDay],
    methods: Mapping[str, Allocator],
    seeds: Sequence[int],
    *,
    controller: str = "tracking",
) -> list[Swim]:
    """Every day with every method and seed; hopeless cases are left out (`not_swum`).

    Args:
        days: of `HARD_DAYS`.
        methods: allocators by name.
        seeds: at least one; the same noise for every method.
        controller: one of `finlab.control.PATH_CONTROLLERS`, for all methods.
    """
    cases = [(day, case) for day in days for case in day.cases() if day.obstacle(case) is None]
    swims = []
    for (day, case), (name, allocator), seed in progress(
        list(product(cases, methods.items(), seeds)), "swim", "hard days"
    ):
        loop = day.swim(case, allocator, seed, controller=controller)
        start = time.process_time()
        log = loop.run()
        figures = swim_figures(log, time.process_time() - start)
        swims.append(Swim(day.name, name, case.layout, case.fins, seed, figures))
    return swims


def not_swum(days: Sequence[HardDay]) -> list[Row]:
    """The cases that would be hopeless, each with its reason."""
    return [
        {"scenario": day.name, "reason": reason}
        for day in days
        for case in day.cases()
        if (reason := day.obstacle(case)) is not None
    ]


def swim_rows(swims: Sequence[Swim]) -> list[Row]:
    """One row per day and method: means over its swims, the largest steps and peaks, intervals over seeds.

    `ate_interval` and `driving_w_interval` are there from two seeds on. Our methods have `ate_ratio` and
    `driving_w_ratio` over the least of the baselines that keep their reference, with intervals of their own,
    swim against swim of the same seed, and verdicts by these.
    """
    groups: dict[tuple[str, str], list[Swim]] = {}
    for swim in swims:
        groups.setdefault((swim.scenario, swim.method), []).append(swim)
    rows = [_row(scenario, method, mine) for (scenario, method), mine in groups.items()]
    for row in rows:
        if row["method"].startswith(OURS):
            others = [other for other in rows if other["scenario"] == row["scenario"]]
            row |= _against(row, others, groups)
    return rows


def _row(scenario: str, method: str, swims: Sequence[Swim]) -> Row:
    seed = np.array([swim.seed for swim in swims])
    row: Row = {"scenario": scenario, "method": method, "swims": len(swims)}
    row["lost"] = sum(swim.figures["max"] > LOST_M for swim in swims)
    for key in FIGURES:
        values = np.array([swim.figures[key] for swim in swims])
        row[key] = float(values.max() if key in LARGEST else values.mean())
        if key in TITLES and len(set(seed.tolist())) > 1:
            row[f"{key}_interval"] = list(mean_interval(values, seed))
    return row


def _against(row: Row, rows: Sequence[Row], swims: Mapping[tuple[str, str], Sequence[Swim]]) -> Row:
    """Ratios and verdicts of one of our rows against the baselines among the rows of a scenario."""
    baselines = [other for other in rows if not other["method"].startswith(OURS)]
    keeping = [other for other in baselines if not other["lost"]]
    if not baselines:
        return {}
    if not keeping and not row["lost"]:
        return {"verdict": "the only one that keeps its path"}
    found: dict[str, Any] = {}
    words = []
    for key, title in TITLES.items():
        best = min(keeping or baselines, key=lambda other: float(other[key]))
        found |= {f"{key}_ratio": row[key] / best[key], f"{key}_best": best["method"]}
        own, other = (swims[row["scenario"], method] for method in (row["method"], best["method"]))
        if (interval := paired_interval(own, other, key)) is not None:
            found[f"{key}_ratio_interval"] = [1.0 + end / best[key] for end in interval]
            found[f"{key}_verdict"] = verdict_of(interval)
            words.append(f"{title} {found[f'{key}_verdict']}")
    lost = ["loses its path"] if row["lost"] and keeping else []
    return {**found, "verdict": ", ".join(lost + words)}


def duels(ours: Sequence[Swim], theirs: Sequence[Swim]) -> list[Row]:
    """One row per day and method: its figures as `swim_rows` has them, and ours against it alone.

    Only swims that both have swum count, so that a method may have swum fewer seeds than ours. Beside
    its own, a row has our figures under `ours_<figure>`, and from our row ratios, their intervals and
    verdicts.
    """
    mine = {_swum(swim): swim for swim in ours}
    groups: dict[tuple[str, str], list[Swim]] = {}
    for swim in theirs:
        if _swum(swim) in mine:
            groups.setdefault((swim.scenario, swim.method), []).append(swim)
    rows = []
    for group in groups.values():
        own, other = swim_rows([*(mine[_swum(swim)] for swim in group), *group])
        rows.append({**own, **other} | {f"ours_{key}": own[key] for key in FIGURES})
    return rows


def _swum(swim: Swim) -> tuple[str, str, tuple[str, ...], int]:
    """What tells a swim from others of its method."""
    return swim.scenario, swim.layout, tuple(swim.fins), swim.seed


def goal_sentences(days: Sequence[HardDay], rows: Sequence[Row]) -> list[str]:
    """For each kind of day and figure in words: which days miss what is aimed at, by which method."""
    sentences = []
    for kind, goals in GOALS.items():
        names = {day.name for day in days if day.kind == kind}
        mine = [row for row in rows if row["scenario"] in names and "verdict" in row]
        for key, goal in goals.items() if mine else ():
            missed = [
                f"`{row['method']}` on `{row['scenario']}` ({row[ratio]:.2f})"
                for row in mine
                if row.get(ratio := f"{key}_ratio", 0.0) > goal  # without a ratio no baseline keeps its path
            ]
            title = TITLES[key]
            found = (
                f"{len(mine) - len(missed)} of {len(mine)} at most {goal:g} of the best baseline's {title}"
            )
            sentences.append(
                f"Days of kind {kind!r}: {found}" + (f"; not {', '.join(missed)}" if missed else "")
            )
    return sentences


def paired_interval(own: Sequence[Swim], other: Sequence[Swim], key: str) -> Interval | None:
    """Where another seed should land: by how much a figure of one method is more than another's, each swim
    against that of the same case and seed, by Student's t over seeds; None for a single seed."""
    theirs = {(swim.layout, tuple(swim.fins), swim.seed): swim.figures[key] for swim in other}
    by_seed: dict[int, list[float]] = {}
    for swim in own:
        more = swim.figures[key] - theirs[swim.layout, tuple(swim.fins), swim.seed]
        by_seed.setdefault(swim.seed, []).append(more)
    if len(by_seed) < 2:
        return None
    means = np.array([np.mean(values) for values in by_seed.values()])
    return spread_interval(float(means.mean()), float(means.std(ddof=1)), len(means))


def verdict_of(more: Interval) -> str:
    """`better` where another seed, too, should land below nothing more, `worse` above it; else `level`."""
    if more.high < 0.0:
        return "better"
    return "worse" if more.low > 0.0 else "level"
