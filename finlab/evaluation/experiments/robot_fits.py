"""What a fit to five minutes of swimming is worth: answers for the robot as drawn and as fitted, by truth.

The robot swims on a plant that its layout knows nothing of, with noisy sensors. Targets are wrenches of
random commands; each is asked of the layout and of the fitted one, at a random speed through the water, and
what the fins then truly give is held against it. Closed loops show what that is worth to a controller.
"""

import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.control import WaypointController
from finlab.evaluation.experiments.closed_loop_runs import absolute_error, depth_error
from finlab.evaluation.experiments.true_robots import true_layout, true_wrench
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.bootstrap import ratio_interval
from finlab.evaluation.statistics.tables import Row
from finlab.fit.robot.fitted_layout import write_robot
from finlab.fit.robot.robot_fit import RobotFit, fit_robot
from finlab.fit.robot.swim_file import read_swim
from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from finlab.sim import NOISE_ALONE, ClosedLoop, make_trajectory
from finlab.sim.excite import LONGEST_S, excitation

FASTEST = np.array([0.2, 0.03, 0.06, 0.1, 0.1, 0.3])
"""Speeds through the water [m/s, rad/s] at which targets are asked lie within these, either way."""
UNDER_WAY_S = 15.0
"""Time [s] after which fins that had to turn at the start, by chance far or not, no longer rule the depth."""
COMPARED = ("depth_rmse", "depth_under_way", "torque_w")
"""Figures of closed loops that are told over those of the true model."""
DOMAIN = 0x0B07
"""Leads the seed of every draw here."""


def robot_fit_rows(
    layout: Layout, allocator: Allocator, plants: Sequence[str], *, targets: int, runs: int, seed: int
) -> list[Row]:
    """One row per plant: the error of allocations before and after the fit, and closed loops.

    Args:
        layout: the robot as drawn.
        allocator: who answers.
        plants: what the fins really do.
        targets: wrenches asked of each.
        runs: closed loops with each layout.
        seed: draws everything.
    """
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for plant in progress(list(plants), "plant"):
            folder = Path(name) / plant
            folder.mkdir()
            began = time.process_time()
            fitted, fit = _fitted(layout, plant, folder, seed)
            used = [trial.name for trial in fit.trials if trial.used]
            row: Row = {"plant": plant, "used": ", ".join(used), "fit_s": time.process_time() - began}
            row["trusted"] = "no" if fit.doubts() else "yes"
            robots = {"drawn": layout, "fitted": fitted, "true": true_layout(plant, layout, folder)}
            row |= _wrench_errors(layout, robots, allocator, plant, targets, seed)
            swims = {
                which: _closed_loops(robot, layout, allocator, plant, runs, seed)
                for which, robot in robots.items()
            }
            row["loops"] = {which: _loop_row(own, swims["true"]) for which, own in swims.items()}
            rows.append(row)
    return rows


def _fitted(layout: Layout, plant: str, folder: Path, seed: int) -> tuple[Layout, RobotFit]:
    """The layout that five minutes of swimming give, read back from its file, and the fit."""
    log = folder / "log.npz"
    excitation(layout, LONGEST_S, plant=plant, seed=seed).run().save(log)
    fit = fit_robot(layout, [read_swim(log, layout)])
    path = folder / "fitted.yaml"
    write_robot(fit, path)
    return load_layout(path), fit


def _wrench_errors(
    layout: Layout, robots: Mapping[str, Layout], allocator: Allocator, plant: str, targets: int, seed: int
) -> Row:
    """Errors of allocations for each robot by the true plant, normalized as any other."""
    rng = np.random.default_rng((DOMAIN, seed))
    drawn = plant_of(layout)
    wanted = drawn.wrench(drawn.sample(rng, (targets,)))
    velocity = rng.uniform(-FASTEST, FASTEST, (targets, 6))
    row: Row = {"targets": targets}
    for which, robot in robots.items():
        command = np.array(
            [
                allocator.allocate(robot.moving(water), target, seed=seed).command
                for target, water in zip(wanted, velocity, strict=True)
            ]
        )
        missed = true_wrench(plant, layout, command, velocity) - wanted
        error = np.linalg.norm(missed / allocator.normalization.std, axis=1)
        row |= {f"{which}_mean": float(error.mean()), f"{which}_median": float(np.median(error))}
    return row | {"times_smaller": row["drawn_mean"] / row["fitted_mean"]}


def _closed_loops(
    robot: Layout, drawn: Layout, allocator: Allocator, plant: str, runs: int, seed: int
) -> dict[str, Array]:
    """Errors [m] and power [W] of circles (runs,) by an allocator that believes in a layout.

    Sensors have noise alone: a depth sensor's bias, which no layout can mend, would hide what layouts cost.
    """
    rows = []
    for run in range(runs):
        path = make_trajectory("circle")
        options: dict[str, Any] = {"plant": plant, "truth": drawn, "sensors": NOISE_ALONE, "seed": seed + run}
        log = ClosedLoop(robot, allocator, path, WaypointController(), **options).run()
        late = log.time >= UNDER_WAY_S
        rows.append(
            {
                "ate": absolute_error(log.position, log.reference),
                "depth_rmse": depth_error(log.position, log.reference),
                "depth_under_way": depth_error(log.position[late], log.reference[late]),
                "torque_w": float(log.torque_power.sum(axis=1).mean()),
            }
        )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _loop_row(own: Mapping[str, Array], true: Mapping[str, Array]) -> Row:
    """Means over runs, and some of them over those with the true model in the same runs, with intervals."""
    row: Row = {name: float(values.mean()) for name, values in own.items()}
    for name in COMPARED:
        row[f"{name}_over_true"] = row[name] / float(true[name].mean())
        if own is not true and len(own[name]) > 1:
            ends = ratio_interval(own[name], true[name], np.arange(len(own[name])))
            row[f"{name}_over_true_interval"] = list(ends)
    return row
