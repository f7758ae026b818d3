"""What a fit to five minutes of swimming is worth: answers for the robot as drawn and as fitted, by truth.

The robot swims on a plant that its layout knows nothing of, with noisy sensors. Targets are wrenches of
random commands; each is asked of the layout and of the fitted one, at a random speed through the water, and
what the fins then truly give is held against it. Closed loops show what that is worth to a controller.
"""

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.arrays import Array
from finlab.evaluation.experiments.closed_loop_runs import follow_row, over_seeds
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.tables import Row
from finlab.fit.robot.fitted_layout import write_robot
from finlab.fit.robot.robot_fit import RobotFit, fit_robot
from finlab.fit.robot.swim_file import read_swim
from finlab.layout import FinModelSpec, Layout, load_layout
from finlab.physics import TableLaw, plant_of, write_table
from finlab.physics.fin_motion import FinMotion
from finlab.sim import ClosedLoop, make_trajectory
from finlab.sim.excite import LONGEST_S, excitation
from finlab.sim.fin_force import FinForce, FlexibleForce
from finlab.sim.offset import ASKEW, CENTER
from finlab.sim.plants import make_plant

FASTEST = np.array([0.2, 0.03, 0.06, 0.1, 0.1, 0.3])
"""Speeds through the water [m/s, rad/s] at which targets are asked lie within these, either way."""
SETTLE_S, MEAN_S = 2.0, 10.0
"""Time after which, and over which, forces are averaged that swing within the beat."""
TABLE = 9
"""Amplitudes and frequencies at which the mean law of a soft fin is tabulated."""
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
            row |= _wrench_errors(layout, fitted, allocator, plant, targets, seed)
            robots = {"drawn": layout, "fitted": fitted, "true": true_layout(plant, layout, folder)}
            loops = {
                which: _closed_loop(robot, layout, allocator, plant, runs, seed)
                for which, robot in robots.items()
                if robot is not None
            }
            for loop in loops.values() if "true" in loops else ():
                loop["depth_over_true"] = loop["depth_rmse"] / loops["true"]["depth_rmse"]
                loop["power_over_true"] = loop["torque_w"] / loops["true"]["torque_w"]
            rows.append(row | {"loops": loops})
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
    layout: Layout, fitted: Layout, allocator: Allocator, plant: str, targets: int, seed: int
) -> Row:
    """Errors of allocations by the true plant, normalized as any other."""
    rng = np.random.default_rng((DOMAIN, seed))
    drawn = plant_of(layout)
    wanted = drawn.wrench(drawn.sample(rng, (targets,)))
    velocity = rng.uniform(-FASTEST, FASTEST, (targets, 6))
    row: Row = {"targets": targets}
    for which, robot in (("before", layout), ("after", fitted)):
        command = np.array(
            [
                allocator.allocate(robot.moving(water), target, seed=seed).command
                for target, water in zip(wanted, velocity, strict=True)
            ]
        )
        missed = true_wrench(plant, layout, command, velocity) - wanted
        error = np.linalg.norm(missed / allocator.normalization.std, axis=1)
        row |= {f"{which}_mean": float(error.mean()), f"{which}_median": float(np.median(error))}
    return row | {"times_smaller": row["before_mean"] / row["after_mean"]}


def _closed_loop(robot: Layout, drawn: Layout, allocator: Allocator, plant: str, runs: int, seed: int) -> Row:
    """Depth error [m] and power [W] of circles by an allocator that believes in a layout."""
    rows = []
    for run in range(runs):
        path = make_trajectory("circle")
        loop = ClosedLoop(robot, allocator, path, plant=plant, truth=drawn, seed=seed + run)
        rows.append(follow_row(loop.run()))
    means = over_seeds(rows)
    return {name: means[name] for name in ("ate", "depth_rmse", "torque_w")}


def true_wrench(plant: str, layout: Layout, command: Array, velocity: Array) -> Array:
    """Mean wrenches (T, 6) [N, N m] that commands (T, n, 3) truly give a robot that moves through the water
    with (T, 6) [m/s, rad/s]."""
    found = []
    for one, water in zip(command, velocity, strict=True):
        force = make_plant(plant, layout)
        found.append(np.einsum("nk,nkw->w", _mean_force(force, layout, one, water), force.columns))
    return np.array(found)


def _mean_force(force: FinForce, layout: Layout, command: Array, water: Array) -> Array:
    """Mean forces (n, 3) of fins that follow a command (n, 3) for long."""
    motion = FinMotion(layout)
    motion.amplitude[:], motion.frequency[:], motion.direction[:] = command.T
    if not isinstance(force, FlexibleForce):
        return force.step(motion, force.step_s, water)
    dt, forces = force.step_s, []
    for k in range(round((SETTLE_S + MEAN_S) / dt)):
        motion.step(command, dt)
        step = force.step(motion, dt, water)
        if k * dt >= SETTLE_S:
            forces.append(step)
    # Each fin over whole beats of its own, or what swings within the beat would be left.
    beats = np.maximum(np.floor(MEAN_S * command[:, 1]), 1.0) / np.maximum(command[:, 1], 1.0 / MEAN_S)
    whole = np.minimum(np.rint(beats / dt).astype(int), len(forces))
    return np.array([np.mean(forces[-count:], axis=0)[i] for i, count in enumerate(whole)])


def true_layout(plant: str, layout: Layout, folder: Path) -> Layout | None:
    """The layout that says all that there is to know, where one can: of `offset` and of `flexible`."""
    if plant == "offset":
        for i, fin in enumerate(layout.fins):
            x, y, z = (np.array(fin.position) - np.array(CENTER)).tolist()
            angle = fin.mounting_angle + (ASKEW if i % 2 == 0 else -ASKEW)
            layout = layout.replace_fin(fin.name, position=(x, y, z), mounting_angle=angle)
        return layout
    if plant != "flexible":
        return None
    most = layout.upper[:, :2].max(axis=0)
    amplitude, frequency = (np.linspace(0.0, end, TABLE) for end in most)
    thrust = np.zeros((TABLE, TABLE))
    beats = [(a, f) for a in range(1, TABLE) for f in range(1, TABLE)]
    for k in range(0, len(beats), layout.n_fins):
        some = (beats[k : k + layout.n_fins] * layout.n_fins)[: layout.n_fins]
        command = np.array([[amplitude[a], frequency[f], 0.0] for a, f in some])
        force = _mean_force(FlexibleForce(layout), layout, command, np.zeros(6))
        for (a, f), own in zip(some, force, strict=True):
            thrust[a, f] = own[1]
    turns = np.linspace(-np.pi, np.pi, 13)
    parts = [thrust[..., None] * part(turns) for part in (np.zeros_like, np.cos, np.sin)]
    values = np.stack(parts, axis=-1)
    path = folder / "flexible.csv"
    axes = [amplitude, frequency, turns[:-1]]
    write_table(path, TableLaw(axes, values[:, :, :-1], True), *axes)
    for name in layout.names:
        layout = layout.replace_fin(name, model=FinModelSpec("table", (("path", str(path)),)))
    return layout
