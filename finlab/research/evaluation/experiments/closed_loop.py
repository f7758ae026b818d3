"""Figures of single swims as rows, and means over seeds, for all closed-loop experiments.

Absolute and relative trajectory error after J. Sturm et al., A Benchmark for the Evaluation of
RGB-D SLAM Systems, IROS 2012. Robot and reference share one world frame and one clock, so nothing
is aligned and samples are paired by time. Only positions count: the reference prescribes no
attitude.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student_t

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.files.worker import in_worker
from finlab.layout import Layout, load_layout
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.method_specs import MethodSpec
from finlab.research.executor import map_parts
from finlab.swim.control import make_controller, steerable_loss
from finlab.swim.simulation import ClosedLoop, RunLog, Trajectory

RTE_DELTA_S = 5.0
"""Time between the two ends of a piece of path that the relative error compares [s]."""
LOST_M = 1.0
"""A robot that is ever farther than this from its reference has lost it."""


class SwimCase(NamedTuple):
    """One robot along one path, allocated by a method, steered by a controller, with or without
    losses."""

    layout: Layout
    path: Trajectory
    method: str
    controller: str
    lost: tuple[str, ...] = ()
    """Names of the actuators that are lost, announced."""
    lost_s: float = 0.0
    """When they are lost [s]."""
    seed: int = 0
    """Of the noise."""


SwimKey = tuple[Any, ...]
"""What a row is of."""


def repeated(
    methods: Mapping[str, MethodSpec],
    cases: Sequence[tuple[SwimKey, SwimCase]],
    seeds: Sequence[int],
    what: str,
    row_of: Callable[[RunLog], Row],
) -> list[tuple[SwimKey, list[Row]]]:
    """Each case with what `row_of` makes of its swim with each seed, on the cluster where there is
    one."""
    swims = [swim._replace(seed=seed) for _, swim in cases for seed in seeds]
    rows = map_parts(partial(_row, methods, row_of), swims, what, "swim")
    return [(case, list(islice(rows, len(seeds)))) for case, _ in cases]


def _row(methods: Mapping[str, MethodSpec], row_of: Callable[[RunLog], Row], swim: SwimCase) -> Row:
    """Runs one swim by its method and controller, and returns what `row_of` makes of its log."""
    allocator = methods[swim.method].on(swim.layout)
    law = make_controller(swim.controller, swim.layout)
    lost = [(name, swim.lost_s) for name in swim.lost]
    return row_of(
        ClosedLoop(swim.layout, allocator, swim.path, law, failures=lost, seed=swim.seed).run()
    )


def absolute_error(position: Array, reference: Array) -> float:
    """ATE: root mean square of the distance between positions (N, 3) and reference (N, 3) [m],
    world frame."""
    return float(np.sqrt(np.square(position - reference).sum(axis=-1).mean()))


def relative_error(position: Array, reference: Array, delta: int) -> float:
    """RTE: root mean square difference of the displacements over `delta` samples, all pairs [m].
    Raises DataError: there are no two samples that far apart."""
    if not 0 < delta < len(position):
        raise DataError(
            f"relative error: expected a step of 1 to {len(position) - 1} samples, got {delta}"
        )
    error = position - reference
    return absolute_error(error[delta:], error[:-delta])


def depth_error(position: Array, reference: Array) -> float:
    """Root mean square error of the depth [m] of positions (N, 3) beside a reference (N, 3) [m],
    world frame."""
    return float(np.sqrt(np.square(position[:, 2] - reference[:, 2]).mean()))


def speed_error(log: RunLog) -> Array:
    """Size of the error of the speed ahead at each tick (N,) [m/s]."""
    return np.asarray(np.abs(log.motion[:, 0] - log.reference_surge))


def follow_row(log: RunLog) -> Row:
    """Errors of one run along a trajectory [m], power [W] and time; a run that is shorter than the
    piece of the relative error counts as one piece."""
    position = log.position
    reference = log.reference
    piece = round(RTE_DELTA_S / float(log.time[1] - log.time[0]))
    return {
        "ate": absolute_error(position, reference),
        "rte": relative_error(position, reference, min(piece, log.n_ticks - 1)),
        "depth_rmse": depth_error(position, reference),
        "max": float(np.linalg.norm(position - reference, axis=1).max()),
        **power_row(log),
    }


def power_row(log: RunLog) -> Row:
    """Mean power of all fins [W] by both measures, and the median time of an allocation."""
    return {
        "inertial_w": float(log.inertial_power.sum(axis=1).mean()),
        "driving_w": float(log.driving_power.sum(axis=1).mean()),
        "solve_ms": float(np.median(log.solve_ms)),
    }


def over_seeds(rows: Sequence[Row]) -> Row:
    """Mean of each number over runs, under `<name>_std` its spread (0 for a single run), and under
    `<name>_interval` where the mean of as many other runs lands; of a single run none."""
    means: Row = {}
    for key in [key for key, value in rows[0].items() if isinstance(value, float)]:
        values = np.array([row[key] for row in rows])
        means[key] = float(values.mean())
        means[f"{key}_std"] = float(values.std(ddof=min(1, len(rows) - 1)))
        if len(rows) > 1:
            means[f"{key}_interval"] = list(_seed_interval(values))
    return means


def _seed_interval(values: Array) -> tuple[float, float]:
    """Where the mean of as many runs with other seeds lands, 95 times of 100, of values (N,).

    The difference of two such means has sqrt(2/N) times the standard deviation of a run, which is
    estimated from N - 1 degrees of freedom (Student's t).
    """
    count = len(values)
    spread = float(values.std(ddof=1)) * math.sqrt(2.0 / count)
    half_width = float(student_t.ppf(0.975, count - 1)) * spread
    mean = float(values.mean())
    return mean - half_width, mean + half_width


def mean_rows(keys: Sequence[str], done: Iterable[tuple[SwimKey, Sequence[Row]]]) -> list[Row]:
    """One row for each case, a value for each key, of the rows of its runs."""
    return [
        {**dict(zip(keys, case, strict=True)), "runs": len(rows), **over_seeds(rows)}
        for case, rows in done
    ]


def with_losses(
    layouts: Sequence[str], counts: Sequence[int]
) -> tuple[list[tuple[Layout, int, tuple[str, ...]]], list[tuple[Layout, int]]]:
    """For each file or shipped name and number of fins the first that may be lost so that the robot
    can be steered, and those robots and numbers of which all are needed. Numbers that leave no fin
    are left out. Raises DataError: a negative number."""
    if min(counts) < 0:
        raise DataError(f"lost: expected numbers from 0, got {min(counts)}")
    robots = [in_worker(load_layout, name) for name in layouts]
    cases = [(each, n, steerable_loss(each, n)) for each in robots for n in counts if n < each.n]
    able = [(each, n, lost) for each, n, lost in cases if lost is not None]
    return able, [(each, n) for each, n, lost in cases if lost is None]


MEASURES = (
    "finlab/actuators/fin/fin_laws.py",
    "finlab/physics/plant.py",
    "finlab/swim/control/body_frame.py",
    "finlab/swim/control/tracking_controller.py",
    "finlab/swim/simulation/closed_loop.py",
    "finlab/swim/simulation/task.py",
    "finlab/swim/simulation/truth.py",
    "finlab/swim/vehicle",
    "finlab/research/evaluation/experiments/closed_loop.py",
)
"""What decides the rows of swims, beside the methods."""
OTHER_SIMULATOR = "The paper's runs took place in another simulator, on a path that is not printed."
"""Why figures of paths cannot be compared."""
POOL = "The paper's robot swam in a pool."
"""Why figures of the paper's own robot cannot be compared."""
PRINTED_KEYS = {"ate": "ATE", "rte": "RTE", "depth_rmse": "depth RMSE"}
"""Figures of paths that the paper prints, in words."""
POWER = (
    Column("inertial_w", "inertial power", "three", unit="W"),
    Column("driving_w", "with motor losses", "three", unit="W"),
)
"""Columns of `power_row`."""
ERRORS = (
    Column("ate", "ATE", "metres", "ate_interval", unit="m"),
    Column("rte", "RTE", "metres", unit="m"),
    Column("depth_rmse", "depth RMSE", "metres", unit="m"),
)
"""Columns of `follow_row`."""
ABOUT_ERRORS = (
    "ATE: root mean square distance to the reference, nothing aligned; RTE: of displacements over "
    f"{RTE_DELTA_S:g} s. Intervals: where as many runs with other noise land, 95 times of 100. "
    "Inertial power is the paper's sum "
    "of I alpha omega, of its magnitudes."
)
