"""What a fit to five minutes of swimming is worth: answers for the robot as drawn and as fitted, by truth.

The robot swims on a plant that its layout does not describe, with noisy sensors. Targets are wrenches of
random commands; each is asked of the layout and of the fitted one, at a random speed through the water, and
what the fins then truly give is compared with it.
"""

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.evaluation.experiment import Experiment
from finlab.evaluation.experiments.closed_loop import check_names
from finlab.evaluation.method_specs import MethodSpec, load_method_spec
from finlab.evaluation.progress import progress
from finlab.evaluation.report.document import Column, Row
from finlab.evaluation.scoring import paper_sigma
from finlab.evaluation.true_wrench import true_wrench
from finlab.fit.robot.fitted_layout import write_robot
from finlab.fit.robot.robot_fit import RobotFit, fit_robot
from finlab.fit.robot.swim_file import read_swim
from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from finlab.sim import PLANTS
from finlab.sim.excite import LONGEST_S, excitation

FASTEST = np.array([0.2, 0.03, 0.06, 0.1, 0.1, 0.3])
"""Speeds through the water [m/s, rad/s] at which targets are asked lie within these, either way."""
DOMAIN = 0x0B07
"""Leads the seed of every draw here."""


def run(
    layout: str = "A",
    plants: tuple[str, ...] = ("offset", "wake", "inflow", "flexible"),
    targets: int = 100,
    method: str = "dual",
    seed: int = 0,
) -> Iterator[Row]:
    """One row for each plant: the error of answers before and after the fit.

    Args:
        layout: a layout file or shipped name.
        plants: what the fins truly do.
        targets: wrenches asked of the layout as drawn and of the fitted one.
        method: who answers.
        seed: of all draws.
    """
    check_names("plants", plants, PLANTS)
    drawn, spec = load_layout(layout), load_method_spec(method)
    for plant in progress(plants, "plant"):
        with tempfile.TemporaryDirectory() as folder:
            began = time.process_time()
            fitted, fit = _fitted(drawn, plant, Path(folder), seed)
            used = ", ".join(trial.name for trial in fit.trials if trial.used)
            row: Row = {"plant": plant, "used": used, "fit_s": time.process_time() - began}
            row |= {"trusted": "no" if fit.doubts() else "yes", "targets": targets}
            for name, robot in (("drawn", drawn), ("fitted", fitted)):
                error = _errors(drawn, robot, spec, plant, targets, seed)
                row |= {f"{name}_mean": float(error.mean()), f"{name}_median": float(np.median(error))}
            yield row | {"times_smaller": row["drawn_mean"] / row["fitted_mean"]}


def _fitted(layout: Layout, plant: str, folder: Path, seed: int) -> tuple[Layout, RobotFit]:
    """The layout that five minutes of swimming give, read back from its file, and the fit."""
    log, path = folder / "log.npz", folder / "fitted.yaml"
    excitation(layout, LONGEST_S, plant=plant, seed=seed).run().save(log)
    fit = fit_robot(layout, [read_swim(log, layout)])
    write_robot(fit, path)
    return load_layout(path), fit


def _errors(drawn: Layout, robot: Layout, method: MethodSpec, plant: str, targets: int, seed: int) -> Array:
    """Normalized errors (targets,) of answers for a robot, by the true plant of the one that was drawn."""
    allocator = method.on(robot)
    rng, own = np.random.default_rng((DOMAIN, seed)), plant_of(drawn)
    wanted = own.wrench(own.sample(rng, (targets,)))
    velocity = rng.uniform(-FASTEST, FASTEST, (targets, 6))
    command = np.array(
        [
            allocator.allocate(target, flow=water, seed=seed).command
            for target, water in zip(wanted, velocity, strict=True)
        ]
    )
    missed = true_wrench(plant, drawn, command, velocity) - wanted
    return np.asarray(np.linalg.norm(missed / paper_sigma(), axis=1))


experiment = Experiment(
    name="robots",
    question="How much smaller are errors of answers for a robot that was fitted to five minutes of swim?",
    columns=(
        Column("plant", "plant", "code"),
        Column("used", "used besides"),
        Column("drawn_mean", "mean error as drawn", "error"),
        Column("fitted_mean", "fitted", "error"),
        Column("times_smaller", "times smaller", "three"),
        Column("drawn_median", "median as drawn", "error"),
        Column("fitted_median", "fitted", "error"),
        Column("trusted", "trusted"),
        Column("fit_s", "fit", "three", unit="s"),
    ),
    run=run,
    note="Wrenches of random commands at random speeds through the water; errors (`err_norm`) are those of "
    "what fins then truly give. Time: the processor's, the swim included.",
    quick={"plants": ("offset",), "targets": 20},
    each="plants",
)
