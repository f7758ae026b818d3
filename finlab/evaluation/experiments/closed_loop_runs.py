"""What the closed-loop experiments share: errors of single runs as rows, means over seeds.

Absolute and relative trajectory error after J. Sturm et al., A Benchmark for the Evaluation of RGB-D SLAM
Systems, IROS 2012. Robot and reference share one world frame and one clock, so nothing is aligned and samples
are paired by time. Only positions count: the reference prescribes no attitude.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.control import PATH_CONTROLLERS, VelocityController
from finlab.errors import DataError
from finlab.evaluation.progress import progress
from finlab.layout import Layout
from finlab.sim import ClosedLoop, Cruise, RunLog, Task

Row = dict[str, Any]


RTE_DELTA_S = 5.0
"""Time between the two ends of a piece of path that the relative error compares [s]."""
LOST_M = 1.0
"""A robot that is ever farther than this from its reference has lost it."""


def absolute_error(position: Array, reference: Array) -> float:
    """ATE: root mean square of the distance between positions (N, 3) and reference (N, 3) [m]."""
    return float(np.sqrt(np.square(position - reference).sum(axis=-1).mean()))


def relative_error(position: Array, reference: Array, delta: int) -> float:
    """RTE: root mean square difference of the displacements over `delta` samples, all pairs [m].

    Raises:
        DataError: there are no two samples that far apart.
    """
    if not 0 < delta < len(position):
        raise DataError(f"relative error: expected a step of 1 to {len(position) - 1} samples, got {delta}")
    error = position - reference
    return absolute_error(error[delta:], error[:-delta])


def depth_error(position: Array, reference: Array) -> float:
    """Root mean square error of the depth [m]."""
    return float(np.sqrt(np.square(position[:, 2] - reference[:, 2]).mean()))


def follow_row(log: RunLog) -> Row:
    """Errors of one run along a trajectory [m], power [W] and time; a run that is shorter than the piece of
    the relative error counts as one piece."""
    position, reference = log.position, log.reference
    piece = round(RTE_DELTA_S / float(log.time[1] - log.time[0]))
    return {
        "ate": absolute_error(position, reference),
        "rte": relative_error(position, reference, min(piece, log.n_ticks - 1)),
        "depth_rmse": depth_error(position, reference),
        "max": float(np.linalg.norm(position - reference, axis=1).max()),
        **power_row(log),
    }


def power_row(log: RunLog) -> Row:
    """Mean power of all fins [W] by all three measures, and the median time of an allocation."""
    return {
        "inertial_w": float(log.inertial_power.sum(axis=1).mean()),
        "torque_w": float(log.torque_power.sum(axis=1).mean()),
        "driving_w": float(log.driving_power.sum(axis=1).mean()),
        "solve_ms": float(np.median(log.solve_ms)),
    }


def over_seeds(rows: Sequence[Row]) -> Row:
    """Mean of each number over runs, and under `<name>_std` its spread (0 for a single run)."""
    means: Row = {}
    for key in rows[0]:
        values = np.array([row[key] for row in rows])
        means[key], means[f"{key}_std"] = float(values.mean()), float(values.std(ddof=min(1, len(rows) - 1)))
    return means


class Scenario(NamedTuple):
    """One case of an experiment, swum by every method."""

    label: Any
    """What is varied: the layout's name, a fault, a speed."""
    layout: Layout
    """The robot."""
    task: Task
    """What it swims."""
    failures: tuple[tuple[str, float], ...] = ()
    """Fins, each with the time [s] at which it is lost."""


Run = tuple[tuple[Any, str], RunLog]
"""Under (label of the scenario, name of the method)."""


def run_all(
    scenarios: Sequence[Scenario],
    allocators: Mapping[str, Allocator],
    seeds: Sequence[int],
    plant: str = "mean",
    controller: str = "waypoint",
) -> list[Run]:
    """Every scenario with every method and seed, one after the other.

    Args:
        scenarios: what is swum.
        allocators: methods by name.
        seeds: of the sensors' noise.
        plant: how fin forces are simulated.
        controller: of paths, one of `finlab.control.PATH_CONTROLLERS`, the paper's by default; speeds are
            kept by the paper's other one.
    """
    done = []
    every = list(product(scenarios, allocators.items(), seeds))
    for (label, layout, task, failures), (name, allocator), seed in progress(every, "run"):
        options: dict[str, Any] = {"failures": failures, "plant": plant, "seed": seed}
        pilot = VelocityController() if isinstance(task, Cruise) else PATH_CONTROLLERS[controller](layout)
        done.append(((label, name), ClosedLoop(layout, allocator, task, pilot, **options).run()))
    return done


def group_runs(runs: Sequence[Run], row: Callable[[RunLog], Row]) -> dict[tuple[Any, str], list[Row]]:
    """Rows of single runs by scenario and method."""
    groups: dict[tuple[Any, str], list[Row]] = {}
    for key, log in runs:
        groups.setdefault(key, []).append(row(log))
    return groups


def rows_and_totals(
    runs: Sequence[Run], row: Callable[[RunLog], Row], key: str, total: str | None
) -> list[Row]:
    """One row per scenario and method, and one per method over all scenarios: mean and spread over runs.

    Args:
        runs: at least one.
        row: figures of one run.
        key: what the scenario's label is called.
        total: label of the rows over all scenarios.
    """
    groups = group_runs(runs, row)
    for method in dict.fromkeys(method for _, method in groups):
        groups[total, method] = [one for (_, name), rows in groups.items() if name == method for one in rows]
    return [
        {key: label, "method": method, "runs": len(rows), **over_seeds(rows)}
        for (label, method), rows in groups.items()
    ]
